"""Reciprocal square root by table."""

import math
from functools import lru_cache
from types import MappingProxyType, SimpleNamespace

import numpy as np
from amaranth.hdl import Cat, Const, Mux

from .chain import ChainBit, carry_chain
from .operator import UnaryOperator, is_inf, is_zero
from .packing import round_and_pack, round_and_pack_delays
from .pipeline import carry_delay, lut_delay
from .product import multiply_exactly, product_delays
from .reciprocal import check_fits_table
from .rounding import Rounding, emulated, round_nearest
from .table import LineTable

__all__ = ["ReciprocalSquareRoot", "reciprocal_square_root", "root_operands"]

_INDEX_WIDTH = 8


@emulated
def reciprocal_square_root(params, a):
    """1 / √a rounded to nearest even; ±∞ of ±0, and +0 below.

    Rounding three times does not harm: no result of any format is near enough to what is half-way between two
    members (every significand is tried in the tests).
    """
    if a < 0.0:
        return 0.0
    return math.copysign(math.inf, a) if a == 0.0 else round_nearest(params, 1.0 / math.sqrt(a))


@lru_cache
def _roots(frac_width):
    """Table of 1 / √x for x in [1, 2), then for x in [2, 4)."""
    significands = 1 + np.arange(1 << frac_width) / (1 << frac_width)
    largest = 1 - 2.0 ** -(frac_width + 3)
    return LineTable(lambda x: np.minimum(x ** -0.5, largest), np.concatenate([significands, 2 * significands]),
                     num_lines=2 << min(frac_width, _INDEX_WIDTH), value_width=frac_width + 6)


def root_operands(m, a):
    """The radicand's significand, doubled where the exponent is odd; whether it is; and of the result what is known.

    That is ``exp``, before the significand in (½, 1], and ``sign``, ``zero`` and ``inf``.
    """
    fmt = a.shape()
    # The bias is odd: with an even stored exponent the exponent is odd, and the radicand is doubled.
    is_doubled = ~a.exp[0]
    radicand = Mux(is_doubled, Cat(Const(0, 1), a.frac, Const(1, 1)), Cat(a.frac, Const(1, 2)))
    exp = carry_chain(m, "exponent", (ChainBit.CARRY, Const(1, 1), 0, 0),
                      (ChainBit.SUBTRACT, Const(3 * fmt.bias - 1, fmt.exp_width + 2), Cat(a.exp, Const(0, 2)), 0))
    return radicand, is_doubled, {"exp": exp[2:], "sign": a.sign & is_zero(a),
                                  "zero": ~is_zero(a) & (a.sign | is_inf(a)), "inf": is_zero(a)}


class ReciprocalSquareRoot(UnaryOperator):
    """r = 1 / √a, rounded once to nearest even, by table: four multiplier blocks and a block RAM.

    A line gives 1 / √a to within less than half a unit in the last place, so that only one number half-way between two
    members can be on the other side; its square times ``a`` tells. 1 / √±0 is ±∞, 1 / √+∞ is +0, and of what is below
    zero the result is +0.

    Parameters
    ----------
    fmt : FloatFormat
        Format of operand and result, with up to 16 fraction bits.
    latency : int or None
        See :class:`~fpu.operator.Operator`.

    Members
    -------
    a : In(fmt)
        Radicand.
    r : Out(fmt)
        Reciprocal of its root, ``latency`` cycles later.

    Raises
    ------
    ValueError
        If the fraction is too wide, or ``latency`` negative.
    """

    emulation = MappingProxyType({Rounding.NEAREST_EVEN: reciprocal_square_root})

    def __init__(self, fmt, *, latency=None):
        check_fits_table(fmt)
        super().__init__(fmt, latency=latency)

    @classmethod
    def _step_delays(cls, fmt):
        check_fits_table(fmt)
        width = fmt.sig_width + 1
        return {**_roots(fmt.frac_width).delays("estimate"),
                **product_delays("square", width, width), "move": lut_delay(2),
                **product_delays("check", width, width), "sum": carry_delay(2 * width) + lut_delay(1),
                "side": lut_delay(2), **round_and_pack_delays(fmt)}

    def _compute(self, m, step):
        fmt, a, table = self.fmt, self.a, _roots(self.fmt.frac_width)
        radicand, is_doubled, known = root_operands(m, a)
        s = table.look_up(m, step, "estimate", Cat(a.frac, is_doubled)[table.offset_width:],
                          a.frac[:table.offset_width], radicand=radicand, **known)
        # In (½, 1): the significand rounded down, and what is half a unit above.
        estimate = s.value[-fmt.sig_width:]
        half_way = Cat(Const(1, 1), estimate)
        rest = {name: getattr(s, name) for name in known}
        s = multiply_exactly(m, step, "square", (half_way, half_way), estimate=estimate,
                             radicand=s.radicand, **rest)
        # From one multiplier block to the next takes all of a clock.
        square = s.products[0]
        s = step("move", square=square, **{name: getattr(s, name) for name in ("estimate", "radicand", *rest)})
        lower, upper = s.square[:fmt.sig_width + 1], s.square[fmt.sig_width + 1:]
        s = multiply_exactly(m, step, "check", (lower, s.radicand), (upper, s.radicand),
                             **{name: getattr(s, name) for name in ("estimate", *rest)})
        one = 2 * fmt.frac_width + 2
        product = carry_chain(m, "check_sum", (ChainBit.ADD, s.products[1][:one + 1],
                                               Cat(s.products[0][len(lower):], Const(0, one))[:one + 1], 0))
        s = step("sum", exceeds=product[one], **{name: getattr(s, name) for name in ("estimate", *rest)})
        # Unless it exceeds 1, 1 / √a is above. That goes in as the guard bit: it cannot be in the middle.
        s = step("side", above=~s.exceeds, **{name: getattr(s, name) for name in ("estimate", *rest)})
        s = SimpleNamespace(sig=Cat(s.above, s.estimate, Const(0, 1)), sticky=Const(1, 1),
                            exp=Cat(s.exp, Const(0, 2)).as_signed(), sign=s.sign, zero=s.zero, inf=s.inf)
        m.d.comb += self.r.eq(round_and_pack(step, m, s, fmt=fmt, rounding=self.rounding))
