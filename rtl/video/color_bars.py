"""A picture by which a monitor and its cable are judged."""

from amaranth.hdl import Cat, Module, Mux, Signal
from amaranth.lib import wiring
from amaranth.lib.wiring import In, Out

from .timing_generator import place_layout

__all__ = ["ColorBars"]

_NUM_BARS = 8
#: Lines that have one ramp
_RAMP_BITS = 5


class ColorBars(wiring.Component):
    """Above, eight bars from white to black by brightness; below, ramps of grey, red, green and blue; around, a frame.

    Bar b, which begins at pixel ⌊b · width / 8⌋, lacks green if b ≥ 4, red if b mod 4 ≥ 2 and blue if b is odd. A ramp
    is x mod 256; the ramps take turns every 32 lines. The outermost pixels are white: none is cut off if they are seen.

    Latency 2 cycles, throughput a pixel a cycle.

    Parameters
    ----------
    mode : :class:`~.mode.VideoMode`
        Its width and height; the lower half begins at line ⌊height / 2⌋.

    Members
    -------
    place : see :func:`~.timing_generator.place_layout`
    color : red, green and blue, 8 bits each, red in the highest
    """

    #: In cycles
    latency = 2

    def __init__(self, mode):
        self._mode = mode
        super().__init__({"place": In(place_layout(mode)), "color": Out(24)})

    def elaborate(self, platform):
        m = Module()
        mode, place = self._mode, self.place
        begun = Signal(_NUM_BARS - 1, reset_less=True)
        ramp, which = Signal(8, reset_less=True), Signal(2, reset_less=True)
        edge, below = Signal(reset_less=True), Signal(reset_less=True)
        m.d.sync += [
            begun.eq(Cat(place.x >= bar * mode.width // _NUM_BARS for bar in range(1, _NUM_BARS))),
            ramp.eq(place.x[:8]), which.eq(place.y[_RAMP_BITS:_RAMP_BITS + 2]),
            below.eq(place.y >= mode.height // 2),
            edge.eq((place.x == 0) | (place.x == mode.width - 1) | (place.y == 0) | (place.y == mode.height - 1)),
        ]
        # Of bars, how many have begun
        bar, color = Signal(range(_NUM_BARS)), Signal(24, reset_less=True)
        red, green, blue = (Signal(8, name=name) for name in ("red", "green", "blue"))
        m.d.comb += bar.eq(sum(begun[number] for number in range(_NUM_BARS - 1)))
        for number, (channel, lacks) in enumerate(((red, bar[1]), (green, bar[2]), (blue, bar[0])), start=1):
            ramps = (which == 0) | (which == number)
            m.d.comb += channel.eq(Mux(edge, 255, Mux(below, Mux(ramps, ramp, 0), Mux(lacks, 0, 255))))
        m.d.sync += color.eq(Cat(blue, green, red))
        m.d.comb += self.color.eq(color)
        return m
