"""Performance counters: how often each of a set of events has happened."""

from amaranth.hdl import Module
from amaranth.lib import wiring
from amaranth.lib.wiring import In, Out

__all__ = ["Counters"]


class Counters(wiring.Component):
    """Counts the cycles in which each event is set.

    Parameters
    ----------
    names : iterable of str
        The events.
    width : int
        Bits of a count, which wraps.

    Members
    -------
    clear : all counts become zero
    event_NAME, NAME : an event, how often it was
    """

    def __init__(self, names, *, width=32):
        self.names = tuple(names)
        super().__init__({
            "clear": In(1),
            **{f"event_{name}": In(1) for name in self.names},
            **{name: Out(width) for name in self.names},
        })

    def elaborate(self, platform):
        m = Module()
        for name in self.names:
            count = getattr(self, name)
            with m.If(self.clear):
                m.d.sync += count.eq(0)
            with m.Elif(getattr(self, f"event_{name}")):
                m.d.sync += count.eq(count + 1)
        return m
