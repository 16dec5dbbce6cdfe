"""Performance counters: how often each of a set of events has happened."""

from amaranth.hdl import Module
from amaranth.lib import wiring
from amaranth.lib.wiring import In, Out

__all__ = ["Counters"]


class Counters(wiring.Component):
    """Counts how often each event happens.

    Parameters
    ----------
    names : iterable of str
        The events.
    width : int
        Bits of a count, which wraps.
    num_sources : int
        How often an event may happen in one cycle.

    Members
    -------
    clear : all counts become zero
    event_NAME, NAME : how often an event happens in this cycle, how often it has
    """

    def __init__(self, names, *, width=32, num_sources=1):
        self.names = tuple(names)
        super().__init__({
            "clear": In(1),
            **{f"event_{name}": In(range(num_sources + 1)) for name in self.names},
            **{name: Out(width) for name in self.names},
        })

    def elaborate(self, platform):
        m = Module()
        for name in self.names:
            count = getattr(self, name)
            with m.If(self.clear):
                m.d.sync += count.eq(0)
            with m.Else():
                m.d.sync += count.eq(count + getattr(self, f"event_{name}"))
        return m
