"""Adder, multiplier and divider are their specification in integers, for all operands of a tiny format."""

import pytest
from amaranth.hdl import Assert, Assume, Cat, Const, Module, Mux, Signal

from fpu import Adder, Divider, FloatFormat, Multiplier, Rounding, Subtractor
from tests.formal.prove import Refuted, prove

TINY = FloatFormat(3, 2)
FORMATS = [TINY, pytest.param(FloatFormat(4, 4), marks=pytest.mark.slow)]


def integer(m, number, fmt):
    """Magnitude in units of the last place of the smallest normal; any number where it is infinite."""
    magnitude = Signal(fmt.exp_inf + fmt.frac_width)
    with m.Switch(number.exp):
        for exp in range(1, fmt.exp_inf):
            with m.Case(exp):
                m.d.comb += magnitude.eq(Cat(number.frac, Const(1, 1)) << exp - 1)
    return magnitude


def rounded(m, magnitude, sticky, *, unit_exp, fmt, rounding):
    """Bits but the sign of ``magnitude``, and a little more where ``sticky``, in units of stored exponent ``unit_exp``.

    By cases: where the leading one stands says which exponent it is.
    """
    result = Signal(fmt.width - 1)
    for place in range(len(magnitude)):
        exp, dropped = unit_exp + place, max(place - fmt.frac_width, 0)
        kept = (magnitude >> dropped << max(fmt.frac_width - place, 0))[:fmt.frac_width]
        half = magnitude[max(dropped - 1, 0):dropped].any()
        rest = magnitude[:max(dropped - 1, 0)].any() | sticky
        up = half & (rest | kept[0]) if rounding is Rounding.NEAREST_EVEN else 0
        frac = Signal(fmt.frac_width + 1, name=f"frac{place}")
        m.d.comb += frac.eq(kept + up)
        carry = frac[-1]
        with m.If(magnitude[place] & ~magnitude[place + 1:].any()):
            with m.If(Mux(carry, exp + 1 >= fmt.exp_inf, exp >= fmt.exp_inf)):
                m.d.comb += result.eq(fmt.exp_inf << fmt.frac_width)
            with m.Elif(Mux(carry, exp + 1 > 0, exp > 0)):
                m.d.comb += result.eq(Cat(frac[:-1], Const(max(exp, 0), fmt.exp_width) + carry))
    return result


def packed(sign, magnitude, fmt):
    return magnitude | (Const(0, 1) | sign) << fmt.width - 1


def total(m, a, b, fmt, rounding):
    x, y = (Mux(number.sign, -integer(m, number, fmt), integer(m, number, fmt)) for number in (a, b))
    exact = x + y
    magnitude = Signal(len(exact))
    m.d.comb += magnitude.eq(abs(exact))
    finite = rounded(m, magnitude, 0, unit_exp=1 - fmt.frac_width, fmt=fmt, rounding=rounding)
    infinity = fmt.exp_inf << fmt.frac_width
    both_negative_zero = a.sign & b.sign & (a.exp == 0) & (b.exp == 0)
    return Mux(a.exp.all() & b.exp.all() & (a.sign != b.sign), 0, Mux(
        a.exp.all(), packed(a.sign, infinity, fmt), Mux(
            b.exp.all(), packed(b.sign, infinity, fmt), Mux(
                exact == 0, packed(both_negative_zero, 0, fmt), packed(exact < 0, finite, fmt)))))


def difference(m, a, b, fmt, rounding):
    return total(m, a, fmt(Cat(b.frac, b.exp, ~b.sign)), fmt, rounding)


def scaled(a, b, finite, *, zero, infinite, fmt):
    infinity = fmt.exp_inf << fmt.frac_width
    return Mux(zero & infinite, 0, packed(a.sign ^ b.sign, Mux(infinite, infinity, Mux(zero, 0, finite)), fmt))


def product(m, a, b, fmt, rounding):
    exact = Signal(2 * (fmt.exp_inf + fmt.frac_width))
    m.d.comb += exact.eq(integer(m, a, fmt) * integer(m, b, fmt))
    finite = rounded(m, exact, 0, unit_exp=2 - fmt.bias - 2 * fmt.frac_width, fmt=fmt, rounding=rounding)
    return scaled(a, b, finite, zero=(a.exp == 0) | (b.exp == 0), infinite=a.exp.all() | b.exp.all(), fmt=fmt)


def quotient(m, a, b, fmt, rounding):
    # Places down to two below the last of the smallest normal
    places = fmt.bias + fmt.frac_width + 1
    dividend, divisor = integer(m, a, fmt) << places, integer(m, b, fmt)
    whole = Signal(len(dividend))
    m.d.comb += whole.eq(dividend // divisor)
    finite = rounded(m, whole, dividend % divisor != 0, unit_exp=fmt.bias - places, fmt=fmt, rounding=rounding)
    return scaled(a, b, finite, zero=(a.exp == 0) | b.exp.all(), infinite=a.exp.all() | (b.exp == 0), fmt=fmt)


SPECIFIED = {Adder: total, Subtractor: difference, Multiplier: product, Divider: quotient}


def claim(cls, fmt, rounding, *, wrong=0):
    """That an operator without registers gives what is specified, but for the bits ``wrong``."""
    m = Module()
    ports = [Signal(fmt.width, name=name) for name in "ab"]
    a, b = (fmt(port) for port in ports)
    m.submodules.operator = operator = cls(fmt, latency=0, rounding=rounding)
    specified = Signal(fmt.width)
    m.d.comb += [operator.a.eq(a), operator.b.eq(b), specified.eq(SPECIFIED[cls](m, a, b, fmt, rounding)),
                 Assert(operator.r.as_value() == specified ^ wrong)]
    # Infinity has one pattern of each sign.
    m.d.comb += [Assume(~number.exp.all() | (number.frac == 0)) for number in (a, b)]
    return m, ports


@pytest.mark.parametrize("rounding", Rounding)
@pytest.mark.parametrize("cls", SPECIFIED)
@pytest.mark.parametrize("fmt", FORMATS, ids=str)
def test_is_its_specification(fmt, cls, rounding, tmp_path):
    module, ports = claim(cls, fmt, rounding)
    prove(module, ports=ports, cycles=1, by_induction=True, folder=tmp_path)


def test_a_wrong_claim_is_refuted(tmp_path):
    module, ports = claim(Adder, TINY, Rounding.NEAREST_EVEN, wrong=1)
    with pytest.raises(Refuted, match="model found"):
        prove(module, ports=ports, cycles=1, by_induction=True, folder=tmp_path)
