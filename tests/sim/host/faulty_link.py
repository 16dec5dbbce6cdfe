"""A cable that damages what it carries, and a random session over it whose every effect is looked at."""

from collections import Counter, deque

from rtl.host.protocol import END, MAX_WORDS, LinkCount, Reason
from sim.host import BoardReset, Driver, NoAnswer, Refused

__all__ = ["FAULTS", "FaultyLink", "Session"]

FAULTS = ("corrupt", "burst", "lose", "double", "truncate", "behead", "drop byte", "insert byte", "insert END", "noise")
_NUM_WORDS = 4096
_NUM_REGISTERS = 6
_FIRST_VALUE = _NUM_REGISTERS + len(LinkCount)
_VALUES = [0xDEADBEEF, 0xC0DBDCDD, 7]


class FaultyLink:
    """A port for a :class:`~sim.host.Driver` with a board behind it, in a time of its own.

    Parameters
    ----------
    board : Board
        Or whatever has ``receive``.
    rng : random.Random
        Of the faults.
    rate : float
        Of the frames that are damaged, either way.
    late : float
        Of the answers that come after the next read only.
    """

    def __init__(self, board, rng, *, rate, late=0.02):
        self.board = board
        self.rate = rate
        self.dead = False
        self.frames = 0
        self.faults = Counter()
        self._rng = rng
        self._late = late
        self._time = 0.0
        self._waiting = deque()

    def clock(self):
        return self._time

    def write(self, sent):
        answer = self.board.receive(self.damaged(sent))
        # Each frame of an answer by itself, as they come one by one.
        for piece in self._frames(answer):
            piece = self.damaged(piece)
            late = self._rng.random() < self._late
            self.faults["late"] += late
            self._waiting.append([late, piece])

    def read(self, seconds):
        self._time += 1e-5
        if self._waiting and not self._waiting[0][0] and self._waiting[0][1]:
            piece = self._waiting[0][1]
            length = self._rng.choice((1, len(piece), self._rng.randrange(1, len(piece) + 1)))
            self._waiting[0][1] = piece[length:]
            if length == len(piece):
                self._waiting.popleft()
            return piece[:length]
        if self._waiting:
            if not self._waiting[0][1]:
                self._waiting.popleft()
                return b""
            self._waiting[0][0] = False
        self._time += seconds
        return b""

    @staticmethod
    def _frames(answer):
        inner = [each for each in answer.split(bytes([END])) if each]
        return [bytes([END]) + each + bytes([END]) for each in inner]

    def damaged(self, sent):
        """What arrives of a frame."""
        rng = self._rng
        self.frames += 1
        if self.dead:
            self.faults["lose"] += 1
            return b""
        if rng.random() >= self.rate:
            return sent
        fault = rng.choice(FAULTS)
        self.faults[fault] += 1
        place = rng.randrange(len(sent))
        data = bytearray(sent)
        if fault == "corrupt":
            for _ in range(rng.choice((1, 1, 2, 3, 8))):
                data[rng.randrange(len(data))] ^= 1 << rng.randrange(8)
        elif fault == "burst":
            data[place:place + rng.randrange(1, 40)] = rng.randbytes(rng.randrange(1, 40))
        elif fault == "lose":
            data = b""
        elif fault == "double":
            data = data * 2
        elif fault == "truncate":
            data = data[:place]
        elif fault == "behead":
            data = data[place:]
        elif fault == "drop byte":
            del data[place]
        elif fault == "insert byte":
            data.insert(place, rng.randrange(256))
        elif fault == "insert END":
            data.insert(place, END)
        else:
            data = data + rng.randbytes(rng.randrange(1, 60))
        return bytes(data)


