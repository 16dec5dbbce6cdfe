"""Addition and subtraction."""

from types import MappingProxyType, SimpleNamespace

import numpy as np
from amaranth.hdl import Cat, Const, Mux, Signal

from .chain import ChainBit, carry_chain
from .normalise import normalise, normalise_delays
from .operator import BinaryOperator, is_inf, is_zero
from .packing import round_and_pack, round_and_pack_delays
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


def _far_level(fmt):
    # Of a distance of 2^level and more only a few bits are left, of twice that only sticky.
    return min((fmt.sig_width + 1).bit_length(), fmt.exp_width) - 1


class Adder(BinaryOperator):
    """r = a + b, rounded once.

    One path: order by exponent, align the smaller, add or subtract, normalise, round. At equal exponents the
    difference may come out negative; it is exact then, and the rounding makes it positive.

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
            "distance": carry_delay(fmt.exp_width),
            "order": lut_delay(3),
            # The first one leaves out what is far, too.
            **{f"align_{level}": lut_delay(2 if level == _far_level(fmt) - 1 else 1)
               for level in range(_far_level(fmt))[::-1]},
            "add": carry_delay(fmt.sig_width + 4),
            **normalise_delays(fmt.sig_width + 3),
            **round_and_pack_delays(fmt),
        }

    def _compute(self, m, step):
        fmt, a, b = self.fmt, self.a, self.b
        subtract = Signal()
        m.d.comb += subtract.eq(a.sign ^ b.sign ^ self._subtracts)
        distance = carry_chain(m, "distance", (ChainBit.CARRY, Const(1, 1), 0, 0),
                               (ChainBit.SUBTRACT, a.exp, b.exp, 0))[1:]
        # What the last place lets pass it shows inverted.
        swap = Mux(a.exp[-1] == b.exp[-1], distance[-1], b.exp[-1])
        a_inf, b_inf, a_zero, b_zero, invalid = (Signal(name=name) for name in (
            "a_inf", "b_inf", "a_zero", "b_zero", "invalid"))
        m.d.comb += [a_inf.eq(is_inf(a)), b_inf.eq(is_inf(b)), a_zero.eq(is_zero(a)), b_zero.eq(is_zero(b)),
                     invalid.eq(a_inf & b_inf & subtract)]
        s = step("distance", distance=distance, swap=swap, a_exp=a.exp, b_exp=b.exp, a_frac=a.frac, b_frac=b.frac,
                 a_sign=a.sign, subtract=subtract, a_zero=a_zero, b_zero=b_zero, inf=(a_inf | b_inf) & ~invalid,
                 invalid=invalid, unsigned=invalid | a_zero & b_zero & subtract)

        # Where b is ahead its distance is one less than the complement says: a is moved by that one as it is chosen.
        swap, far_level = s.swap, _far_level(fmt)
        distance = s.distance ^ swap.replicate(fmt.exp_width)
        small_zero = Mux(swap, s.a_zero, s.b_zero)
        beyond, far = distance[far_level + 1:].any(), distance[far_level]
        s = step("order", distance=distance[:far_level], near=~(small_zero | beyond | far),
                 far=far & ~(small_zero | beyond), sticky=beyond & ~small_zero,
                 small=Mux(swap, Cat(Const(0, 1), s.a_frac, Const(1, 2)), Cat(Const(0, 2), s.b_frac, Const(1, 1))),
                 big_exp=Mux(swap, s.b_exp, s.a_exp), big_frac=Mux(swap, s.b_frac, s.a_frac),
                 sign=(s.a_sign ^ swap & s.subtract) & ~s.unsigned, subtract=s.subtract, zero=s.invalid, inf=s.inf)

        # In the tables of the next shift, what is far or zero can be left out for nothing.
        near, left = s.small & s.near.replicate(len(s.small)), len(s.small) - (1 << far_level)
        small = Cat(near[:left] | s.small[-left:] & s.far.replicate(left), near[left:])
        s.sticky = s.sticky | s.far & s.small[:-left].any()
        for level in range(far_level)[::-1]:
            places = 1 << level
            moves = s.distance[level]
            s = step(f"align_{level}", s, small=Mux(moves, small >> places, small),
                     sticky=s.sticky | moves & small[:places].any())
            small = s.small

        total = carry_chain(m, "significands", (ChainBit.CARRY, s.subtract, s.sticky, 0),
                            (ChainBit.ADD, Cat(Const(0, 2), s.big_frac, Const(1, 2)), Cat(small, Const(0, 1)),
                             s.subtract))[1:]
        s = step("add", magnitude=total, negative=total[-1] & s.subtract, sticky=s.sticky, exp=s.big_exp,
                 subtract=s.subtract, zero=s.zero, inf=s.inf, sign=s.sign)
        s = normalise(step, s)
        sum_sign = s.sign ^ s.negative
        # An exact zero
        cancelled = ~(s.sig[-2:] | s.shifted[-2:]).any() & ~s.inf
        s = SimpleNamespace(**vars(s) | {
            "exp": Cat(s.exp, Const(0, 1)).as_signed(), "zero": s.zero | cancelled,
            "sign": sum_sign & ~(cancelled & s.subtract)})
        m.d.comb += self.r.eq(round_and_pack(step, m, s, fmt=fmt, rounding=self.rounding))


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
