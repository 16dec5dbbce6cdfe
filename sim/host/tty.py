"""Serial ports and pseudo-terminals, for a driver and for a simulated board."""

import errno
import os
import select
import termios
import tty

from .driver import LinkError

__all__ = ["PseudoTerminal", "SerialPort"]

_CHUNK = 1 << 14


class SerialPort:
    """A terminal device as a driver's port: bytes as they are, eight bits, no parity, one stop bit, no flow control.

    Parameters
    ----------
    path : str or Path
        Of the device, or of a simulated board's pseudo-terminal.
    baud : int
        Rate.

    Raises
    ------
    LinkError
        If it is no terminal, cannot be opened, or does not know the rate; and later, if it is unplugged.
    """

    def __init__(self, path, *, baud=3_000_000):
        speed = getattr(termios, f"B{baud}", None)
        if speed is None:
            raise LinkError(f"{path}: this system has no rate of {baud} baud; 115200 and 3000000 are usual")
        self._path = path
        try:
            self._file = os.open(path, os.O_RDWR | os.O_NOCTTY | os.O_NONBLOCK)
        except OSError as error:
            raise LinkError(f"{path}: cannot be opened: {error.strerror}") from error
        try:
            tty.setraw(self._file)
            settings = termios.tcgetattr(self._file)
            settings[2] = termios.CS8 | termios.CREAD | termios.CLOCAL
            settings[4] = settings[5] = speed
            termios.tcsetattr(self._file, termios.TCSANOW, settings)
            termios.tcflush(self._file, termios.TCIOFLUSH)
        except termios.error as error:
            os.close(self._file)
            raise LinkError(f"{path}: is not a serial port that can do {baud} baud: {error.args[1]}") from error

    def write(self, sent):
        """Sends all of the bytes; gives up after seconds in which none could be sent, as what is lost is sent again."""
        while sent:
            try:
                sent = sent[os.write(self._file, sent):]
            except BlockingIOError:
                if not select.select([], [self._file], [], 2.0)[1]:
                    return
            except OSError as error:
                raise self._unplugged(error) from error

    def read(self, seconds):
        """Bytes that have come, none if none do in so many seconds."""
        if not select.select([self._file], [], [], seconds)[0]:
            return b""
        try:
            received = os.read(self._file, _CHUNK)
        except BlockingIOError:
            return b""
        except OSError as error:
            raise self._unplugged(error) from error
        if not received:
            raise self._unplugged(OSError(errno.EIO, os.strerror(errno.EIO)))
        return received

    def close(self):
        """Closes the device."""
        os.close(self._file)

    def _unplugged(self, error):
        return LinkError(f"{self._path}: is gone: {error.strerror}; is the cable in?")


class PseudoTerminal:
    """A pseudo-terminal whose other end a simulated board answers.

    Attributes
    ----------
    path : str
        Of the end for drivers.
    """

    def __init__(self):
        self._file, self._other = os.openpty()
        # The other end stays open, so that drivers may come and go.
        tty.setraw(self._other)
        os.set_blocking(self._file, False)
        self.path = os.ttyname(self._other)
        self._unsent = b""

    def serve(self, board, *, seconds):
        """Passes what has come to a board's ``receive``, and its answer back; waits so long for something to come."""
        writes = [self._file] if self._unsent else []
        readable, writable, _ = select.select([self._file], writes, [], seconds)
        if readable:
            self._unsent += board.receive(os.read(self._file, _CHUNK))
        if writable or readable:
            self.send(b"")

    def send(self, answer):
        """Passes what a board says, behind what could not be passed before, as far as that can be done now."""
        self._unsent += answer
        if self._unsent:
            try:
                self._unsent = self._unsent[os.write(self._file, self._unsent):]
            except BlockingIOError:
                pass

    def close(self):
        """Closes both ends."""
        os.close(self._file)
        os.close(self._other)
