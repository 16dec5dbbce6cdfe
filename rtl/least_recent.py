"""Who goes first: whoever has waited longest since it was last served; and what it brings."""

from amaranth.hdl import Cat, Const, Module, Signal
from amaranth.lib import wiring
from amaranth.lib.wiring import In, Out

__all__ = ["LeastRecent", "selected"]


def selected(choices):
    """Of pairs of a condition and a value the one whose condition holds; zero if none does."""
    result = Const(0)
    for condition, value in choices:
        result = result | (value & condition.replicate(len(value)))
    return result


class LeastRecent(wiring.Component):
    """Grants one of several bids, to the bidder that was served least recently.

    Whoever was served goes behind all others, so that a bidder is passed over at most once by each other one, however
    bids come and go.

    Parameters
    ----------
    num_bidders : int
        How many there are.

    Members
    -------
    bid : a bit for each bidder
    grant : the one granted; combinational from ``bid``
    served : a bit for the bidder, one at most, that goes behind all others from the next cycle on
    """

    def __init__(self, *, num_bidders):
        self._num_bidders = num_bidders
        super().__init__({"bid": In(num_bidders), "grant": Out(num_bidders), "served": In(num_bidders)})

    def elaborate(self, platform):
        m = Module()
        # before[a][b], a < b: a goes before b.
        before = {}
        for a in range(self._num_bidders):
            for b in range(a + 1, self._num_bidders):
                before[a, b] = first = Signal(init=1, name=f"before_{a}_{b}")
                with m.If(self.served[a] | self.served[b]):
                    m.d.sync += first.eq(self.served[b])
        for a in range(self._num_bidders):
            others = [self.bid[b] & (~before[a, b] if a < b else before[b, a])
                      for b in range(self._num_bidders) if b != a]
            m.d.comb += self.grant[a].eq(self.bid[a] & ~Cat(others).any())
        return m
