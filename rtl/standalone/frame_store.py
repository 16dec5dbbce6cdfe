"""A small picture in block RAM, between the chip's clock and the screen's."""

from amaranth.hdl import Cat, Module, Signal
from amaranth.lib import data, memory, wiring
from amaranth.lib.wiring import In, Out

from ..video.timing_generator import place_layout

__all__ = ["FrameStore"]


class FrameStore(wiring.Component):
    """Keeps a picture, of each channel the highest bits, and shows each pixel as a square.

    What is written in the domain ``sync`` is seen when the screen comes there next. Latency from a place to its colour
    2 cycles of ``pixel``, throughput a pixel a cycle.

    Parameters
    ----------
    mode : :class:`~rtl.video.mode.VideoMode`
        Of the screen.
    scale_log2 : int
        A pixel is 2 ** this pixels of the screen a side.
    depth : int
        Bits of a channel, 1…8; what is left out is seen as the same bits again.

    Members
    -------
    write : ``{"valid", "x", "y", "color"}``, a pixel of the picture
    place : see :func:`~rtl.video.timing_generator.place_layout`
    color : red, green and blue, 8 bits each, red in the highest

    Raises
    ------
    ValueError
        If the screen is no multiple of a pixel.
    """

    #: In cycles
    latency = 2

    def __init__(self, mode, *, scale_log2, depth=4):
        if mode.width % (1 << scale_log2) or mode.height % (1 << scale_log2):
            raise ValueError(f"{mode.name}: is no multiple of pixels of {1 << scale_log2} a side")
        self._mode = mode
        self._scale_log2 = scale_log2
        self._depth = depth
        self._width, self._height = mode.width >> scale_log2, mode.height >> scale_log2
        super().__init__({
            "write": In(data.StructLayout({"valid": 1, "x": range(self._width), "y": range(self._height),
                                           "color": 24})),
            "place": In(place_layout(mode)),
            "color": Out(24),
        })

    def elaborate(self, platform):
        m = Module()
        m.submodules.rows = rows = memory.Memory(shape=3 * self._depth, depth=self._width * self._height, init=[],
                                                 attrs={"ram_style": "block"})
        write, read = rows.write_port(), rows.read_port(domain="pixel")
        channels = [self.write.color.word_select(channel, 8)[8 - self._depth:] for channel in range(3)]
        m.d.comb += [
            write.en.eq(self.write.valid), write.addr.eq(self._place(self.write.x, self.write.y)),
            write.data.eq(Cat(channels)),
            read.addr.eq(self._place(self.place.x >> self._scale_log2, self.place.y >> self._scale_log2)),
        ]
        kept = Signal(3 * self._depth, reset_less=True)
        m.d.pixel += kept.eq(read.data)
        for channel in range(3):
            again = kept.word_select(channel, self._depth).replicate(-(-8 // self._depth))
            m.d.comb += self.color.word_select(channel, 8).eq(again[-8:])
        return m

    def _place(self, x, y):
        # Not as a product, for which there would be a multiplier.
        return x + sum(y << bit for bit in range(self._width.bit_length()) if self._width >> bit & 1)
