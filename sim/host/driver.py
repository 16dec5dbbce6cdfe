"""A host's side of the link: commands that are done once, or an error that says so."""

import secrets
import time

from rtl.host.protocol import ACKNOWLEDGED, MAX_WORDS, OVERHEAD, REFUSED, VERSION, Command, Reason

from .wire import Deframer, Frame, pack_words, unpack_words

__all__ = ["BoardReset", "Driver", "LinkError", "NoAnswer", "Refused"]


class LinkError(Exception):
    """A command could not be done."""


class NoAnswer(LinkError):
    """The board does not answer: whether it has done what was asked of it last is not known."""


class BoardReset(LinkError):
    """The board has been reset, or somebody else has opened the link: its registers are not what they were."""


class Refused(LinkError):
    """The board has understood, and cannot do it; nothing has changed.

    Parameters
    ----------
    message : str
        For people.
    reason : Reason
        As the board gives it.
    """

    def __init__(self, message, reason):
        super().__init__(message)
        self.reason = reason


_MEANING = {
    Reason.TYPE: "it does not know this command; is its bitstream of this version?",
    Reason.LENGTH: "the command has too few words or too many",
    Reason.ADDRESS: "that is outside its memory",
    Reason.REGISTER: "there is no such register",
    Reason.BUSY: "it is drawing a picture; wait until it is ready",
}
_NAMES = {Command.OPEN: "opening the link", Command.WRITE: "writing memory", Command.READ: "reading memory",
          Command.SET: "setting a register", Command.GET: "reading registers", Command.START: "starting a picture"}
#: So many times the timeout an answer may take to come, once it has begun
_PATIENCE = 8
_AGAIN = "again"


class Driver:
    """Commands to a board, each repeated until it is answered.

    Parameters
    ----------
    port : object
        ``write(bytes)`` sends all of them; ``read(seconds)`` returns what has come, at least a byte, or b"" if nothing
        has in so many seconds.
    timeout : float
        Seconds for which an answer may fail to come, before a command is sent again.
    attempts : int
        How often it is sent at most.
    clock : callable
        Seconds.
    rng : random.Random, optional
        By which sessions are told apart; the system's, if there is none.

    Attributes
    ----------
    memory_words, num_registers, num_readable : int
        What the board has, known once the link is open.
    sent, repeated : int
        Frames, and how many of them not for the first time.

    Raises
    ------
    NoAnswer, BoardReset, Refused
        By all commands. After the first two the link has to be opened again.
    """

    def __init__(self, port, *, timeout=0.25, attempts=8, clock=time.monotonic,
                 rng=None):
        self._port = port
        self._timeout = timeout
        self._attempts = attempts
        self._clock = clock
        self._rng = secrets.SystemRandom() if rng is None else rng
        self._sequence = None
        self.sent = self.repeated = 0
        self.memory_words = self.num_registers = self.num_readable = 0

    def open(self):
        """Begins anew, whatever was before."""
        self._deframer = Deframer()
        nonce = self._rng.getrandbits(32)
        # Any number will do, as whatever comes before the answer with this nonce is not looked at.
        sequence = self._rng.randrange(256)
        self._sequence = None
        words = self._exchange(Command.OPEN, sequence, [nonce], length=6, nonce=nonce)
        _, version, max_words, self.memory_words, self.num_registers, self.num_readable = words
        if version != VERSION or max_words != MAX_WORDS:
            raise LinkError(f"opening the link: the board speaks version {version} of the protocol; this is {VERSION}: "
                            "load a bitstream of the same version")
        self._sequence = sequence

    def write(self, address, words):
        """Writes words to memory from an address on; what is written twice is the same."""
        for start in range(0, len(words), MAX_WORDS):
            self._command(Command.WRITE, [address + start, *words[start:start + MAX_WORDS]], length=0)

    def read(self, address, count):
        """A list of so many words of memory."""
        found = []
        for start in range(0, count, MAX_WORDS):
            piece = min(MAX_WORDS, count - start)
            found += self._command(Command.READ, [address + start, piece], length=piece)
        return found

    def set_register(self, number, value):
        """Sets a register."""
        self._command(Command.SET, [number, value], length=0)

    def registers(self, first, count):
        """A list of registers, of what the link counts, and of values, in this order."""
        return list(self._command(Command.GET, [first, count], length=count))

    def start(self):
        """Starts a picture."""
        self._command(Command.START, [], length=0)

    def _command(self, kind, words, *, length):
        if self._sequence is None:
            raise LinkError(f"{_NAMES[kind]}: the link is not open; call open() first")
        if any(not 0 <= word < 1 << 32 for word in words):
            raise LinkError(f"{_NAMES[kind]}: words must be from 0 to 2³² − 1")
        sequence = (self._sequence + 1) % 256
        try:
            answer = self._exchange(kind, sequence, words, length=length)
        except (NoAnswer, BoardReset):
            self._sequence = None
            raise
        except Refused:
            self._sequence = sequence
            raise
        self._sequence = sequence
        return answer

    def _exchange(self, kind, sequence, words, *, length, nonce=None):
        """Words of the answer to a command."""
        frame = Frame(kind, sequence, pack_words(words)).encode()
        for attempt in range(self._attempts):
            self.sent += 1
            self.repeated += attempt > 0
            self._port.write(frame)
            answer = self._await(kind, sequence, length, nonce)
            if answer is not None:
                return answer
        raise NoAnswer(f"{_NAMES[kind]}: no answer to {self._attempts} attempts; is the board powered and its "
                       "bitstream loaded, and is it the right port?")

    def _await(self, kind, sequence, length, nonce):
        """Words of the answer, None if it is to be asked again."""
        begin = self._clock()
        deadline = begin + self._timeout
        while (left := deadline - self._clock()) > 0:
            received = self._port.read(left)
            if received:
                # As long as something comes an answer may, but noise may come for ever.
                deadline = min(self._clock(), begin + (_PATIENCE - 1) * self._timeout) + self._timeout
            answers = [self._judge(Frame.parse(inner), kind, sequence, length, nonce)
                       for inner in self._deframer.feed(received) if len(inner) >= OVERHEAD]
            for answer in answers:
                if answer not in (None, _AGAIN):
                    return answer
            if _AGAIN in answers:
                return None
        return None

    @staticmethod
    def _judge(answer, kind, sequence, length, nonce):
        """Words of an answer to a command; _AGAIN if it should be repeated at once, None if it is not the answer."""
        if answer is None:
            return _AGAIN
        words = unpack_words(answer.payload)
        if answer.kind == REFUSED and len(words) == 1:
            reason = words[0]
            if reason == Reason.CHECKSUM:
                return _AGAIN
            # Before a link is open, it is of what an earlier host has asked.
            if kind == Command.OPEN or answer.sequence != sequence:
                return None
            if reason in (Reason.NOT_OPEN, Reason.SEQUENCE):
                raise BoardReset(f"{_NAMES[kind]}: the board has been reset, or another program has opened its link; "
                                 "open it again and load everything anew")
            if reason not in list(Reason):
                raise LinkError(f"{_NAMES[kind]}: the board refuses it with the unknown reason {reason}")
            raise Refused(f"{_NAMES[kind]}: the board refuses it: {_MEANING[Reason(reason)]}", Reason(reason))
        if (answer.kind, answer.sequence, len(words)) != (kind | ACKNOWLEDGED, sequence, length):
            return None
        if nonce is not None and words[0] != nonce:
            return None
        return words
