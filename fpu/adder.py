"""Addition and subtraction."""

from types import MappingProxyType, SimpleNamespace

import numpy as np
from amaranth.hdl import Cat, Const, Mux, Signal

from .operator import (
    BinaryOperator,
    is_inf,
    is_zero,
    normalise,
    normalise_delays,
    round_and_pack,
    round_and_pack_delays,
)
from .pipeline import carry_delay, lut_delay
from .rounding import Rounding, emulated, round_nearest, round_truncate

__all__ = ["Adder", "Subtractor", "add", "add_truncate", "subtract", "subtract_truncate"]


@emulated
def add(params, a, b):
    """``a + b`` rounded to nearest even."""
    return round_nearest(params, a + b)


@emulated
def add_truncate(params, a, b):
    """``a + b`` rounded towards zero."""
    total = a + b
    # Knuth's two-sum: what float64 lost. Where it lost by rounding away from zero, step back.
    b_part = total - a
    lost = (a - (total - b_part)) + (b - b_part)
    if lost * total < 0.0:
        total = np.int64(np.float64(total).view(np.int64) - 1).view(np.float64)
    return round_truncate(params, total)


@emulated
def subtract(params, a, b):
    """``a - b`` rounded to nearest even."""
    return add(params, a, -b)


@emulated
def subtract_truncate(params, a, b):
    """``a - b`` rounded towards zero."""
    return add_truncate(params, a, -b)


def _align_levels(fmt):
    # Beyond sig_width + 1 places only sticky is left.
    return range(min((fmt.sig_width + 1).bit_length(), fmt.exp_width))[::-1]


class Adder(BinaryOperator):
    """r = a + b, rounded once.

    One path: order by magnitude, align the smaller, add or subtract, normalise, round.

    ∞ - ∞ is +0. An exact zero is +0 unless both operands are -0.

    Parameters
    ----------
    fmt, latency, rounding
        See :class:`~fpu.operator.Operator`.

    Members
    -------
    a, b : In(fmt)
        Operands.
    r : Out(fmt)
        Sum, ``latency`` cycles later.
    """

    emulation = MappingProxyType({Rounding.NEAREST_EVEN: add, Rounding.TRUNCATE: add_truncate})
    _subtracts = False

    @classmethod
    def _step_delays(cls, fmt):
        return {
            "compare": carry_delay(fmt.frac_width),
            "order": lut_delay(3),
            **{f"align_{level}": lut_delay(1) for level in _align_levels(fmt)},
            "add": carry_delay(fmt.sig_width + 4),
            **normalise_delays(fmt.sig_width + 4),
            **round_and_pack_delays(fmt),
        }

    def _compute(self, m, step):
        fmt, a, b = self.fmt, self.a, self.b
        b_sign = ~b.sign if self._subtracts else b.sign
        # Both distances and the fractions' order at once: less to wait for than one comparison, then one distance.
        s = step("compare", a_distance=a.exp - b.exp, b_distance=b.exp - a.exp, below=a.frac < b.frac,
                 a_exp=a.exp, b_exp=b.exp, a_frac=a.frac, b_frac=b.frac, a_sign=a.sign, b_sign=b_sign,
                 any_zero=is_zero(a) | is_zero(b), both_zero=is_zero(a) & is_zero(b),
                 inf=is_inf(a) | is_inf(b), both_inf=is_inf(a) & is_inf(b))

        exp_below = s.a_distance[-1]
        swap, subtract, invalid = Signal(), Signal(), Signal()
        m.d.comb += [swap.eq(exp_below | ~s.b_distance[-1] & s.below),
                     subtract.eq(s.a_sign ^ s.b_sign), invalid.eq(s.both_inf & subtract)]
        s = step("order",
                 distance=Mux(exp_below, s.b_distance, s.a_distance)[:fmt.exp_width],
                 big_exp=Mux(exp_below, s.b_exp, s.a_exp), big_frac=Mux(swap, s.b_frac, s.a_frac),
                 small=Mux(s.any_zero, 0, Cat(Const(0, 2), Mux(swap, s.a_frac, s.b_frac), Const(1, 1))),
                 sticky=Const(0), subtract=subtract, zero=invalid, inf=s.inf & ~invalid,
                 sign=Mux(swap, s.b_sign, s.a_sign) & ~(invalid | s.both_zero & subtract))

        for level in _align_levels(fmt):
            places = 1 << level
            far = s.distance[level]
            small, sticky = Mux(far, s.small >> places, s.small), s.sticky | far & s.small[:places].any()
            if level == _align_levels(fmt)[0]:
                beyond = (s.distance >> level + 1).any()
                small, sticky = Mux(beyond, 0, small), Mux(beyond, s.small.any(), sticky)
            if level == 0:
                # In the tables of the last shift the complement costs nothing.
                small = Cat(sticky, small, Const(0, 1)) ^ s.subtract.replicate(fmt.sig_width + 4)
            s = step(f"align_{level}", s, small=small, sticky=sticky)

        # One more place for the carry in of a subtraction.
        big = Cat(s.subtract, Const(0, 3), s.big_frac, Const(1, 2))
        s = step("add", magnitude=(big + Cat(s.subtract, s.small))[1:fmt.sig_width + 5], exp_above=s.big_exp + 2,
                 subtract=s.subtract, zero=s.zero, inf=s.inf, sign=s.sign)
        s = normalise(step, s)
        cancelled = ~s.magnitude[-1] & ~s.inf
        # exp_above - shift - 1, without a carry
        exp = s.exp_above + (~Cat(s.shift, Const(0, 1))).as_signed()
        s = SimpleNamespace(sig=Cat(s.magnitude[3:], Const(0, 1)), sticky=s.magnitude[:3].any(),
                            exp=exp, exp_carried=s.exp_above - s.shift,
                            zero=s.zero | cancelled, inf=s.inf, sign=s.sign & ~(cancelled & s.subtract))
        m.d.comb += self.r.eq(round_and_pack(step, s, fmt=fmt, rounding=self.rounding))


class Subtractor(Adder):
    """r = a - b, rounded once: an :class:`Adder` that inverts the sign of ``b``.

    Parameters
    ----------
    fmt, latency, rounding
        See :class:`~fpu.operator.Operator`.

    Members
    -------
    a, b : In(fmt)
        Operands.
    r : Out(fmt)
        Difference, ``latency`` cycles later.
    """

    emulation = MappingProxyType({Rounding.NEAREST_EVEN: subtract, Rounding.TRUNCATE: subtract_truncate})
    _subtracts = True
