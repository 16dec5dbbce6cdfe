"""What a driver says when something is wrong, and what it does over a pseudo-terminal."""

import random
import threading
import time
import zlib

import pytest

from rtl.host.protocol import END, Command, Reason
from sim.host import Board, BoardReset, Driver, Frame, LinkError, NoAnswer, Refused
from sim.host.tty import PseudoTerminal, SerialPort
from sim.host.wire import Deframer, pack_words


class Direct:
    """A port without faults, in a time of its own."""

    def __init__(self, board):
        self.board, self.time, self.waiting = board, 0.0, b""

    def clock(self):
        return self.time

    def write(self, sent):
        self.waiting += self.board.receive(sent)

    def read(self, seconds):
        waiting, self.waiting = self.waiting, b""
        self.time += 0 if waiting else seconds
        return waiting


class Nobody:
    def receive(self, received):
        return b""


class Noise:
    def receive(self, received):
        return random.Random(len(received)).randbytes(3)


class Endless(Direct):
    """A port at which noise never ends."""

    def read(self, seconds):
        self.time += 0.001
        return b"\x55\xaa"


def opened(board):
    port = Direct(board)
    driver = Driver(port, clock=port.clock)
    driver.open()
    return driver


def test_frames_are_as_documented():
    # By hand: write word 0xC0DB at address 5, with sequence number 0xC0.
    frame = Frame(Command.WRITE, 0xC0, pack_words([5, 0xC0DB]))
    wire = frame.encode()
    assert wire[:16] == bytes.fromhex("c0 02 dbdc 0800 05000000 dbdd dbdc 0000")
    assert wire[-1] == END
    assert wire.count(END) == 2
    inner, = Deframer().feed(wire)
    assert Frame.parse(inner) == frame
    assert Frame.parse(b"") is None
    # The check value of CRC-32, of "123456789", is in every catalogue; its residue follows from no header of ours.
    assert zlib.crc32(b"123456789") == 0xCBF43926


def test_memory_registers_and_pictures():
    board = Board(num_words=5000, num_registers=3, values=lambda: [11, 12])
    driver = opened(board)
    words = [random.Random(1).getrandbits(32) for _ in range(1000)]
    driver.write(100, words)
    assert driver.read(99, 1002) == [0, *words, 0]
    driver.set_register(2, 0xFFFFFFFF)
    assert driver.registers(0, 3) == [0, 0, 0xFFFFFFFF]
    assert driver.registers(7, 2) == [11, 12]
    driver.start()
    assert board.starts == 1
    assert (driver.memory_words, driver.num_registers, driver.num_readable) == (5000, 3, 9)
    assert driver.repeated == 0


@pytest.mark.parametrize(("act", "message", "reason"), [
    (lambda driver: driver.write(4999, [1, 2]), "writing memory: the board refuses it: that is outside its memory",
     Reason.ADDRESS),
    (lambda driver: driver.set_register(9, 0), "setting a register: the board refuses it: there is no such register",
     Reason.REGISTER),
    (lambda driver: driver.registers(0, 300),
     "reading registers: the board refuses it: the command has too few words or too many", Reason.LENGTH),
    (lambda driver: driver.start(),
     "starting a picture: the board refuses it: it is drawing a picture; wait until it is ready", Reason.BUSY),
])
def test_refusals(act, message, reason):
    board = Board(num_words=5000, num_registers=3)
    board.ready = False
    driver = opened(board)
    with pytest.raises(Refused) as caught:
        act(driver)
    assert (str(caught.value), caught.value.reason) == (message, reason)
    # And it goes on.
    driver.write(0, [7])
    assert driver.read(0, 1) == [7]


class Older(Board):
    """A board that knows no pictures."""

    def _check(self, frame, words):
        return Reason.TYPE if frame.kind == Command.START else super()._check(frame, words)


def test_an_unknown_command_is_told():
    with pytest.raises(Refused, match=r"^starting a picture: the board refuses it: it does not know this command; "
                                      r"is its bitstream of this version\?$"):
        opened(Older()).start()


