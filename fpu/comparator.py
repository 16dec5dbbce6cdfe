"""Comparison."""

from amaranth.hdl import Cat, Mux
from amaranth.lib.wiring import In, Out

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
        return {"subtract": carry_delay(fmt.width), "reduce": lut_delay(2), "decide": lut_delay(2)}

    def _compute(self, m, step):
        a, b = self.a, self.b
        # One carry chain gives both orders: its sign is "less", its zero is "equal".
        s = step("subtract", difference=Cat(a.frac, a.exp) - Cat(b.frac, b.exp),
                 both_zero=is_zero(a) & is_zero(b), a_sign=a.sign, b_sign=b.sign)
        s = step("reduce", below=s.difference[-1], equal=s.difference[:-1] == 0,
                 both_zero=s.both_zero, a_sign=s.a_sign, b_sign=s.b_sign)
        eq = s.both_zero | s.equal & (s.a_sign == s.b_sign)
        lt = ~eq & Mux(s.a_sign == s.b_sign, s.below ^ s.a_sign, s.a_sign)
        s = step("decide", lt=lt, eq=eq, gt=~(lt | eq))
        m.d.comb += [self.lt.eq(s.lt), self.eq.eq(s.eq), self.gt.eq(s.gt)]
