"""Comparison."""

from amaranth.hdl import Mux, Signal
from amaranth.lib.wiring import In, Out

from .chain import ChainBit, carry_chain
from .operator import FloatOperator, is_zero
from .pipeline import carry_delay, lut_delay

__all__ = ["Comparator"]


class Comparator(FloatOperator):
    """lt = (a < b), eq = (a = b), gt = (a > b), of which exactly one holds; -0 = +0.

    Parameters
    ----------
    fmt : FloatFormat
        Format of the operands.
    latency : int or None
        See :class:`~fpu.operator.Operator`.

    Members
    -------
    a, b : In(fmt)
        Operands.
    lt, eq, gt : Out(1)
        Their order, ``latency`` cycles later.
    """

    def __init__(self, fmt, *, latency=None):
        members = {"a": In(fmt), "b": In(fmt), "lt": Out(1), "eq": Out(1), "gt": Out(1)}
        super().__init__(fmt, members, latency=latency)

    @classmethod
    def _step_delays(cls, fmt):
        return {"compare": lut_delay(2) + carry_delay(fmt.width), "reduce": lut_delay(2), "decide": lut_delay(2)}

    def _compute(self, m, step):
        s = self.compare(m, step, self.a, self.b)
        m.d.comb += [self.lt.eq(s.lt), self.eq.eq(s.eq), self.gt.eq(s.gt)]

    @staticmethod
    def compare(m, step, a, b, **carried):
        """What is ``carried`` through the steps, and with it ``lt``, ``eq`` and ``gt``."""
        # One carry chain gives both orders: ones all along it are "equal", and what would leave it is "less". Of zeros
        # the fraction does not count.
        a_zero = Signal()
        m.d.comb += a_zero.eq(is_zero(a))
        order = carry_chain(m, "order", (ChainBit.COMPARE, a.frac, b.frac, a_zero), (ChainBit.COMPARE, a.exp, b.exp, 0))
        s = step("compare", ones=order, a_top=a.exp[-1], b_top=b.exp[-1], a_zero=a_zero, a_sign=a.sign, b_sign=b.sign,
                 **carried)
        # The last place passed the carry on that it shows inverted, or decided.
        below = Mux(s.a_top == s.b_top, ~s.ones[-1], s.b_top)
        s = step("reduce", below=below, equal=s.ones.all(), same=s.a_zero | (s.a_sign == s.b_sign),
                 a_sign=s.a_sign, b_sign=s.b_sign, **{name: getattr(s, name) for name in carried})
        eq = Signal()
        lt = Signal()
        m.d.comb += [eq.eq(s.equal & s.same),
                     lt.eq(~eq & Mux(s.a_sign == s.b_sign, s.below ^ s.a_sign, s.a_sign))]
        return step("decide", lt=lt, eq=eq, gt=~(lt | eq), **{name: getattr(s, name) for name in carried})
