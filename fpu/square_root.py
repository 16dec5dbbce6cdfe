"""Square root."""

import math
from types import MappingProxyType, SimpleNamespace

from amaranth.hdl import Cat, Const, Mux

from .chain import ChainBit, carry_chain
from .operator import UnaryOperator, is_inf, is_zero
from .packing import round_and_pack, round_and_pack_delays
from .pipeline import digit_delay
from .rounding import Rounding, emulated, round_nearest, round_truncate

__all__ = ["SquareRoot", "square_root", "square_root_truncate"]


@emulated
def square_root(params, a):
    """√a rounded to nearest even; +0 below zero.

    A root that is not a member is further from every member, and from what is halfway between two, than float64's
    rounding reaches.
    """
    return round_nearest(params, math.sqrt(a)) if a >= 0.0 else 0.0


@emulated
def square_root_truncate(params, a):
    """√a rounded towards zero; +0 below zero."""
    return round_truncate(params, math.sqrt(a)) if a >= 0.0 else 0.0


class SquareRoot(UnaryOperator):
    """r = √a, rounded once, by non-restoring digit recurrence of radix 2.

    √±0 is ±0, √+∞ is +∞, and the root of what is below zero +0.

    Parameters
    ----------
    fmt, latency, rounding
        See :class:`~fpu.operator.Operator`.

    Members
    -------
    a : In(fmt)
        Radicand.
    r : Out(fmt)
        Root, ``latency`` cycles later.
    """

    emulation = MappingProxyType({Rounding.NEAREST_EVEN: square_root, Rounding.TRUNCATE: square_root_truncate})

    @classmethod
    def _step_delays(cls, fmt):
        # Hidden bit and guard bit; the first is always set.
        return {f"digit_{digit}": digit_delay(digit + 3) for digit in range(1, fmt.sig_width + 1)} \
            | round_and_pack_delays(fmt)

    def _compute(self, m, step):
        fmt, a = self.fmt, self.a
        # The bias is odd: with an odd stored exponent the exponent is even, and halved without a rest; else the
        # radicand is doubled.
        exp = carry_chain(m, "exponent", (ChainBit.ADD, Cat(a.exp, Const(0, 1)), Const(fmt.bias, fmt.exp_width + 1), 0))
        significand = Cat(a.frac, Const(1, 1))
        radicand = Mux(a.exp[0], Cat(significand, Const(0, 1)), Cat(Const(0, 1), significand))
        # Its digits of two bits; the first, before the point, has the root 1.
        radicand = Cat(Const(0, fmt.frac_width % 2), radicand)
        first = radicand[-2:]
        is_root = ~a.sign & ~is_zero(a)
        s = SimpleNamespace(remainder=Cat(~first[0], first.all(), Const(0, 1)), returns=Const(0, 1),
                            root=Const(1, 1), radicand=radicand[:-2], exp=exp[1:], sign=a.sign & is_zero(a),
                            zero=~is_root, inf=is_inf(a) & is_root)

        for digit in range(1, fmt.sig_width + 1):
            # 4·remainder + next two bits, less 4·root + 1; or, if that was too much, more by 4·root + 3. Both add 3 to
            # the lower two bits, so that only what they carry goes into the chain. Its last place comes out inverted.
            following, radicand = Const(0, 2), s.radicand
            if len(radicand):
                following, radicand = radicand[-2:], radicand[:-2]
            upper = carry_chain(m, f"remainder_{digit}", (ChainBit.CARRY, following.any(), 0, 0),
                                (ChainBit.SUBTRACT, s.remainder, Cat(s.root, Const(0b10, 2)), s.returns))[1:]
            s = step(f"digit_{digit}", s, radicand=radicand, returns=upper[-2], root=Cat(upper[-1], s.root),
                     remainder=Cat(~following[0], ~(following[0] ^ following[1]), upper[:-1]))

        # A root is never halfway between two members, so what remains does not matter.
        s = SimpleNamespace(sig=Cat(s.root, Const(0, 1)), sticky=Const(1, 1), exp=Cat(s.exp, Const(0, 2)).as_signed(),
                            sign=s.sign, zero=s.zero, inf=s.inf)
        m.d.comb += self.r.eq(round_and_pack(step, m, s, fmt=fmt, rounding=self.rounding))