@pytest.mark.parametrize("board", [Nobody(), Noise()])
def test_nobody_answers(board):
    port = Direct(board)
    driver = Driver(port, clock=port.clock)
    with pytest.raises(NoAnswer) as caught:
        driver.open()
    assert str(caught.value) == ("opening the link: no answer to 8 attempts; is the board powered and its bitstream "
                                 "loaded, and is it the right port?")
    with pytest.raises(LinkError, match=r"^writing memory: the link is not open; call open\(\) first$"):
        driver.write(0, [1])


def test_endless_noise_ends():
    port = Endless(Nobody())
    with pytest.raises(NoAnswer):
        Driver(port, clock=port.clock).open()
    assert port.time < 20


def test_a_reset_is_told():
    board = Board()
    driver = opened(board)
    driver.write(3, [4])
    board.reset()
    with pytest.raises(BoardReset) as caught:
        driver.write(4, [5])
    assert str(caught.value) == ("writing memory: the board has been reset, or another program has opened its link; "
                                 "open it again and load everything anew")
    assert board.memory == {3: 4}
    driver.open()
    driver.write(4, [5])
    assert board.memory == {3: 4, 4: 5}


def test_two_programs_do_not_mix():
    board = Board()
    first = opened(board)
    second = opened(board)
    while second._sequence == first._sequence:
        second.open()
    with pytest.raises(BoardReset):
        first.write(0, [1])
    second.write(0, [2])
    assert board.memory == {0: 2}


def test_another_version_is_told(monkeypatch):
    monkeypatch.setattr("sim.host.board.VERSION", 9)
    with pytest.raises(LinkError, match=r"^opening the link: the board speaks version 9 of the protocol; this is 1: "
                                        "load a bitstream of the same version$"):
        opened(Board())


def test_words_that_are_none_are_not_sent():
    with pytest.raises(LinkError, match=r"^writing memory: words must be from 0 to 2³² − 1$"):
        opened(Board()).write(0, [1, -1])


@pytest.fixture
def terminal():
    """A pseudo-terminal with a board at its other end."""
    board, terminal, ends = Board(num_words=9000), PseudoTerminal(), threading.Event()

    def serve():
        while not ends.is_set():
            terminal.serve(board, seconds=0.02)

    thread = threading.Thread(target=serve)
    thread.start()
    yield terminal, board
    ends.set()
    thread.join()
    terminal.close()


@pytest.mark.parametrize("baud", [115200, 3_000_000])
def test_over_a_terminal(terminal, baud):
    pseudo, board = terminal
    port = SerialPort(pseudo.path, baud=baud)
    driver = Driver(port)
    driver.open()
    # Each byte goes as it is, those that terminals are fond of too.
    words = [0x03041113, 0x0A0D1A00, 0xC0DBDCDD, 0x7F1C1516, *random.Random(2).choices(range(1 << 32), k=4000)]
    driver.write(7, words)
    assert driver.read(7, len(words)) == words
    assert [board.memory[7 + place] for place in range(len(words))] == words
    port.close()
    # A host that went away in the middle leaves nothing behind.
    port = SerialPort(pseudo.path, baud=baud)
    port.write(Frame(Command.WRITE, 1, pack_words([0, 1, 2, 3])).encode()[:-7])
    port.close()
    port = SerialPort(pseudo.path, baud=baud)
    driver = Driver(port)
    driver.open()
    driver.write(0, [5])
    assert board.memory[0] == 5
    port.close()


def test_a_terminal_at_which_nobody_is():
    pseudo = PseudoTerminal()
    port = SerialPort(pseudo.path)
    begin = time.monotonic()
    with pytest.raises(NoAnswer):
        Driver(port, timeout=0.02).open()
    assert 0.1 < time.monotonic() - begin < 10
    port.close()
    pseudo.close()


def test_what_is_no_terminal(tmp_path):
    with pytest.raises(LinkError) as caught:
        SerialPort(tmp_path / "none")
    assert str(caught.value) == f"{tmp_path / 'none'}: cannot be opened: No such file or directory"
    (tmp_path / "file").write_text("")
    with pytest.raises(LinkError,
                       match="is not a serial port that can do 3000000 baud: Inappropriate ioctl for device"):
        SerialPort(tmp_path / "file")
    with pytest.raises(LinkError, match="this system has no rate of 1234 baud; 115200 and 3000000 are usual"):
        SerialPort(tmp_path / "file", baud=1234)
