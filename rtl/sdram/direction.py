"""Whether an SDRAM's data lines are for reading or for writing."""

from amaranth.hdl import Module, Signal
from amaranth.lib import wiring
from amaranth.lib.wiring import In, Out

__all__ = ["Direction"]


class Direction(wiring.Component):
    """Turns the data lines round when nobody wants them as they are, or the others have waited long.

    Turning costs cycles in which no data move, so reads are done together and writes are.

    Parameters
    ----------
    timing : :class:`~.timing.SdramTiming`
        Distances of commands.
    patience : int
        Slots in which those who want the other direction wait for the ones who want this.

    Members
    -------
    second : this is the second cycle of a slot
    has_read, has_write : in the second cycle: somebody wants to read, to write
    writing : the direction
    allowed : no data of the other direction are in the way
    """

    def __init__(self, *, timing, patience=12):
        self._timing = timing
        self._patience = patience
        super().__init__({"second": In(1), "has_read": In(1), "has_write": In(1), "writing": Out(1), "allowed": Out(1)})

    def elaborate(self, platform):
        m = Module()
        patience = Signal(range(self._patience + 1), init=self._patience)
        gap = Signal(range(self._timing.read_to_write))
        this_way, other_way, turns = Signal(), Signal(), Signal()
        with m.If(self.writing):
            m.d.comb += [this_way.eq(self.has_write), other_way.eq(self.has_read)]
        with m.Else():
            m.d.comb += [this_way.eq(self.has_read), other_way.eq(self.has_write)]
        m.d.comb += [turns.eq(self.second & other_way & (~this_way | (patience == 0))), self.allowed.eq(gap == 0)]
        with m.If(self.second & (gap != 0)):
            m.d.sync += gap.eq(gap - 1)
        with m.If(turns):
            m.d.sync += [self.writing.eq(~self.writing), patience.eq(self._patience)]
            with m.If(~self.writing):
                m.d.sync += gap.eq(self._timing.read_to_write - 1)
        with m.Elif(self.second & other_way & (patience != 0)):
            m.d.sync += patience.eq(patience - 1)
        return m
