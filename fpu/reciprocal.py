"""Reciprocal and division by table."""

from functools import lru_cache
from types import MappingProxyType, SimpleNamespace

import numpy as np
from amaranth.hdl import Cat, Const, Mux

from .chain import ChainBit, carry_chain
from .divider import divide
from .operator import BinaryOperator, UnaryOperator, is_inf, is_zero
from .packing import round_and_pack, round_and_pack_delays
from .pipeline import carry_delay, lut_delay
from .product import multiply_exactly, product_delays
from .rounding import Rounding, emulated, round_nearest
from .table import LineTable

__all__ = ["MAX_FRAC_WIDTH", "Reciprocal", "TableDivider", "reciprocal"]

#: For more fraction bits the lines of a table would not be near enough, nor the multiplier blocks wide enough.
MAX_FRAC_WIDTH = 16
_INDEX_WIDTH = 9


@emulated
def reciprocal(params, a):
    """1 / a rounded to nearest even."""
    return round_nearest(params, 1.0 / a)


def check_fits_table(fmt):
    """Raises ValueError if a significand is too wide for operators by table."""
    if fmt.frac_width > MAX_FRAC_WIDTH:
        raise ValueError(f"By table goes a fraction of up to {MAX_FRAC_WIDTH} bits, not {fmt.frac_width}; take a digit "
                         "recurrence: Divider, SquareRoot, DigitReciprocalSquareRoot")


@lru_cache
def _reciprocals(frac_width, *, half_unit):
    """Table of 1 / x for x in [1, 2), plus ``half_unit`` so that cutting it there rounds it."""
    points = 1 + np.arange(1 << frac_width) / (1 << frac_width)
    largest = 1 - 2.0 ** -(frac_width + 3)
    return LineTable(lambda x: np.minimum(1 / x + half_unit, largest), points,
                     num_lines=1 << min(frac_width, _INDEX_WIDTH), value_width=frac_width + 6)


def _line_and_offset(frac, table):
    return frac[table.offset_width:], frac[:table.offset_width]


class Reciprocal(UnaryOperator):
    """r = 1 / a, rounded once to nearest even, by table: two multiplier blocks and a block RAM.

    A line gives 1 / a to within less than half a unit in the last place, so that only one number half-way between two
    members can be on the other side; its product with ``a`` tells. 1 / ±0 is ±∞ and 1 / ±∞ is ±0.

    Parameters
    ----------
    fmt : FloatFormat
        Format of operand and result, with up to 16 fraction bits.
    latency : int or None
        See :class:`~fpu.operator.Operator`.

    Members
    -------
    a : In(fmt)
        Divisor.
    r : Out(fmt)
        Reciprocal, ``latency`` cycles later.

    Raises
    ------
    ValueError
        If the fraction is too wide, or ``latency`` negative.
    """

    emulation = MappingProxyType({Rounding.NEAREST_EVEN: reciprocal})

    def __init__(self, fmt, *, latency=None):
        check_fits_table(fmt)
        super().__init__(fmt, latency=latency)

    @classmethod
    def _table(cls, fmt):
        check_fits_table(fmt)
        return _reciprocals(fmt.frac_width, half_unit=0.0)

    @classmethod
    def _step_delays(cls, fmt):
        return {**cls._table(fmt).delays("estimate"), **product_delays("check", fmt.sig_width + 1, fmt.sig_width),
                "side": lut_delay(2), **round_and_pack_delays(fmt)}

    def _compute(self, m, step):
        fmt, a, table = self.fmt, self.a, self._table(self.fmt)
        s = table.look_up(m, step, "estimate", *_line_and_offset(a.frac, table),
                          frac=a.frac, exp=a.exp, sign=a.sign, zero=is_inf(a), inf=is_zero(a))
        # In (½, 1): the significand rounded down, and what is half a unit above.
        estimate = s.value[-fmt.sig_width:]
        s = multiply_exactly(m, step, "check", (Cat(Const(1, 1), estimate), Cat(s.frac, Const(1, 1))),
                             estimate=estimate, exp=s.exp, sign=s.sign, zero=s.zero, inf=s.inf)
        # Below 1, the product says that 1 / a is above. That goes in as the guard bit: it cannot be in the middle.
        s = step("side", above=~s.products[0][2 * fmt.frac_width + 2],
                 **{name: getattr(s, name) for name in ("estimate", "exp", "sign", "zero", "inf")})
        exp = carry_chain(m, "exponent", (ChainBit.CARRY, Const(1, 1), 0, 0),
                          (ChainBit.SUBTRACT, Const(2 * fmt.bias - 1, fmt.exp_width + 2), Cat(s.exp, Const(0, 2)), 0))
        s = SimpleNamespace(sig=Cat(s.above, s.estimate, Const(0, 1)), sticky=Const(1, 1), exp=exp[1:].as_signed(),
                            sign=s.sign, zero=s.zero, inf=s.inf)
        m.d.comb += self.r.eq(round_and_pack(step, m, s, fmt=fmt, rounding=self.rounding))


