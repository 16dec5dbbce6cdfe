"""Fused dot product."""

import math
from types import MappingProxyType, SimpleNamespace

import numpy as np
from amaranth.hdl import Cat, Const, Mux, Signal
from amaranth.lib import data
from amaranth.lib.wiring import In, Out

from .chain import ChainBit, carry_chain
from .normalise import normalise, normalise_delays
from .operator import Operator, is_inf, is_zero
from .packing import round_and_pack, round_and_pack_delays
from .pipeline import carry_delay, depth_for, lut_delay
from .product import multiply_exactly, product_delays
from .rounding import Rounding, emulated, round_nearest, round_truncate

__all__ = ["DotProduct", "dot_product", "dot_product_truncate"]

_LOWEST = -(1 << 40)


@emulated
def _exponent(x):
    return math.frexp(x)[1] - 1


@emulated
def _exact_sum(params, guard_width, ax, ay, az, bx, by, bz, c):
    """Sum of the terms cut to the window, as float64, which holds it; NaN where there are both infinities."""
    frac_width = 52 - params[0]
    window = frac_width + (frac_width if guard_width < 0 else guard_width)
    highest, infinite = _LOWEST, 0.0
    for a, b in ((ax, bx), (ay, by), (az, bz), (c, 1.0)):
        term = a * b
        if math.isinf(term):
            infinite += term
        elif not math.isnan(term) and term != 0.0:
            highest = max(highest, _exponent(a) + _exponent(b))
    if infinite != 0.0:
        return infinite
    if highest == _LOWEST:
        return 0.0
    total = np.int64(0)
    for a, b in ((ax, bx), (ay, by), (az, bz), (c, 1.0)):
        term = a * b
        if not math.isnan(term):
            # Cut towards zero.
            total += np.int64(math.ldexp(term, window - highest))
    return math.ldexp(float(total), highest - window)


@emulated
def dot_product(params, guard_width, ax, ay, az, bx, by, bz, c):
    """ax·bx + ay·by + az·bz + c as of :class:`DotProduct`, rounded to nearest even."""
    return round_nearest(params, _exact_sum(params, guard_width, ax, ay, az, bx, by, bz, c))


@emulated
def dot_product_truncate(params, guard_width, ax, ay, az, bx, by, bz, c):
    """ax·bx + ay·by + az·bz + c as of :class:`DotProduct`, rounded towards zero."""
    return round_truncate(params, _exact_sum(params, guard_width, ax, ay, az, bx, by, bz, c))


