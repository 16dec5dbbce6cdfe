"""Multiplication."""

from types import MappingProxyType, SimpleNamespace

from amaranth.hdl import Cat, Const

from .chain import ChainBit, carry_chain
from .operator import BinaryOperator, is_inf, is_zero
from .packing import round_and_pack, round_and_pack_delays
from .product import multiply_exactly, product_delays
from .rounding import Rounding, emulated, round_nearest, round_truncate

__all__ = ["Multiplier", "multiply", "multiply_truncate"]


@emulated
def multiply(params, a, b):
    """``a * b`` rounded to nearest even."""
    return round_nearest(params, a * b)


@emulated
def multiply_truncate(params, a, b):
    """``a * b`` rounded towards zero; float64 holds the product exactly."""
    return round_truncate(params, a * b)


class Multiplier(BinaryOperator):
    """r = a * b, rounded once.

    0 * ∞ is +0. The significands' product is one multiplier block for a significand of up to 18 bits,
    up to four for more.

    Parameters
    ----------
    fmt, latency, rounding
        See :class:`~fpu.operator.Operator`.

    Members
    -------
    a, b : In(fmt)
        Operands.
    r : Out(fmt)
        Product, ``latency`` cycles later.
    """

    emulation = MappingProxyType({Rounding.NEAREST_EVEN: multiply, Rounding.TRUNCATE: multiply_truncate})

    @classmethod
    def _step_delays(cls, fmt):
        return {**product_delays("multiply", fmt.sig_width, fmt.sig_width), **round_and_pack_delays(fmt)}

    def _compute(self, m, step):
        fmt, a, b = self.fmt, self.a, self.b
        zero = is_zero(a) | is_zero(b)
        inf = is_inf(a) | is_inf(b)
        # The bias is one less than a power of two: that one goes in as a carry, the power is the upper bits'.
        exp_sum = carry_chain(m, "exponent", (ChainBit.CARRY, Const(1, 1), 0, 0),
                              (ChainBit.ADD, Cat(a.exp, Const(0, 1)), Cat(b.exp, Const(0, 1)), 0))[1:]
        # Zeros take part with a hidden bit; `zero` overrides what comes of it, so the block waits for no logic.
        s = multiply_exactly(m, step, "multiply", (Cat(a.frac, Const(1, 1)), Cat(b.frac, Const(1, 1))), exp_sum=exp_sum,
                             zero=zero, inf=inf & ~zero, sign=(a.sign ^ b.sign) & ~(zero & inf))
        above = fmt.exp_width - 1
        exp = Cat(s.exp_sum[:above], s.exp_sum[above:] - 1)[:fmt.exp_width + 2].as_signed()
        s = SimpleNamespace(sig=s.products[0], sticky=Const(0, 1), exp=exp, zero=s.zero, inf=s.inf, sign=s.sign)
        m.d.comb += self.r.eq(round_and_pack(step, m, s, fmt=fmt, rounding=self.rounding))
