"""Division."""

from types import MappingProxyType, SimpleNamespace

from amaranth.hdl import Cat, Const

from .chain import ChainBit, carry_chain
from .operator import BinaryOperator, is_inf, is_zero
from .packing import round_and_pack, round_and_pack_delays
from .pipeline import digit_delay
from .rounding import Rounding, emulated, round_nearest, round_truncate

__all__ = ["Divider", "divide", "divide_truncate"]


@emulated
def divide(params, a, b):
    """``a / b`` rounded to nearest even."""
    return round_nearest(params, a / b)


@emulated
def divide_truncate(params, a, b):
    """``a / b`` rounded towards zero.

    A quotient of members that is not a member is further from every member than float64's rounding reaches.
    """
    return round_truncate(params, a / b)


def _quotient_bits(fmt):
    # The quotient is in (1/2, 2): a guard bit whether it begins with 0 or with 1.
    return range(fmt.sig_width + 2)[::-1]


class Divider(BinaryOperator):
    """r = a / b, rounded once, by non-restoring digit recurrence of radix 2.

    x / 0 is ±∞ for x ≠ 0; 0 / 0 and ∞ / ∞ are +0. A stage holds as many quotient bits as its share of the depth asks.

    Parameters
    ----------
    fmt, latency, rounding
        See :class:`~fpu.operator.Operator`.

    Members
    -------
    a, b : In(fmt)
        Dividend and divisor.
    r : Out(fmt)
        Quotient, ``latency`` cycles later.
    """

    emulation = MappingProxyType({Rounding.NEAREST_EVEN: divide, Rounding.TRUNCATE: divide_truncate})

    @classmethod
    def _step_delays(cls, fmt):
        return {f"digit_{bit}": digit_delay(fmt.sig_width + 1) for bit in _quotient_bits(fmt)} \
            | round_and_pack_delays(fmt)

    def _compute(self, m, step):
        fmt, a, b = self.fmt, self.a, self.b
        zero = is_zero(a) | is_inf(b)
        inf = is_inf(a) | is_zero(b)
        # The chain lacks one, and so does the bias, one less than a power of two: the rest is the upper bits'.
        above = fmt.exp_width - 1
        distance = carry_chain(m, "exponent",
                               (ChainBit.SUBTRACT, Cat(a.exp, Const(0, 1)), Cat(b.exp, Const(0, 1)), 0))
        exp = Cat(distance[:above], distance[above:].as_signed() + 1)[:fmt.exp_width + 2].as_signed()
        # Twice the remainder; the divisor, with a place for the sign and one in which it comes out inverted.
        s = SimpleNamespace(dividend=Cat(a.frac, Const(1, 3)), returns=Const(0, 1),
                            divisor=Cat(b.frac, Const(0b101, 3)), quotient=Const(0, 0), exp=exp,
                            zero=zero, inf=inf & ~zero, sign=(a.sign ^ b.sign) & ~(zero & inf))

        for bit in _quotient_bits(fmt):
            # Of a divisor that was too much half is given back: that is to take the next one.
            remainder = carry_chain(m, f"remainder_{bit}", (ChainBit.CARRY, Const(1, 1), s.returns, 0),
                                    (ChainBit.SUBTRACT, s.dividend, s.divisor, s.returns))[1:]
            s = step(f"digit_{bit}", s, dividend=Cat(Const(0, 1), remainder[:-1]), returns=remainder[-2],
                     quotient=Cat(remainder[-1], s.quotient))

        # A quotient is never halfway between two members, so what remains does not matter.
        s = SimpleNamespace(sig=s.quotient, sticky=Const(1), exp_above=s.exp, zero=s.zero, inf=s.inf, sign=s.sign)
        m.d.comb += self.r.eq(round_and_pack(step, m, s, fmt=fmt, rounding=self.rounding))