class DotProduct(Operator):
    """r = a₀·b₀ + a₁·b₁ + a₂·b₂ + c, rounded once.

    The products are exact. All four terms are aligned to the one of the highest exponent (of a product: the sum of its
    factors'), cut towards zero ``frac_width + guard_width`` bits below that exponent's place, and their sum is rounded.
    So the error is up to half a unit in the last place of the result, and for each term that is cut up to one in the
    last place kept, which counts only where the terms cancel. By default no product of the highest exponent is cut.

    0·∞ is +0, as a term; infinities of both signs give +0; an exact zero is +0.

    Parameters
    ----------
    fmt, latency, rounding
        See :class:`~fpu.operator.Operator`.
    guard_width : int or None
        Bits kept below the last place of a float of the highest exponent, 2 to ``frac_width``, which is the default.
    has_addend : bool
        Whether there is ``c``.

    Members
    -------
    a, b : In(ArrayLayout(fmt, 3))
        Factors.
    c : In(fmt)
        Addend, if there is one.
    r : Out(fmt)
        Sum, ``latency`` cycles later.

    Raises
    ------
    ValueError
        If ``guard_width`` is outside its limits or ``latency`` negative.
    """

    #: Compiled emulation by rounding: ``f(fmt.params, guard_width, *a, *b, c)``, with -1 for the default.
    emulation = MappingProxyType({Rounding.NEAREST_EVEN: dot_product, Rounding.TRUNCATE: dot_product_truncate})

    def __init__(self, fmt, *, guard_width=None, has_addend=True, latency=None, rounding=Rounding.NEAREST_EVEN):
        self.guard_width = fmt.frac_width if guard_width is None else guard_width
        self.has_addend = has_addend
        if not min(2, fmt.frac_width) <= self.guard_width <= fmt.frac_width:
            raise ValueError(f"Guard bits of a dot product in {fmt} must be between 2 and {fmt.frac_width}, not "
                             f"{self.guard_width!r}")
        self._window = fmt.frac_width + self.guard_width
        vector = data.ArrayLayout(fmt, 3)
        super().__init__(fmt, {"a": In(vector), "b": In(vector), **({"c": In(fmt)} if has_addend else {}),
                               "r": Out(fmt)}, latency=latency, rounding=rounding)

    @classmethod
    def default_latency(cls, fmt, *, stage_delay=None):
        """Latency in cycles where none is given, for a component that need not be there."""
        return depth_for(cls._delays_of(fmt, 2 * fmt.frac_width).values(), stage_delay=stage_delay)

    @property
    def _term_width(self):
        # A product is in [1, 4).
        return self._window + 2

    def _delays(self):
        return self._delays_of(self.fmt, self._window)

    @classmethod
    def _delays_of(cls, fmt, window):
        levels = range((window + 1).bit_length())
        return {
            **product_delays("multiply", fmt.sig_width, fmt.sig_width),
            # What is a zero, and which is higher, goes to all places of an exponent.
            "mask": lut_delay(1.5), "pairs": carry_delay(fmt.exp_width + 1) + lut_delay(1.5),
            "highest": carry_delay(fmt.exp_width + 1) + lut_delay(1.5),
            "distance": carry_delay(fmt.exp_width + 1) + lut_delay(2),
            # What chooses a shift goes to all places of a term.
            **{f"align_{level}": lut_delay(1.7) for level in levels[::-1]},
            "sum_pairs": carry_delay(window + 4), "sum": carry_delay(window + 5),
            "magnitude": carry_delay(window + 6),
            **normalise_delays(window + 5),
            **round_and_pack_delays(fmt),
        }

    def _compute(self, m, step):
        fmt = self.fmt
        terms = [(a.sign ^ b.sign, is_zero(a) | is_zero(b), is_inf(a) | is_inf(b)) for a, b in self._factors()]
        # Exponents of products, with twice the bias
        exps = [carry_chain(m, f"exponent_{index}", (
            ChainBit.ADD, Cat(a.exp, Const(0, 1)), Cat(b.exp, Const(0, 1)), 0))
            for index, (a, b) in enumerate(self._factors())]
        if self.has_addend:
            terms.append((self.c.sign, is_zero(self.c), is_inf(self.c)))
            exps.append((Cat(self.c.exp, Const(0, 1)) + fmt.bias)[:fmt.exp_width + 1])
        live = range(len(terms))
        s = multiply_exactly(
            m, step, "multiply", *((Cat(a.frac, Const(1, 1)), Cat(b.frac, Const(1, 1))) for a, b in self._factors()),
            **({"addend": self.c.frac} if self.has_addend else {}),
            **{f"exp{index}": exps[index] for index in live},
            **{f"{name}{index}": terms[index][place]
               for place, name in enumerate(("sign", "zero", "inf")) for index in live})
        # The exponent of a zero must not be the highest.
        specials = [(getattr(s, f"inf{index}") & ~getattr(s, f"zero{index}"), getattr(s, f"sign{index}"))
                    for index in live]
        products = {f"product{index}": product for index, product in enumerate(s.products)}
        kept = ["addend"] * self.has_addend + [f"{name}{index}" for name in ("sign", "zero") for index in live]
        s = step("mask", plus_inf=Cat(inf & ~sign for inf, sign in specials),
                 minus_inf=Cat(inf & sign for inf, sign in specials),
                 **{f"exp{index}": Mux(getattr(s, f"zero{index}"), 0, getattr(s, f"exp{index}")) for index in live},
                 **products, **{name: getattr(s, name) for name in kept})
        significands = [getattr(s, name) for name in products]
        if self.has_addend:
            significands.append(Cat(Const(0, fmt.frac_width), s.addend, Const(1, 2))[:2 * fmt.sig_width])
        plus_inf, minus_inf = s.plus_inf.any(), s.minus_inf.any()
        common = {"inf": plus_inf ^ minus_inf, "invalid": plus_inf & minus_inf, "inf_sign": minus_inf}
        common |= {f"sign{index}": getattr(s, f"sign{index}") for index in live}
        # Cut to the window; zeros have no hidden bit.
        below = 2 * fmt.frac_width - self._window
        moved = {f"term{index}": Mux(getattr(s, f"zero{index}"), 0, significands[index][below:]) for index in live}
        moved |= {f"exp{index}": getattr(s, f"exp{index}") for index in live}

        pairs = [self._higher(m, f"higher_{low}", *(getattr(s, f"exp{index}") for index in live[low:low + 2]))
                 for low in live[::2]]
        s = step("pairs", **common, **moved, **{f"pair{index}": pair for index, pair in enumerate(pairs)})
        carried = [*common, *moved]
        s = step("highest", highest=self._higher(m, "highest", *(getattr(s, f"pair{i}") for i in range(len(pairs)))),
                 **{name: getattr(s, name) for name in carried})
        levels = range((self._window + 1).bit_length())
        distances = {}
        for index in live:
            distance = carry_chain(m, f"distance_{index}", (ChainBit.CARRY, Const(1, 1), 0, 0), (
                ChainBit.SUBTRACT, s.highest, getattr(s, f"exp{index}"), 0))[1:]
            # From 2^levels on nothing is left; which is said by all ones, being as far.
            far = distance[len(levels):].any()
            distances[f"distance{index}"] = distance[:len(levels)] | far.replicate(len(levels))
        kept = [*common, *(f"term{index}" for index in live)]
        s = step("distance", highest=s.highest, **distances, **{name: getattr(s, name) for name in kept})
        for level in levels[::-1]:
            shifted = {}
            for index in live:
                term, distance = getattr(s, f"term{index}"), getattr(s, f"distance{index}")
                shifted[f"term{index}"] = Mux(distance[level], term >> (1 << level), term)[:self._term_width]
            s = step(f"align_{level}", **vars(s) | shifted)
        self._add_and_round(m, step, s)

    def _factors(self):
        return [(self.a[index], self.b[index]) for index in range(3)]

    @staticmethod
    def _higher(m, name, first, second=None):
        """The higher of two exponents."""
        if second is None:
            return first
        below = carry_chain(m, name, (ChainBit.COMPARE, first, second, 0), (ChainBit.ADD, Const(0, 1), 0, 0))[-1]
        return Mux(below, second, first)

    def _add_and_round(self, m, step, s):
        """Sum of ``s.term0`` … with their signs, made positive, normalised and rounded."""
        fmt = self.fmt
        zero = Const(0, 1)
        terms = [(getattr(s, f"term{index}"), getattr(s, f"sign{index}")) for index in range(3 + self.has_addend)]
        if not self.has_addend:
            terms.append((Const(0, self._term_width), zero))
        width = self._term_width + 3
        rest = {name: getattr(s, name) for name in ("highest", "inf", "invalid", "inf_sign")}
        # -x - y = -(x + y): the sign of the first of a pair is that of its sum, and the second is added or taken away.
        pairs = {}
        for pair in range(2):
            (x, x_sign), (y, y_sign) = terms[2 * pair:2 * pair + 2]
            total = carry_chain(m, f"pair_{pair}", (ChainBit.CARRY, x_sign ^ y_sign, 0, 0), (
                ChainBit.ADD, Cat(x, Const(0, 2)), Cat(y, Const(0, 2)), x_sign ^ y_sign))[1:]
            pairs |= {f"total{pair}": total, f"total_sign{pair}": x_sign}
        s = step("sum_pairs", **rest, **pairs)
        x, y = (Cat(total, total[-1].replicate(width - len(total))) for total in (s.total0, s.total1))
        differ = s.total_sign0 ^ s.total_sign1
        total = carry_chain(m, "total", (ChainBit.CARRY, differ, 0, 0), (ChainBit.ADD, x, y, differ))[1:]
        s = step("sum", total=total, total_sign=s.total_sign0, **{name: getattr(s, name) for name in rest})
        negative = s.total[-1]
        magnitude = carry_chain(m, "magnitude", (ChainBit.CARRY, negative, 0, 0), (
            ChainBit.ADD, Const(0, width), s.total, negative))[1:]
        s = step("magnitude", magnitude=magnitude, negative=zero, sign=s.total_sign ^ negative,
                 **{name: getattr(s, name) for name in rest})
        s = normalise(step, s)
        cancelled = ~(s.sig[-2:] | s.shifted[-2:]).any()
        # The upper place counts 2^(highest + 4), and the highest exponent has twice the bias.
        exp = Signal(range(-(1 << fmt.exp_width + 2), 1 << fmt.exp_width + 2))
        m.d.comb += exp.eq(s.highest + (3 - fmt.bias))
        s = SimpleNamespace(**vars(s) | {
            "exp": exp, "sticky": zero, "zero": s.invalid | ~s.inf & cancelled,
            "sign": Mux(s.inf, s.inf_sign, s.sign & ~cancelled & ~s.invalid)})
        m.d.comb += self.r.eq(round_and_pack(step, m, s, fmt=fmt, rounding=self.rounding))
