"""Reciprocal square root digit by digit."""

from types import MappingProxyType, SimpleNamespace

from amaranth.hdl import Cat, Const, Mux

from .chain import ChainBit, carry_chain
from .operator import UnaryOperator
from .packing import round_and_pack, round_and_pack_delays
from .pipeline import carry_delay, digit_delay, lut_delay
from .reciprocal import MAX_FRAC_WIDTH
from .reciprocal_square_root import ReciprocalSquareRoot, reciprocal_square_root, root_operands
from .rounding import Rounding

__all__ = ["DigitReciprocalSquareRoot", "reciprocal_square_root_for"]

_FIRST_STEPS = "multiples", "digit_2"


def reciprocal_square_root_for(fmt):
    """The class of operators that gives 1 / √a in a format: by table where a table has room for it, else by digits."""
    return ReciprocalSquareRoot if fmt.frac_width <= MAX_FRAC_WIDTH else DigitReciprocalSquareRoot


class DigitReciprocalSquareRoot(UnaryOperator):
    """r = 1 / √a, rounded once to nearest even, by a digit recurrence of radix 2 in any width, without a multiplier.

    With x in [1, 4) the radicand and uᵢ the odd number whose uᵢ/2ⁱ lies in the middle of what is left for the root, the
    sign of tᵢ = 2²ⁱ (1 - x (uᵢ/2ⁱ)²) is the next digit, s = ±1. Then uᵢ₊₁ = 2uᵢ + s, and tᵢ₊₁ = 4tᵢ - s (4uᵢ + s) x,
    of which the factor of s is kept from digit to digit: it takes another chain, but no product.

    1 / √±0 is ±∞, 1 / √+∞ is +0, and of what is below zero the result is +0.

    Parameters
    ----------
    fmt, latency
        See :class:`~fpu.operator.Operator`.

    Members
    -------
    a : In(fmt)
        Radicand.
    r : Out(fmt)
        Reciprocal of its root, ``latency`` cycles later.
    """

    emulation = MappingProxyType({Rounding.NEAREST_EVEN: reciprocal_square_root})

    @classmethod
    def _step_delays(cls, fmt):
        width = fmt.frac_width + 5
        delays = dict.fromkeys(_FIRST_STEPS, carry_delay(width))
        for digit in range(2, fmt.sig_width + 1):
            delays[f"factor_{digit}"] = lut_delay(1) + digit_delay(width + digit)
            delays[f"digit_{digit + 1}"] = digit_delay(width + digit)
        return delays | round_and_pack_delays(fmt)

    def _compute(self, m, step):
        fmt = self.fmt
        radicand, _, known = root_operands(m, self.a)

        def multiple(factor):
            """Radicand times 1 + 2^factor."""
            width = len(radicand) + factor + 1
            return carry_chain(m, f"multiple_{factor}", (ChainBit.ADD, Cat(radicand, Const(0, factor + 1)),
                                                         Cat(Const(0, factor), radicand, Const(0, 1)), 0))[:width]

        s = step("multiples", radicand=radicand, triple=multiple(1), factor=multiple(2), ninefold=multiple(3),
                 **known)
        # The root is more than ½: the first digit is set, and the middle of what is left ¾.
        width = len(s.ninefold) + 1
        left = carry_chain(m, "left_2", (ChainBit.CARRY, Const(1, 1), 0, 0),
                           (ChainBit.SUBTRACT, Const(16 << fmt.frac_width, width), Cat(s.ninefold, Const(0, 1)), 0))[1:]
        kept = {name: value for name, value in vars(s).items() if name != "ninefold"}
        s = step("digit_2", left=left, root=Const(1, 1), was_less=Const(0, 1), **kept)

        for digit in range(2, fmt.sig_width + 1):
            # Two signs alike add thrice the radicand to twice the factor, else they add it once; as the former says.
            is_less, width = s.left[-1], len(s.factor) + 1
            addend = Mux(is_less == s.was_less, s.triple, s.radicand)
            factor = carry_chain(m, f"factor_{digit}", (ChainBit.CARRY, s.was_less, 0, 0),
                                 (ChainBit.ADD, Cat(Const(0, 1), s.factor),
                                  Cat(addend, Const(0, width - len(addend))), s.was_less))[1:]
            s = step(f"factor_{digit}", s, factor=factor, was_less=is_less, root=Cat(~is_less, s.root))
            # 4·left, of which the result has no need of the uppermost bit.
            width = len(s.left) + 1
            left = carry_chain(m, f"left_{digit + 1}", (ChainBit.CARRY, ~s.was_less, 0, 0),
                               (ChainBit.ADD, Cat(Const(0, 2), s.left[:-1]),
                                Cat(s.factor, Const(0, width))[:width], ~s.was_less))[1:]
            s = step(f"digit_{digit + 1}", s, left=left)

        # A root is never halfway between two members: what is left does not matter. Of 1 all digits are set.
        s = SimpleNamespace(sig=Cat(~s.left[-1], s.root, Const(0, 1)), sticky=Const(1, 1),
                            exp=Cat(s.exp, Const(0, 2)).as_signed(), sign=s.sign, zero=s.zero, inf=s.inf)
        m.d.comb += self.r.eq(round_and_pack(step, m, s, fmt=fmt, rounding=self.rounding))
