"""What the chip's :class:`~rtl.host.host_port.HostPort` does with bytes, in plain Python."""

from rtl.host.protocol import ACKNOWLEDGED, MAX_WORDS, OVERHEAD, REFUSED, VERSION, Command, LinkCount, Reason

from .wire import Deframer, Frame, pack_words, unpack_words

__all__ = ["Board"]

#: Bytes of a frame with the longest payload, and of the checksum
_LONGEST = 4 * (MAX_WORDS + 1) + OVERHEAD


class Board:
    """A board with memory, registers and values, that answers a host's frames.

    Parameters
    ----------
    num_words : int
        Of its memory.
    num_registers : int
        That are set.
    values : callable, optional
        Gives what else can be read, a list of integers.
    num_guarded : int
        So many registers are not set while a picture is drawn.

    Attributes
    ----------
    memory : dict from int to int
        Words by their addresses, zero where there is none.
    registers : list of int
    ready : bool
        Whether a picture may be started.
    starts : int
        How often one was.
    """

    def __init__(self, *, num_words=1 << 23, num_registers=1, values=lambda: [0], num_guarded=0):
        self.num_words = num_words
        self._num_registers = num_registers
        self._values = values
        self._num_guarded = num_guarded
        self.memory = {}
        self.ready = True
        self.starts = 0
        self.reset()

    def reset(self):
        """All but the memory is as after power-up."""
        self.registers = [0] * self._num_registers
        self.counts = [0] * len(LinkCount)
        self._deframer = Deframer(max_bytes=_LONGEST + 1)
        self._opened, self._last = False, None

    def receive(self, received):
        """Bytes that it answers with."""
        return b"".join(self._answer(inner) for inner in self._deframer.feed(received) if len(inner) >= OVERHEAD)

    def _answer(self, inner):
        frame = Frame.parse(inner) if len(inner) <= _LONGEST else None
        if frame is None:
            self.counts[LinkCount.DAMAGED] += 1
            return self._refuse(inner[1], Reason.CHECKSUM)
        words = unpack_words(frame.payload)
        if frame.kind == Command.OPEN:
            refusal, again = self._check(frame, words), False
            if not refusal:
                self._opened, self._last = True, (frame, 0)
        elif not self._opened:
            return self._refuse(frame.sequence, Reason.NOT_OPEN)
        elif (frame.sequence, frame.checksum) == (self._last[0].sequence, self._last[0].checksum):
            self.counts[LinkCount.DOUBLED] += 1
            refusal, again = self._last[1], True
        elif frame.sequence == (self._last[0].sequence + 1) % 256:
            refusal, again = self._check(frame, words), False
            self._last = frame, refusal
        else:
            return self._refuse(frame.sequence, Reason.SEQUENCE)
        self.counts[LinkCount.FRAMES] += not again
        if refusal:
            return self._refuse(frame.sequence, refusal)
        answer = self._execute(frame.kind, words, again)
        return Frame(frame.kind | ACKNOWLEDGED, frame.sequence, pack_words(answer)).encode()

    @staticmethod
    def _refuse(sequence, reason):
        return Frame(REFUSED, sequence, pack_words([reason])).encode()

    def _check(self, frame, words):
        """Why a frame cannot be done, 0 if it can."""
        kind = frame.kind
        if kind not in list(Command):
            return Reason.TYPE
        lengths = {Command.OPEN: (1, 1), Command.WRITE: (2, MAX_WORDS + 1), Command.START: (0, 0)}
        least, most = lengths.get(kind, (2, 2))
        if not least <= len(words) <= most:
            return Reason.LENGTH
        if kind in (Command.READ, Command.GET) and not 1 <= words[1] <= MAX_WORDS:
            return Reason.LENGTH
        if kind == Command.WRITE and words[0] + len(words) - 1 > self.num_words:
            return Reason.ADDRESS
        if kind == Command.READ and sum(words) > self.num_words:
            return Reason.ADDRESS
        if kind == Command.SET and words[0] >= self._num_registers:
            return Reason.REGISTER
        if kind == Command.GET and sum(words) > len(self._readable()):
            return Reason.REGISTER
        if not self.ready and (kind == Command.START or (kind == Command.SET and words[0] < self._num_guarded)):
            return Reason.BUSY
        return 0

    def _readable(self):
        return [*self.registers, *self.counts, *self._values()]

    def _execute(self, kind, words, again):
        """Words of the answer."""
        if kind == Command.OPEN:
            return [words[0], VERSION, MAX_WORDS, self.num_words, self._num_registers, len(self._readable())]
        if kind == Command.READ:
            return [self.memory.get(words[0] + place, 0) for place in range(words[1])]
        if kind == Command.GET:
            return self._readable()[words[0]:words[0] + words[1]]
        if again:
            return []
        if kind == Command.WRITE:
            self.memory.update(zip(range(words[0], words[0] + len(words) - 1), words[1:], strict=True))
        elif kind == Command.SET:
            self.registers[words[0]] = words[1]
        elif kind == Command.START:
            self.starts += 1
        return []
