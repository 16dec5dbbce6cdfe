"""The frame buffer's words, ahead of the display."""

from amaranth.hdl import Module, Signal
from amaranth.lib import data, stream, wiring
from amaranth.lib.wiring import In, Out

from ..queue import Queue
from .commands import MAX_WORDS, PLACE_WIDTH
from .line_port import piece_layout

__all__ = ["DisplayPort", "frame_layout"]


def frame_layout(chip):
    """A frame: ``lines`` + 1 bursts of 16 words, from burst number ``base`` on."""
    width = chip.word_width - PLACE_WIDTH
    return data.StructLayout({"base": width, "lines": width})


class DisplayPort(wiring.Component):
    """Fetches frames in bursts, as long as there is room; it is urgent when less than half of its words are there.

    Parameters
    ----------
    chip : :class:`~.timing.SdramChip`
        For the width of addresses.
    depth : int
        Words fetched ahead.

    Members
    -------
    frame : stream of frames, each taken when all of the one before is asked for
    piece : stream of pieces
    urgent : they should come soon
    data : stream of words from the memory
    word : stream of the frames' words
    """

    def __init__(self, *, chip, depth=512):
        self._chip = chip
        self._depth = depth
        super().__init__({
            "frame": In(stream.Signature(frame_layout(chip))),
            "piece": Out(stream.Signature(piece_layout(chip))),
            "urgent": Out(1),
            "data": In(stream.Signature(32, always_ready=True)),
            "word": Out(stream.Signature(32)),
        })

    def elaborate(self, platform):
        m = Module()
        m.submodules.words = words = Queue(32, depth=self._depth, always_ready=True)
        wiring.connect(m, wiring.flipped(self.data), words.i)
        wiring.connect(m, words.o, wiring.flipped(self.word))
        frame, has_frame = Signal(frame_layout(self._chip), reset_less=True), Signal()
        promised, has_room = Signal(range(self._depth + 1)), Signal()
        asks, taken = Signal(), Signal()
        m.d.comb += [
            self.frame.ready.eq(~has_frame),
            self.piece.payload.address.eq(frame.base << PLACE_WIDTH),
            self.piece.payload.left.eq(MAX_WORDS - 1),
            # What has room once has it until it is used.
            self.piece.valid.eq(has_frame & has_room),
            asks.eq(self.piece.valid & self.piece.ready),
            taken.eq(self.word.valid & self.word.ready),
        ]
        m.d.sync += [
            promised.eq(promised + (asks << PLACE_WIDTH) - taken),
            has_room.eq((promised <= self._depth - MAX_WORDS) & ~asks),
            self.urgent.eq(words.level < self._depth // 2),
        ]
        with m.If(asks):
            m.d.sync += [frame.base.eq(frame.base + 1), frame.lines.eq(frame.lines - 1),
                         has_frame.eq(frame.lines != 0)]
        with m.Elif(self.frame.valid & self.frame.ready):
            m.d.sync += [frame.eq(self.frame.payload), has_frame.eq(1)]
        return m