class TableDivider(BinaryOperator):
    """r = a / b, rounded once to nearest even, by table: three multiplier blocks and a block RAM.

    Bit for bit what :class:`~fpu.divider.Divider` gives. The product of ``a`` and a line's 1 / b is within less than
    half a unit in the last place of the quotient, so that only one number half-way between two members can be on the
    other side; its product with ``b`` tells.

    Parameters
    ----------
    fmt : FloatFormat
        Format of operands and result, with up to 16 fraction bits.
    latency : int or None
        See :class:`~fpu.operator.Operator`.

    Members
    -------
    a, b : In(fmt)
        Dividend and divisor.
    r : Out(fmt)
        Quotient, ``latency`` cycles later.

    Raises
    ------
    ValueError
        If the fraction is too wide, or ``latency`` negative.
    """

    emulation = MappingProxyType({Rounding.NEAREST_EVEN: divide})

    def __init__(self, fmt, *, latency=None):
        check_fits_table(fmt)
        super().__init__(fmt, latency=latency)

    @classmethod
    def _table(cls, fmt):
        check_fits_table(fmt)
        return _reciprocals(fmt.frac_width, half_unit=2.0 ** -(fmt.frac_width + 4))

    @classmethod
    def _step_delays(cls, fmt):
        return {**cls._table(fmt).delays("estimate"), **product_delays("quotient", fmt.sig_width, fmt.sig_width + 1),
                "sum": carry_delay(fmt.sig_width + 1) + lut_delay(1),
                **product_delays("check", fmt.sig_width + 1, fmt.sig_width), "side": lut_delay(2),
                **round_and_pack_delays(fmt)}

    def _compute(self, m, step):
        fmt, a, b, table = self.fmt, self.a, self.b, self._table(self.fmt)
        zero, inf = is_zero(a) | is_inf(b), is_inf(a) | is_zero(b)
        # The chain lacks one, and so does the bias, one less than a power of two: the rest is the upper bits'.
        above = fmt.exp_width - 1
        distance = carry_chain(m, "exponent",
                               (ChainBit.SUBTRACT, Cat(a.exp, Const(0, 1)), Cat(b.exp, Const(0, 1)), 0))
        exp = Cat(distance[:above], distance[above:].as_signed() + 1)[:fmt.exp_width + 2]
        s = table.look_up(m, step, "estimate", *_line_and_offset(b.frac, table), a_frac=a.frac, b_frac=b.frac,
                          exp=exp, sign=(a.sign ^ b.sign) & ~(zero & inf), zero=zero, inf=inf & ~zero)
        # 1 / b is above a half: that part of the product is a / 2.
        dividend, above_half = Cat(s.a_frac, Const(1, 1)), s.value[3:-1]
        s = multiply_exactly(m, step, "quotient", (dividend, above_half), dividend=dividend,
                             **{name: getattr(s, name) for name in ("b_frac", "exp", "sign", "zero", "inf")})
        quotient = carry_chain(m, "quotient_sum", (ChainBit.ADD, Cat(s.products[0][fmt.sig_width + 1:], Const(0, 1)),
                                                   Cat(s.dividend, Const(0, 1)), 0))
        # What is half a unit above the quotient rounded down, whose unit depends on whether it is above 1.
        above_one = quotient[-1]
        half_way = Cat(Const(1, 1), Mux(above_one, quotient[1:], quotient[:-1]))
        s = step("sum", quotient=quotient, half_way=half_way, dividend=s.dividend[:3], b_frac=s.b_frac,
                 exp=s.exp, sign=s.sign, zero=s.zero, inf=s.inf)
        s = multiply_exactly(m, step, "check", (s.half_way, Cat(s.b_frac, Const(1, 1))), dividend=s.dividend,
                             **{name: getattr(s, name) for name in ("quotient", "exp", "sign", "zero", "inf")})
        # The sign of what the product leaves of the dividend, which is small. Its lower bits are never all zero: they
        # borrow one.
        above_one, dividend = s.quotient[-1], Cat(s.dividend, Const(0, 3))
        rest = Mux(above_one, dividend[:3], Cat(Const(0, 1), dividend[:2])) - s.products[0][fmt.sig_width:][:3] - 1
        s = step("side", above=~rest[2], quotient=s.quotient, exp=s.exp, sign=s.sign, zero=s.zero, inf=s.inf)
        # Twice the quotient, with the side as its guard bit: it cannot be in the middle.
        sig = Cat(s.above, Mux(s.quotient[-1], s.above, s.quotient[0]), s.quotient[1:])
        s = SimpleNamespace(sig=sig, sticky=Const(1, 1), exp_above=s.exp.as_signed(), sign=s.sign, zero=s.zero,
                            inf=s.inf)
        m.d.comb += self.r.eq(round_and_pack(step, m, s, fmt=fmt, rounding=self.rounding))
