"""Comparison."""

from amaranth.hdl import Cat
from amaranth.lib.wiring import In, Out

from .operator import FloatOperator, is_inf, is_zero
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
        return {"compare": carry_delay(fmt.width - 1), "decide": lut_delay(1)}

    def _compute(self, m, step):
        a, b = self.a, self.b
        # All that is equal whatever its fraction
        same = is_zero(a) & is_zero(b) | is_inf(a) & is_inf(b)
        a_magnitude, b_magnitude = Cat(a.frac, a.exp), Cat(b.frac, b.exp)
        s = step("compare", below=a_magnitude < b_magnitude, same=same | (a_magnitude == b_magnitude),
                 both_zero=is_zero(a) & is_zero(b), a_sign=a.sign, b_sign=b.sign)
        eq = s.both_zero | s.same & (s.a_sign == s.b_sign)
        s = step("decide", eq=eq, lt=~eq & (s.a_sign & ~s.b_sign | (s.a_sign == s.b_sign) & (s.below ^ s.a_sign)))
        m.d.comb += [self.lt.eq(s.lt), self.eq.eq(s.eq), self.gt.eq(~(s.lt | s.eq))]
