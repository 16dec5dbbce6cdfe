"""Ten bits a pixel as two bits a clock, for a pin with a double data rate."""

from itertools import pairwise

from amaranth.hdl import Cat, Module, Mux, Signal
from amaranth.lib import data, wiring
from amaranth.lib.cdc import FFSynchronizer
from amaranth.lib.wiring import In, Out

__all__ = ["Serializer"]

_PAIRS = 5


class Serializer(wiring.Component):
    """Shifts symbols out, two bits a clock of the domain ``shift``, which is five times as fast as ``pixel``.

    Both clocks come from one PLL, in any phase: a symbol is taken in the middle of the pixel clock that it stays for,
    found once after reset. Latency about two pixel clocks; throughput a symbol a pixel clock. What follows is
    the board's: a register such as ECP5's ODDRX1F, whose D0 is bit 0.

    Parameters
    ----------
    num_channels : int
        Symbols at a time.

    Members
    -------
    symbols : array of ten bits, of the domain ``pixel``
    pairs : array of two bits, of the domain ``shift``, of which bit 0 goes first
    """

    #: Clocks of ``shift`` between the register that a symbol is taken into and the pins
    way = 2

    def __init__(self, *, num_channels):
        self._num_channels = num_channels
        super().__init__({"symbols": In(data.ArrayLayout(10, num_channels)),
                          "pairs": Out(data.ArrayLayout(2, num_channels))})

    def elaborate(self, platform):
        m = Module()
        held = Signal(10 * self._num_channels, reset_less=True)
        beat, seen, before = Signal(), Signal(), Signal()
        found, aligned = Signal(), Signal()
        m.submodules.beat = FFSynchronizer(beat, seen, o_domain="shift")
        m.d.pixel += [held.eq(self.symbols), beat.eq(~beat)]
        # ``held`` has stayed for 2 to 3 of its 5 clocks when its beat is seen; from then on a ring of bits counts.
        ring, takes = Signal(_PAIRS), Signal(reset_less=True)
        m.d.shift += [before.eq(seen), found.eq((seen != before) & ~aligned), aligned.eq(aligned | found),
                      ring.eq(Cat(ring[-1] | found, ring[:-1])),
                      # Five clocks after the beat was seen: two are in ``found`` and here.
                      takes.eq(ring[2])]
        # A clock is 3 ns, hardly more than a wire to the pins, which lie apart: two clocks are for the way.
        leaving = [Signal.like(self.pairs, name=f"leaving{stage}", reset_less=True) for stage in range(self.way)]
        for channel in range(self._num_channels):
            rest = Signal(10, name=f"rest{channel}", reset_less=True)
            # What comes in behind is never sent; zeros would become resets, for which a clock has no time.
            m.d.shift += [rest.eq(Mux(takes, held.word_select(channel, 10), rest.rotate_right(2))),
                          leaving[0][channel].eq(rest[:2])]
        for before_it, stage in pairwise(leaving):
            m.d.shift += stage.eq(before_it)
        m.d.comb += self.pairs.eq(leaving[-1])
        return m
