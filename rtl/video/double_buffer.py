"""Which of two frames is shown."""

from amaranth.hdl import Module, Mux, Signal
from amaranth.lib import wiring
from amaranth.lib.wiring import In, Out

__all__ = ["DoubleBuffer"]


class DoubleBuffer(wiring.Component):
    """Swaps the frame that is shown and the one that is drawn, between two frames of the display only.

    Parameters
    ----------
    base_width : int
        Bits of where a frame begins.

    Members
    -------
    bases : where the two frames begin; each changes only while it is not ``shown``
    swap : the other frame is drawn, and is to be shown
    blank : a frame of the display has ended
    pending : a swap is awaited: nothing may be drawn
    shown : number of the frame that is shown; changes with the end of ``pending``
    show, draw : where they begin, that which is shown and the other
    begin : a cycle after ``blank``: ``show`` is what it will be until the next one
    """

    def __init__(self, *, base_width):
        super().__init__({
            "bases": In(base_width).array(2),
            "swap": In(1),
            "blank": In(1),
            "pending": Out(1),
            "shown": Out(1),
            "show": Out(base_width),
            "draw": Out(base_width),
            "begin": Out(1),
        })

    def elaborate(self, platform):
        m = Module()
        pending, shown, begin = Signal(), Signal(), Signal()
        m.d.sync += begin.eq(self.blank)
        with m.If(self.blank):
            # A swap that comes with the blank is in time.
            m.d.sync += [shown.eq(shown ^ (pending | self.swap)), pending.eq(0)]
        with m.Elif(self.swap):
            m.d.sync += pending.eq(1)
        m.d.comb += [
            self.pending.eq(pending), self.shown.eq(shown), self.begin.eq(begin),
            self.show.eq(Mux(shown, self.bases[1], self.bases[0])),
            self.draw.eq(Mux(shown, self.bases[0], self.bases[1])),
        ]
        return m
