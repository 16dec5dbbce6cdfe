"""One SDRAM for all that a chip reads and writes."""

from amaranth.hdl import Cat, Module, Signal
from amaranth.lib import stream, wiring
from amaranth.lib.wiring import In, Out

from ..queue import Queue, merged
from .arbiter import Arbiter
from .commands import MAX_WORDS, PLACE_WIDTH, pins_signature
from .controller import Controller
from .display_port import DisplayPort, frame_layout
from .line_port import LinePort
from .return_buffer import ReturnBuffer, tag_layout
from .write_port import SLOT_WIDTH, WritePort, write_layout

__all__ = ["SdramMemory"]

#: Bursts of a display that may be under way: it is not to wait for more of them than the others have lines.
_DISPLAY_SLOTS = 8


class SdramMemory(wiring.Component):
    """Ports for lines, for words to write and for a display, on one SDRAM; what is not asked for is not built.

    Each reader gets its lines in the order in which it asked, though the memory fetches them in another. Accesses of
    different ports may overtake each other: what is to be read as it was just written waits for ``written``.

    At 125 MHz, latency from a request to the first word is 26 to 31 cycles for a line of one word if all else is idle,
    the longer if another row of its bank is open, and 2 more for each further word, as lines leave whole. Together all
    have a word in two cycles at most.

    Parameters
    ----------
    timing : :class:`~.timing.SdramTiming`
        The chip and the clock.
    readers : dict from str to (int, int)
        Of each, words of a line and bits of a line's number, as :func:`~rtl.memory_ports.memory_ports` has them.
    num_writers : int
        Streams of words to write.
    display : bool
        Whether there is a port for a display.
    num_slots : int
        Lines that each reader may have asked for, a power of two.
    input_delay : int
        See :class:`~.controller.Controller`.

    Members
    -------
    NAME_request, NAME_data, NAME_base : of each reader, see :class:`~.line_port.LinePort`
    write : array of streams of words to write, see :func:`~.write_port.write_layout`
    display_frame, display_word : if there is a display, see :class:`~.display_port.DisplayPort`
    ready : the chip has been initialised; what is asked for before waits
    written : every word taken is where later accesses find it
    pins : to the chip
    """

    #: Not all its outputs come from registers.
    latency = 0

    def __init__(self, *, timing, readers, num_writers=0, display=False, num_slots=4, input_delay=0):
        self._timing = timing
        self._readers = readers
        self._num_writers = num_writers
        self._display = display
        self._num_slots = num_slots
        self._input_delay = input_delay
        chip = timing.chip
        members = {}
        for name, (_, line_width) in readers.items():
            members |= {f"{name}_request": In(stream.Signature(line_width)),
                        f"{name}_data": Out(stream.Signature(32, always_ready=True)),
                        f"{name}_base": In(chip.word_width - PLACE_WIDTH)}
        if num_writers:
            members |= {"write": In(stream.Signature(write_layout(chip))).array(num_writers), "written": Out(1)}
        if display:
            members |= {"display_frame": In(stream.Signature(frame_layout(chip))),
                        "display_word": Out(stream.Signature(32))}
        super().__init__({**members, "ready": Out(1), "pins": Out(pins_signature(chip))})

    def elaborate(self, platform):
        m = Module()
        chip = self._timing.chip
        lines = [words for words, _ in self._readers.values()] + [MAX_WORDS] * self._display
        slots = [self._num_slots] * len(self._readers) + [_DISPLAY_SLOTS] * self._display
        tag = tag_layout(num_ports=len(lines), num_slots=max(slots))
        tag_width = max(tag.size, SLOT_WIDTH)
        num_sources = len(lines) + bool(self._num_writers)
        m.submodules.controller = controller = Controller(timing=self._timing, tag_width=tag_width,
                                                          input_delay=self._input_delay)
        m.submodules.arbiter = arbiter = Arbiter(chip=chip, tag_width=tag_width, num_sources=num_sources)
        m.submodules.returns = returns = ReturnBuffer(words=lines, slots=slots)
        wiring.connect(m, arbiter.access, controller.access)
        wiring.connect(m, wiring.flipped(self.pins), controller.pins)
        m.d.comb += [arbiter.room.eq(controller.room), returns.answer.eq(controller.answer),
                     self.ready.eq(controller.ready)]

        for number, (name, (words, line_width)) in enumerate(self._readers.items()):
            m.submodules[f"{name}_port"] = port = LinePort(chip=chip, words=words, line_width=line_width)
            m.d.comb += port.base.eq(getattr(self, f"{name}_base"))
            wiring.connect(m, wiring.flipped(getattr(self, f"{name}_request")), port.request)
            wiring.connect(m, returns.data[number], wiring.flipped(getattr(self, f"{name}_data")))
            self._ask(m, port.piece, number, arbiter.source[number], returns, tag)
        if self._display:
            number = len(self._readers)
            m.submodules.display = display = DisplayPort(chip=chip)
            wiring.connect(m, wiring.flipped(self.display_frame), display.frame)
            wiring.connect(m, display.word, wiring.flipped(self.display_word))
            wiring.connect(m, returns.data[number], display.data)
            self._ask(m, display.piece, number, arbiter.source[number], returns, tag)
            m.d.comb += arbiter.urgent[number].eq(display.urgent)
        if self._num_writers:
            m.submodules.writes = writes = WritePort(chip=chip)
            # So that writers do not wait for each other within a cycle.
            queues = [Queue(write_layout(chip), depth=2) for _ in self.write]
            for number, (port, queue) in enumerate(zip(self.write, queues, strict=True)):
                m.submodules[f"write_queue{number}"] = queue
                wiring.connect(m, wiring.flipped(port), queue.i)
            wiring.connect(m, merged(m, "writers", [queue.o for queue in queues]), writes.i)
            source = arbiter.source[-1]
            m.d.comb += [
                source.valid.eq(writes.request.valid),
                writes.request.ready.eq(source.ready),
                arbiter.urgent[-1].eq(writes.urgent),
                source.payload.write.eq(1),
                source.payload.address.eq(writes.request.payload.address),
                source.payload.tag.eq(writes.request.payload.slot),
                writes.fetch.valid.eq(controller.fetch.valid),
                writes.fetch.tag.eq(controller.fetch.tag),
                controller.store.eq(writes.store),
                self.written.eq(writes.idle & ~Cat(queue.o.valid for queue in queues).any()),
            ]
        return m

    def _ask(self, m, piece, number, source, returns, tag):
        """Pieces of lines become accesses, if there is a slot for their words."""
        asked, has_slot = returns.asked[number], Signal(name=f"has_slot_{number}")
        whose = Signal(tag, name=f"tag_{number}")
        m.d.comb += [
            has_slot.eq(returns.has_slot[number] | piece.payload.second),
            source.valid.eq(piece.valid & has_slot),
            piece.ready.eq(source.ready & has_slot),
            *(getattr(source.payload, name).eq(getattr(piece.payload, name)) for name in ("address", "left", "place")),
            whose.port.eq(number), whose.slot.eq(returns.slot[number]), whose.second.eq(piece.payload.second),
            source.payload.tag.eq(whose),
            asked.valid.eq(source.valid & source.ready),
            asked.second.eq(piece.payload.second),
            asked.split.eq(piece.payload.split),
        ]
