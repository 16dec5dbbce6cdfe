"""Where on the screen the next pixel is."""

from amaranth.hdl import Module, Mux, Signal
from amaranth.lib import data, wiring
from amaranth.lib.wiring import Out

__all__ = ["TimingGenerator", "place_layout"]


def place_layout(mode):
    """Of a pixel clock: the pixel if it is ``active``, the levels of both syncs, and ``blank``, between two frames."""
    return data.StructLayout({"x": range(mode.h_total), "y": range(mode.v_total), "active": 1, "h_sync": 1, "v_sync": 1,
                              "blank": 1})


class TimingGenerator(wiring.Component):
    """Scans a screen, a pixel a clock: what is visible, front porch, sync pulse, back porch; likewise lines.

    Vertical sync changes with the first pixel of a horizontal sync pulse, as VESA's timings have it. After reset it
    begins behind the last visible line, so that the first frame is whole.

    Parameters
    ----------
    mode : :class:`~.mode.VideoMode`
        What to scan.

    Members
    -------
    place : see :func:`place_layout`; all of it comes from registers
    """

    def __init__(self, mode):
        self._mode = mode
        super().__init__({"place": Out(place_layout(mode))})

    def elaborate(self, platform):
        m = Module()
        mode = self._mode
        x, y = Signal(range(mode.h_total)), Signal(range(mode.v_total), init=mode.height)
        last = Signal()
        h_begin = mode.width + mode.h_front
        # A line of a porch is from one horizontal sync to the next, and the first begins on the last visible line.
        v_begin = mode.height + mode.v_front - 1
        h_pulse, v_pulse = Signal(), Signal()
        m.d.comb += last.eq(x == mode.h_total - 1)
        m.d.sync += x.eq(Mux(last, 0, x + 1))
        with m.If(last):
            m.d.sync += y.eq(Mux(y == mode.v_total - 1, 0, y + 1))
        with m.If(x == h_begin):
            m.d.sync += [h_pulse.eq(1), v_pulse.eq((y >= v_begin) & (y < v_begin + mode.v_sync))]
        with m.Elif(x == h_begin + mode.h_sync):
            m.d.sync += h_pulse.eq(0)
        # A register later than x and y, as the pulses are.
        place = Signal(place_layout(mode), reset_less=True)
        m.d.sync += [place.x.eq(x), place.y.eq(y), place.active.eq((x < mode.width) & (y < mode.height)),
                     place.blank.eq(y >= mode.height)]
        m.d.comb += [self.place.eq(place), self.place.h_sync.eq(h_pulse ^ (not mode.h_positive)),
                     self.place.v_sync.eq(v_pulse ^ (not mode.v_positive))]
        return m