class Session:
    """Random commands, each held against what the board has; asserts that nothing is wrong that nobody has reported.

    Parameters
    ----------
    board : object
        With ``receive, reset, memory, registers, starts, ready``, of :attr:`shape`.
    rng : random.Random
        Of commands and faults.
    rate : float
        Of the frames that are damaged, either way.
    """

    #: What a board must have.
    shape = {"num_words": _NUM_WORDS, "num_registers": _NUM_REGISTERS, "num_guarded": 2}
    values = staticmethod(lambda: list(_VALUES))

    def __init__(self, board, rng, *, rate=0.15):
        self.board = board
        self.link = FaultyLink(board, rng, rate=rate)
        self.driver = None
        self.commands = Counter()
        self.reported = Counter()
        self._repeated, self._was_reset = 0, False
        self._rng = rng
        self._memory, self._registers = dict(board.memory), [0] * _NUM_REGISTERS
        self._starts = board.starts

    @property
    def repeated(self):
        """Frames that a driver has sent again."""
        return self._repeated + (self.driver.repeated if self.driver else 0)

    @property
    def damaged(self):
        """Frames that have not arrived as they were sent."""
        return sum(self.link.faults[fault] for fault in FAULTS)

    def run(self, frames, *, damaged=0):
        """Goes on until the link has carried so many frames, and damaged so many."""
        while self.link.frames < frames or self.damaged < damaged:
            if self.driver is None:
                self._open()
            else:
                self._misfortune()
                self._command()
        self.link.rate, self.link.dead = 0.0, False
        while getattr(self.board, "reset_pending", False):
            self.board.receive(b"")
        self._open()
        # At the end, all of the memory by the link itself.
        found = self.driver.read(0, _NUM_WORDS)
        assert found == [self._memory.get(address, 0) for address in range(_NUM_WORDS)]

    def _open(self):
        if self.driver is not None:
            self._repeated += self.driver.repeated
            self.driver = None
        driver = Driver(self.link, clock=self.link.clock, rng=self._rng)
        # A reset that was to come may come behind the answer.
        pending = getattr(self.board, "reset_pending", False)
        try:
            driver.open()
        except NoAnswer:
            self.reported["NoAnswer"] += 1
            self._repeated += driver.repeated
            self.link.dead = False
            return
        self.driver = driver
        assert (driver.memory_words, driver.num_registers) == (_NUM_WORDS, _NUM_REGISTERS)
        self._registers = list(self.board.registers)
        self._was_reset = pending

    def _misfortune(self):
        rng = self._rng
        event = rng.random()
        if event < 0.002:
            # The cable is pulled.
            self.link.dead = True
        elif event < 0.004:
            self.reported["resets"] += 1
            self._was_reset = True
            if hasattr(self.board, "reset_within"):
                # In the middle of whatever comes next
                self.board.reset_within(rng.randrange(3000))
            else:
                self.board.reset()
        elif event < 0.006:
            # The host is gone in mid-upload, and another one comes.
            partial = bytes([END]) + rng.randbytes(rng.randrange(1, 400)).replace(bytes([END]), b"")
            self.board.receive(partial)
            self.reported["hosts gone"] += 1
            self._open()
        elif event < 0.05:
            self.board.ready = not self.board.ready

    def _command(self):
        rng = self._rng
        if self.driver is None:
            return
        name = rng.choice(("write", "write", "write", "read", "set", "get", "start", "beyond"))
        before = dict(self._memory), list(self._registers), self._starts
        try:
            getattr(self, f"_{name}")()
        except NoAnswer:
            self.reported["NoAnswer"] += 1
            self.link.dead = False
            self._in_doubt(before)
        except BoardReset:
            self.reported["BoardReset"] += 1
            if not self._was_reset:
                raise AssertionError("a reset is reported that never was") from None
            self._in_doubt(before)
        else:
            self.commands[name] += 1
        assert self.board.memory == self._memory, "the memory is not what was written"
        if self.driver is not None and self.board.registers != self._registers:
            # A reset between two commands, which the next one has to tell.
            assert self.board.registers == [0] * _NUM_REGISTERS
        assert self.board.starts == self._starts, "a picture more or less than was started"

    def _in_doubt(self, before):
        """What was asked for last is done or not; of an upload in which the board was reset, words are.

        Registers are then what they are, as a board that was reset has lost them.
        """
        memory, _, starts = before
        found = dict(self.board.memory)
        if self._was_reset:
            for address, word in found.items():
                assert word in (memory.get(address, 0), self._memory.get(address, 0)), f"word {address} is of nobody"
        else:
            assert found in (memory, self._memory)
        assert self.board.starts in (starts, self._starts)
        self._memory, self._registers, self._starts = found, self.board.registers, self.board.starts
        self._repeated += self.driver.repeated
        self.driver = None

    def _write(self):
        count = self._rng.choice((1, 2, 5, 20, 20, MAX_WORDS, MAX_WORDS + 3))
        address = self._rng.randrange(_NUM_WORDS - count)
        words = [self._rng.choice((self._rng.getrandbits(32), 0xC0C0DBDB)) for _ in range(count)]
        for start in range(0, count, MAX_WORDS):
            piece = words[start:start + MAX_WORDS]
            # One frame at a time, each of which is done as a whole or not at all.
            self._settled()
            self._memory.update(zip(range(address + start, address + start + len(piece)), piece, strict=True))
            self.driver.write(address + start, piece)

    def _settled(self):
        assert self.board.memory == self._memory

    def _read(self):
        count = self._rng.choice((1, 3, 30))
        address = self._rng.randrange(_NUM_WORDS - count)
        assert self.driver.read(address, count) == [self._memory.get(address + place, 0) for place in range(count)]

    def _set(self):
        number, value = self._rng.randrange(_NUM_REGISTERS), self._rng.getrandbits(32)
        before = list(self._registers)
        self._registers[number] = value
        busy = not self.board.ready and number < self.shape["num_guarded"]
        reason = self._refusal(self.driver.set_register, number, value)
        assert reason == (Reason.BUSY if busy else None)
        if busy:
            self._registers = before

    def _get(self):
        assert self.driver.registers(0, _NUM_REGISTERS) == self._registers
        assert self.driver.registers(_FIRST_VALUE, len(_VALUES)) == _VALUES

    def _start(self):
        self._starts += 1
        reason = self._refusal(self.driver.start)
        assert reason == (None if self.board.ready else Reason.BUSY)
        if reason is not None:
            self._starts -= 1

    def _beyond(self):
        assert self._refusal(self.driver.write, _NUM_WORDS - 1, [1, 2]) == Reason.ADDRESS

    @staticmethod
    def _refusal(command, *arguments):
        """Why the board refuses a command, None if it does not."""
        try:
            command(*arguments)
        except Refused as error:
            return error.reason
        return None
