"""Division."""

from types import MappingProxyType, SimpleNamespace

from amaranth.hdl import Cat, Const, Mux, Signal, signed

from .operator import BinaryOperator, is_inf, is_zero, round_and_pack, round_and_pack_delays
from .pipeline import carry_delay, lut_delay
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
    """r = a / b, rounded once, by restoring digit recurrence of radix 2.

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
        delays = {}
        for bit in _quotient_bits(fmt):
            delays[f"subtract_{bit}"] = carry_delay(fmt.sig_width + 1)
            delays[f"restore_{bit}"] = lut_delay(1.3)
        del delays["restore_0"]
        return delays | round_and_pack_delays(fmt)

    def _compute(self, m, step):
        fmt, a, b = self.fmt, self.a, self.b
        zero = is_zero(a) | is_inf(b)
        inf = is_inf(a) | is_zero(b)
        # Of a quotient below 1 this is one too many
        above = fmt.exp_width - 1
        exp_distance = Signal(signed(fmt.exp_width + 1))
        exp = Signal(signed(fmt.exp_width + 2))
        m.d.comb += [exp_distance.eq(Cat(a.exp, 0, 0).as_signed() + (~Cat(b.exp, 0)).as_signed()),
                     exp.eq(Cat(exp_distance[:above], exp_distance[above:].as_signed() + 1))]
        # The remainder is kept complemented: ~(r - d) = ~r + d is a carry chain that begins without a carry.
        s = SimpleNamespace(remainder=~Cat(a.frac, Const(1, 2)), divisor=Cat(b.frac, Const(1, 1)),
                            quotient=Const(0, 0), exp=exp,
                            zero=zero, inf=inf & ~zero, sign=(a.sign ^ b.sign) & ~(zero & inf))

        for bit in _quotient_bits(fmt):
            s = step(f"subtract_{bit}", s, difference=(s.remainder + s.divisor)[:fmt.sig_width + 1])
            fits = s.difference[-1]
            quotient = Cat(fits, s.quotient)
            if bit:
                remainder = Mux(fits, s.difference, s.remainder)[:fmt.sig_width]
                s = step(f"restore_{bit}", s, remainder=Cat(Const(1, 1), remainder), quotient=quotient)

        # A quotient is never halfway between two members, so what remains does not matter.
        s = SimpleNamespace(sig=quotient, sticky=Const(1), exp=s.exp - 1, exp_carried=s.exp,
                            zero=s.zero, inf=s.inf, sign=s.sign)
        m.d.comb += self.r.eq(round_and_pack(step, s, fmt=fmt, rounding=self.rounding))
