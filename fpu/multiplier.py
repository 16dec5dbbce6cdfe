"""Multiplication."""

from types import MappingProxyType, SimpleNamespace

from amaranth.hdl import Cat, Const, Signal, signed

from .operator import BinaryOperator, is_inf, is_zero, round_and_pack, round_and_pack_delays
from .pipeline import product_delay
from .product import Product
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

    0 * ∞ is +0. The significands' product is one multiplier block for a significand of up to 18 bits.

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
        return {"multiply": product_delay(fmt.sig_width), **round_and_pack_delays(fmt)}

    def _compute(self, m, step):
        fmt, a, b = self.fmt, self.a, self.b
        zero = is_zero(a) | is_zero(b)
        inf = is_inf(a) | is_inf(b)
        # Zeros take part with a hidden bit; `zero` overrides what comes of it, so the block waits for no logic.
        m.submodules.significand = significand = Product(fmt.sig_width, cycles=step.next_registers)
        m.d.comb += [significand.a.eq(Cat(a.frac, Const(1, 1))), significand.b.eq(Cat(b.frac, Const(1, 1)))]
        s = step("multiply", exp_sum=(Cat(Const(1, 1), a.exp) + Cat(Const(1, 1), b.exp))[1:],
                 zero=zero, inf=inf & ~zero, sign=(a.sign ^ b.sign) & ~(zero & inf))

        # The bias is one less than a power of two: that one went in as a carry, the power is the upper bits'.
        above = fmt.exp_width - 1
        exp = Signal(signed(fmt.exp_width + 2))
        m.d.comb += exp.eq(Cat(s.exp_sum[:above], s.exp_sum[above:] - 1))
        below = fmt.sig_width - 2
        s = SimpleNamespace(sig=significand.p[below:], sticky=significand.p[:below].any(),
                            exp=exp, exp_carried=exp + 1, zero=s.zero, inf=s.inf, sign=s.sign)
        m.d.comb += self.r.eq(round_and_pack(step, s, fmt=fmt, rounding=self.rounding))
