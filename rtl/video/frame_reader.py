"""A picture's rows out of a memory with one picture a frame of the display."""

from amaranth.hdl import Module, Mux, Signal
from amaranth.lib import stream, wiring
from amaranth.lib.wiring import In, Out

from ..sdram.commands import MAX_WORDS, PLACE_WIDTH
from ..sdram.display_port import frame_layout
from .line_buffer import pixel_layout

__all__ = ["FrameReader"]


class FrameReader(wiring.Component):
    """Asks a :class:`~rtl.sdram.display_port.DisplayPort` for the rows of a picture, and makes pixels of their words.

    Throughput is a pixel a cycle. A picture that is to begin while one before is not yet asked for begins thereafter.

    Parameters
    ----------
    chip : :class:`~rtl.sdram.timing.SdramChip`
        For the width of addresses.
    width, height : int
        Of the picture, in pixels of a word each.
    stride : int
        Words from row to row.

    Members
    -------
    begin, base : a picture is to be shown that begins there, in units of 16 words
    frame, word : to and from the memory
    pixel : stream of pixels

    Raises
    ------
    ValueError
        If rows are not bursts of 16 words.
    """

    def __init__(self, *, chip, width, height, stride):
        if width % MAX_WORDS or stride % MAX_WORDS:
            raise ValueError(f"rows of {width} words, {stride} apart: both must be multiples of {MAX_WORDS}")
        self._width = width
        self._height = height
        self._stride = stride
        self._frame = frame_layout(chip)
        super().__init__({
            "begin": In(1),
            "base": In(chip.word_width - PLACE_WIDTH),
            "frame": Out(stream.Signature(self._frame)),
            "word": In(stream.Signature(32)),
            "pixel": Out(stream.Signature(pixel_layout())),
        })

    def elaborate(self, platform):
        m = Module()
        waits, busy = Signal(), Signal()
        base, row = Signal.like(self.base, reset_less=True), Signal(range(self._height), reset_less=True)
        with m.If(self.frame.valid & self.frame.ready):
            m.d.sync += [base.eq(base + self._stride // MAX_WORDS), row.eq(row - 1), busy.eq(row != 0)]
        with m.If(self.begin):
            m.d.sync += waits.eq(1)
        with m.Elif(waits & ~busy):
            m.d.sync += [waits.eq(0), busy.eq(1), base.eq(self.base), row.eq(self._height - 1)]
        m.d.comb += [
            self.frame.valid.eq(busy),
            self.frame.payload.base.eq(base),
            self.frame.payload.lines.eq(self._width // MAX_WORDS - 1),
        ]
        size = self._width * self._height
        place = Signal(range(size))
        m.d.comb += [
            self.pixel.valid.eq(self.word.valid), self.word.ready.eq(self.pixel.ready),
            self.pixel.payload.color.eq(self.word.payload), self.pixel.payload.first.eq(place == 0),
        ]
        with m.If(self.pixel.valid & self.pixel.ready):
            m.d.sync += place.eq(Mux(place == size - 1, 0, place + 1))
        return m
