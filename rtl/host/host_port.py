"""What a host may ask of a chip, in frames of bytes."""

from amaranth.hdl import Array, Cat, Const, Module, Mux, Signal
from amaranth.lib import data, stream, wiring
from amaranth.lib.wiring import In, Out

from ..queue import Queue
from .frame_receiver import MAX_PAYLOAD, FrameReceiver
from .frame_sender import FrameSender, sent_layout
from .protocol import ACKNOWLEDGED, MAX_WORDS, REFUSED, VERSION, Command, LinkCount, Reason
from .register_file import RegisterFile

__all__ = ["HostPort", "host_members"]

#: More than from a frame's words to whether it is refused
_CHECK_CYCLES = 5


def host_members(*, word_width, num_registers, num_values):
    """Members of a :class:`HostPort` besides its bytes."""
    write = data.StructLayout({"address": word_width, "word": 32, "mask": 4})
    return {
        "write": Out(stream.Signature(write)),
        "written": In(1, init=1),
        "request": Out(stream.Signature(word_width)),
        "data": In(stream.Signature(32, always_ready=True)),
        "registers": Out(data.ArrayLayout(32, num_registers)),
        "values": In(data.ArrayLayout(32, num_values)),
        "start": Out(1),
        "ready": In(1),
    }


class HostPort(wiring.Component):
    """Executes a host's frames one after the other, each once, and answers each.

    A frame is executed if its checksum is right and its sequence number follows the last one's. One that is the same as
    the last is answered as that was, and not executed again, unless it reads. Nothing is written before all of a frame
    has been checked. A link is opened first, which sets the number; after reset all else is refused.

    A frame is answered when it is done: words are ``written``, so that whoever reads the memory thereafter finds them.
    Frames that come before are missed, and counted.

    Parameters
    ----------
    word_width : int
        Bits of an address in memory, of 32-bit words.
    num_words : int
        Words that there are, from address 0 on.
    num_registers : int
        Registers that are set, 32 bits each.
    num_values : int
        What else can be read, 32 bits each.
    num_guarded : int
        So many registers, the first ones, are not set while the chip is not ``ready``.

    Members
    -------
    i, o : streams of bytes, from the host and to it
    write : stream of words to write, as :func:`~rtl.sdram.write_port.write_layout` has them
    written : every word taken is where later accesses find it
    request, data : streams of addresses of words, and of the words
    registers : what has been set, zeros after reset
    values : behind the registers and the :class:`~.protocol.LinkCount`, what can be read
    start : draw a picture; only while ``ready``
    ready : a picture may be started

    Raises
    ------
    ValueError
        If there are more words than addresses, or more to be read than a frame carries.
    """

    def __init__(self, *, word_width, num_words=None, num_registers=1, num_values=1, num_guarded=0):
        self._num_words = 1 << word_width if num_words is None else num_words
        if not 0 < self._num_words <= 1 << word_width <= 1 << 31:
            raise ValueError(f"{self._num_words} words have no addresses of {word_width} bits")
        self._num_guarded = num_guarded
        self._num_readable = num_registers + len(LinkCount) + num_values
        if self._num_readable > MAX_WORDS:
            raise ValueError(f"{self._num_readable} registers, counts and values; a frame has {MAX_WORDS} at most")
        super().__init__({
            "i": In(stream.Signature(8, always_ready=True)),
            "o": Out(stream.Signature(8)),
            **host_members(word_width=word_width, num_registers=num_registers, num_values=num_values),
        })

    def elaborate(self, platform):
        m = Module()
        m.submodules.receiver = receiver = FrameReceiver()
        m.submodules.sender = sender = FrameSender()
        wiring.connect(m, wiring.flipped(self.i), receiver.i)
        wiring.connect(m, sender.o, wiring.flipped(self.o))
        # A register between the choice of a word and its bytes
        m.submodules.answers = answers = Queue(sent_layout(), depth=1)
        wiring.connect(m, answers.o, sender.i)

        counts = Signal(data.ArrayLayout(32, len(LinkCount)))
        num_registers = self.registers.shape().length
        m.submodules.file = file = RegisterFile(num_registers=num_registers,
                                                num_values=self._num_readable - num_registers)
        m.d.comb += [self.registers.eq(file.registers), Cat(*file.values).eq(Cat(*counts, *self.values))]
        with m.If(receiver.missed):
            m.d.sync += counts[LinkCount.MISSED].eq(counts[LinkCount.MISSED] + 1)

        frame, num_words = receiver.frame.payload, receiver.frame.payload.num_words
        opened, sequence, checksum = Signal(), Signal(8, reset_less=True), Signal(32, reset_less=True)
        last_reason = Signal(8, reset_less=True)
        # The payload's first two words
        first, second = Signal(32, reset_less=True), Signal(32, reset_less=True)
        reason, doubled = Signal(8, reset_less=True), Signal(reset_less=True)
        place, left, is_last = Signal(range(MAX_PAYLOAD + 1)), Signal(range(MAX_WORDS + 1)), Signal()
        number = Signal(range(self._num_readable))
        address = Signal(len(self.request.payload), reset_less=True)
        word = Signal(32, reset_less=True)
        m.d.comb += [file.set.number.eq(number), file.set.word.eq(second), file.number.eq(number)]

        # What a frame is, and whether what it asks for can be done
        is_same, follows, refusal = Signal(reset_less=True), Signal(reset_less=True), Signal(8, reset_less=True)
        m.d.sync += [is_same.eq((frame.sequence == sequence) & (frame.checksum == checksum)),
                     follows.eq(frame.sequence == (sequence + 1)[:8])]
        self._check(m, frame, first, second, refusal)

        def answer(m, *, kind, length):
            m.d.comb += [
                answers.i.valid.eq(1),
                answers.i.payload.word.eq(Cat(kind, frame.sequence, Const(0, 2), Const(length, 14)
                                             if isinstance(length, int) else length)),
                answers.i.payload.last.eq(length == 0),
            ]

        finished = Signal()
        m.d.comb += receiver.frame.ready.eq(finished)
        # Whether the last is due is known before it is.
        count_down = [left.eq(left - 1), is_last.eq(left == 2)]
        m.d.comb += [
            self.write.payload.address.eq(address), self.write.payload.word.eq(receiver.word),
            self.write.payload.mask.eq(-1), self.request.payload.eq(address),
        ]
        opening = [first, Const(VERSION, 32), Const(MAX_WORDS, 32), Const(self._num_words, 32),
                   Const(num_registers, 32), Const(self._num_readable, 32)]
        with m.FSM():
            with m.State("idle"):
                m.d.comb += receiver.reading.eq(receiver.frame.valid)
                with m.If(receiver.frame.valid):
                    m.next = "first"
            with m.State("first"):
                m.d.comb += [receiver.reading.eq(1), receiver.address.eq(1)]
                m.d.sync += first.eq(receiver.word)
                m.next = "second"
            with m.State("second"):
                m.d.sync += [second.eq(receiver.word), left.eq(_CHECK_CYCLES), is_last.eq(0)]
                m.next = "judge"
            with m.State("judge"):
                m.d.sync += count_down
                with m.If(is_last):
                    m.next = "check"
            with m.State("check"):
                # An upload's words come from the second on.
                m.d.comb += [receiver.reading.eq(1), receiver.address.eq(1)]
                m.d.sync += [doubled.eq(0), place.eq(2), address.eq(first), number.eq(first), left.eq(second),
                             is_last.eq(second == 1), reason.eq(refusal)]
                m.next = "decide"
                with m.If(~frame.good):
                    m.d.sync += [counts[LinkCount.DAMAGED].eq(counts[LinkCount.DAMAGED] + 1),
                                 reason.eq(Reason.CHECKSUM)]
                    m.next = "refuse"
                with m.Elif(frame.type == Command.OPEN):
                    with m.If(refusal == 0):
                        m.d.sync += [opened.eq(1), sequence.eq(frame.sequence), checksum.eq(frame.checksum),
                                     last_reason.eq(0)]
                with m.Elif(~opened):
                    m.d.sync += reason.eq(Reason.NOT_OPEN)
                    m.next = "refuse"
                with m.Elif(is_same):
                    m.d.sync += [counts[LinkCount.DOUBLED].eq(counts[LinkCount.DOUBLED] + 1), doubled.eq(1),
                                 reason.eq(last_reason)]
                with m.Elif(follows):
                    m.d.sync += [sequence.eq(frame.sequence), checksum.eq(frame.checksum), last_reason.eq(refusal)]
                with m.Else():
                    m.d.sync += reason.eq(Reason.SEQUENCE)
                    m.next = "refuse"
            with m.State("decide"):
                m.d.sync += counts[LinkCount.FRAMES].eq(counts[LinkCount.FRAMES] + ~doubled)
                m.next = "acknowledge"
                with m.If(reason != 0):
                    m.next = "refuse"
                with m.Else():
                    with m.Switch(frame.type):
                        with m.Case(Command.OPEN):
                            m.next = "open"
                        with m.Case(Command.WRITE):
                            m.d.sync += [left.eq(num_words - 1), is_last.eq(num_words == 2)]
                            with m.If(~doubled):
                                m.next = "write"
                        with m.Case(Command.READ):
                            m.next = "read"
                        with m.Case(Command.SET):
                            m.d.comb += file.set.valid.eq(~doubled)
                        with m.Case(Command.GET):
                            m.next = "get"
                        with m.Case(Command.START):
                            m.d.comb += self.start.eq(~doubled)

            with m.State("write"):
                m.d.comb += self.write.valid.eq(1)
                with m.If(self.write.ready):
                    m.d.comb += [receiver.reading.eq(1), receiver.address.eq(place)]
                    m.d.sync += [place.eq(place + 1), address.eq(address + 1), *count_down]
                    with m.If(is_last):
                        m.next = "settle"
            with m.State("settle"):
                # ``written`` is of the words taken before.
                m.next = "written"
            with m.State("written"):
                with m.If(self.written):
                    m.next = "acknowledge"

            with m.State("read"):
                answer(m, kind=Const(Command.READ | ACKNOWLEDGED, 8), length=left)
                with m.If(answers.i.ready):
                    m.next = "request"
            with m.State("request"):
                m.d.comb += self.request.valid.eq(1)
                with m.If(self.request.ready):
                    m.d.sync += address.eq(address + 1)
                    m.next = "data"
            with m.State("data"):
                m.d.sync += word.eq(self.data.payload)
                with m.If(self.data.valid):
                    m.next = "word"
            with m.State("word"):
                m.d.comb += [answers.i.valid.eq(1), answers.i.payload.word.eq(word),
                             answers.i.payload.last.eq(is_last)]
                with m.If(answers.i.ready):
                    m.d.sync += count_down
                    m.next = "request"
                    with m.If(is_last):
                        m.d.comb += finished.eq(1)
                        m.next = "idle"

            with m.State("get"):
                answer(m, kind=Const(Command.GET | ACKNOWLEDGED, 8), length=left)
                with m.If(answers.i.ready):
                    m.next = "fetch"
            with m.State("fetch"):
                # The register file takes two cycles.
                m.next = "choose"
            with m.State("choose"):
                m.next = "value"
            with m.State("value"):
                m.d.comb += [answers.i.valid.eq(1), answers.i.payload.word.eq(file.value),
                             answers.i.payload.last.eq(is_last)]
                with m.If(answers.i.ready):
                    m.d.sync += [*count_down, number.eq(number + 1)]
                    m.next = "fetch"
                    with m.If(is_last):
                        m.d.comb += finished.eq(1)
                        m.next = "idle"

            with m.State("open"):
                answer(m, kind=Const(Command.OPEN | ACKNOWLEDGED, 8), length=len(opening))
                m.d.sync += [place.eq(0), is_last.eq(0)]
                with m.If(answers.i.ready):
                    m.next = "opening"
            with m.State("opening"):
                m.d.comb += [answers.i.valid.eq(1), answers.i.payload.word.eq(Array(opening)[place]),
                             answers.i.payload.last.eq(is_last)]
                with m.If(answers.i.ready):
                    m.d.sync += [place.eq(place + 1), is_last.eq(place == len(opening) - 2)]
                    with m.If(is_last):
                        m.d.comb += finished.eq(1)
                        m.next = "idle"

            with m.State("acknowledge"):
                answer(m, kind=frame.type | ACKNOWLEDGED, length=0)
                with m.If(answers.i.ready):
                    m.d.comb += finished.eq(1)
                    m.next = "idle"
            with m.State("refuse"):
                answer(m, kind=Const(REFUSED, 8), length=1)
                with m.If(answers.i.ready):
                    m.next = "reason"
            with m.State("reason"):
                m.d.comb += [answers.i.valid.eq(1), answers.i.payload.word.eq(reason), answers.i.payload.last.eq(1)]
                with m.If(answers.i.ready):
                    m.d.comb += finished.eq(1)
                    m.next = "idle"
        return m

    def _check(self, m, frame, first, second, refusal):
        """Why a new frame cannot be done, 0 if it can, four cycles after its words."""
        num_words = frame.num_words
        writes = Signal(reset_less=True)
        span, end = Signal(32, reset_less=True), Signal(33, reset_less=True)
        outside, beyond, no_register, guarded = (Signal(name=name, reset_less=True)
                                                 for name in ("outside", "beyond", "no_register", "guarded"))
        has_none, has_one, has_two, has_data, is_count = (
            Signal(name=name, reset_less=True) for name in ("has_none", "has_one", "has_two", "has_data", "is_count"))
        m.d.sync += [
            writes.eq(frame.type == Command.WRITE),
            span.eq(Mux(writes, num_words - 1, second)),
            end.eq(first + span),
            outside.eq(end > self._num_words), beyond.eq(end > self._num_readable),
            no_register.eq(first >= self.registers.shape().length), guarded.eq(first < self._num_guarded),
            has_none.eq(num_words == 0), has_one.eq(num_words == 1), has_two.eq(num_words == 2),
            has_data.eq(num_words >= 2), is_count.eq((second != 0) & (second <= MAX_WORDS)),
            refusal.eq(0),
        ]

        def refuse(condition, reason):
            with m.If(condition):
                m.d.sync += refusal.eq(reason)

        kind = Signal.like(frame.type, reset_less=True)
        # What is said last counts.
        m.d.sync += kind.eq(frame.type)
        with m.Switch(kind):
            with m.Case(Command.OPEN):
                refuse(~has_one, Reason.LENGTH)
            with m.Case(Command.WRITE):
                refuse(outside, Reason.ADDRESS)
                refuse(~has_data, Reason.LENGTH)
            with m.Case(Command.READ):
                refuse(outside, Reason.ADDRESS)
                refuse(~has_two | ~is_count, Reason.LENGTH)
            with m.Case(Command.SET):
                refuse(guarded & ~self.ready, Reason.BUSY)
                refuse(no_register, Reason.REGISTER)
                refuse(~has_two, Reason.LENGTH)
            with m.Case(Command.GET):
                refuse(beyond, Reason.REGISTER)
                refuse(~has_two | ~is_count, Reason.LENGTH)
            with m.Case(Command.START):
                refuse(~self.ready, Reason.BUSY)
                refuse(~has_none, Reason.LENGTH)
            with m.Default():
                m.d.sync += refusal.eq(Reason.TYPE)
