"""Floating-point operations on arrays of bit patterns, in exact integers of 64 bits, after the specification.

The same functions as in :mod:`tests.fpu.reference`, for millions of operands; formats up to 8.23.
"""

import numpy as np

__all__ = ["add", "divide", "dot_product", "maximum", "minimum", "multiply", "order", "reciprocal",
           "reciprocal_square_root", "square_root", "subtract"]


class _Floats:
    """Fields of bit patterns: magnitude = sig * 2^scale, of zeros 0."""

    def __init__(self, bits, exp_width, frac_width):
        bits = np.asarray(bits, np.int64)
        exp = bits >> frac_width & (1 << exp_width) - 1
        self.sign = bits >> exp_width + frac_width & 1
        self.zero = exp == 0
        self.inf = exp == (1 << exp_width) - 1
        self.sig = np.where(self.zero, 0, bits & (1 << frac_width) - 1 | 1 << frac_width)
        self.scale = exp - (1 << exp_width - 1) + 1 - frac_width


def _bit_length(x):
    length = (x > 0).astype(np.int64)
    for places in (32, 16, 8, 4, 2, 1):
        above = x >> places > 0
        x = np.where(above, x >> places, x)
        length += np.where(above, places, 0)
    return length


def _pack(sign, units, rest, scale, exp_width, frac_width, truncate):
    """Bit patterns of units * 2^scale, with a ``rest`` of less than a unit more, rounded once; not for zero."""
    drop = _bit_length(units) - frac_width - 1
    # Where bits are missing there must be no rest.
    assert not (rest & (drop < 2)).any()
    kept = np.where(drop > 0, units >> np.maximum(drop, 0), units << np.maximum(-drop, 0))
    if not truncate:
        half = np.where(drop > 0, units >> np.maximum(drop - 1, 0) & 1, 0) == 1
        below = rest | (units & (1 << np.maximum(drop - 1, 0)) - 1 != 0)
        kept += half & (below | (kept & 1 == 1))
    carry = kept >> frac_width + 1
    exp = scale + drop + frac_width + (1 << exp_width - 1) - 1 + carry
    exp_inf = (1 << exp_width) - 1
    frac = kept >> carry & (1 << frac_width) - 1
    magnitude = np.where(exp <= 0, 0, np.where(exp >= exp_inf, exp_inf << frac_width, exp << frac_width | frac))
    return sign << exp_width + frac_width | magnitude


def _special(result, exp_width, frac_width, *, zero=False, infinite=False, invalid=False, sign=0):
    """``result`` but for what has no bits to round."""
    sign_bit = sign << exp_width + frac_width
    result = np.where(infinite, sign_bit | (1 << exp_width) - 1 << frac_width, result)
    return np.where(invalid, 0, np.where(zero, sign_bit, result))


def add(a, b, *fmt, truncate=False):
    a, b = _Floats(a, *fmt), _Floats(b, *fmt)
    swap = b.scale > a.scale
    far = np.minimum(abs(a.scale - b.scale), 62)
    big, small = ((-1) ** x.sign * x.sig << 32 for x in (a, b))
    big, small = np.where(swap, small, big), np.where(swap, big, small)
    # Rounded down, so that what is lost is to be added whatever the signs are.
    total = big + (small >> far)
    lost = small & (1 << far) - 1 != 0
    negative = total < 0
    units = np.where(negative, -total - lost, total)
    scale = np.maximum(a.scale, b.scale) - 32
    result = _pack(negative.astype(np.int64), units, lost, scale, *fmt, truncate)
    both_negative = a.sign & b.sign & a.zero & b.zero
    result = _special(result, *fmt, zero=units == 0, sign=both_negative)
    return _special(result, *fmt, infinite=a.inf | b.inf, sign=np.where(a.inf, a.sign, b.sign),
                    invalid=a.inf & b.inf & (a.sign != b.sign))


def subtract(a, b, *fmt, truncate=False):
    return add(a, np.asarray(b, np.int64) ^ 1 << sum(fmt), *fmt, truncate=truncate)


def multiply(a, b, *fmt, truncate=False):
    a, b = _Floats(a, *fmt), _Floats(b, *fmt)
    sign, zero, infinite = a.sign ^ b.sign, a.zero | b.zero, a.inf | b.inf
    units = a.sig * b.sig
    result = _pack(sign, units, np.zeros(units.shape, bool), a.scale + b.scale, *fmt, truncate)
    return _special(result, *fmt, zero=zero, infinite=infinite, invalid=zero & infinite, sign=sign)


def divide(a, b, *fmt, truncate=False):
    a, b = _Floats(a, *fmt), _Floats(b, *fmt)
    sign, zero, infinite = a.sign ^ b.sign, a.zero | b.inf, a.inf | b.zero
    places = fmt[1] + 4
    units, rest = np.divmod(a.sig << places, np.maximum(b.sig, 1))
    result = _pack(sign, units, (rest != 0) & ~zero, a.scale - b.scale - places, *fmt, truncate)
    return _special(result, *fmt, zero=zero, infinite=infinite, invalid=zero & infinite, sign=sign)


def order(a, b, *fmt):
    """Bit 0, 1 or 2 for less, equal or greater."""
    places = sum(fmt)
    a, b = (np.asarray(bits, np.int64) for bits in (a, b))
    x, y = (np.where(bits >> fmt[1] & (1 << fmt[0]) - 1 == 0, 0, bits & (1 << places) - 1) * (-1) ** (bits >> places)
            for bits in (a, b))
    return np.where(x < y, 1, np.where(x == y, 2, 4))


def minimum(a, b, *fmt, truncate=False):
    return np.where(order(a, b, *fmt) == 1, a, b)


def maximum(a, b, *fmt, truncate=False):
    return np.where(order(a, b, *fmt) == 4, a, b)


def reciprocal(a, *fmt, truncate=False):
    return divide(np.full_like(a, (1 << fmt[0] - 1) - 1 << fmt[1]), a, *fmt, truncate=truncate)


def _even(a, places):
    """Significand and half the scale of numbers whose significand has been given at least ``places`` more bits."""
    odd = a.scale - places & 1
    return np.maximum(a.sig << places + odd, 1), (a.scale - places - odd) >> 1


def square_root(a, *fmt, truncate=False):
    a = _Floats(a, *fmt)
    radicand, scale = _even(a, fmt[1] + 5)
    units = np.sqrt(radicand.astype(np.float64)).astype(np.int64)
    units -= units * units > radicand
    units += (units + 1) * (units + 1) <= radicand
    result = _pack(a.sign, units, (units * units != radicand) & ~a.zero, scale, *fmt, truncate)
    return _special(result, *fmt, zero=a.zero, infinite=a.inf, invalid=(a.sign == 1) & ~a.zero, sign=a.sign)


def reciprocal_square_root(a, *fmt, truncate=False):
    a = _Floats(a, *fmt)
    radicand, scale = _even(a, 0)
    places = fmt[1] + (fmt[1] + 1) // 2 + 5
    units = (2.0 ** places / np.sqrt(radicand.astype(np.float64))).astype(np.int64)

    def rest_of(units):
        # So small that its lowest 64 bits tell it.
        with np.errstate(over="ignore"):
            return np.int64(4 ** places if places < 32 else 0) - units * units * radicand

    units -= rest_of(units) < 0
    units += rest_of(units + 1) >= 0
    rest = rest_of(units)
    assert ((rest >= 0) & (rest_of(units + 1) < 0)).all()
    result = _pack(a.sign, units, (rest != 0) & ~a.zero, -places - scale, *fmt, truncate)
    return _special(result, *fmt, zero=a.inf, infinite=a.zero, invalid=(a.sign == 1) & ~a.zero, sign=a.sign)


def dot_product(a, b, c, *fmt, window=None, truncate=False):
    """Σ a[i] * b[i] + c over rows ``a[i]`` and ``b[i]``, rounded once, in Python's integers.

    0 * ∞ is a term +0; of infinities of both signs it is +0, and an exact zero is +0. With a ``window`` each term is
    cut towards zero so many bits below the place of the highest exponent of a term that is not zero.
    """
    a, b, c = ([_Floats(bits, *fmt) for bits in rows] for rows in (a, b, [c]))
    # Of the last place of the smallest product
    lowest = -(1 << fmt[0]) - 2 * fmt[1]
    negative, positive = (np.zeros(c[0].sign.shape, bool) for _ in range(2))
    terms, exps = [], []
    for x, y in [*zip(a, b, strict=True), (*c, None)]:
        sign, sig, scale, infinite, zero = x.sign, x.sig.astype(object), x.scale, x.inf, x.zero
        if y is not None:
            zero, infinite = zero | y.zero, infinite | y.inf
            sign, sig, scale = sign ^ y.sign, sig * y.sig, scale + y.scale
        infinite &= ~zero
        negative |= infinite & (sign == 1)
        positive |= infinite & (sign == 0)
        terms.append((sign, np.where(zero, 0, sig) << (scale - lowest).astype(object)))
        exps.append(np.where(zero, 0, scale - lowest + fmt[1] * (1 if y is None else 2)))
    cut = 0 if window is None else np.maximum(np.max(exps, axis=0) - window, 0).astype(object)
    total = sum((-1) ** sign * (magnitude >> cut << cut) for sign, magnitude in terms)
    magnitude = abs(total)
    drop = np.array([max(value.bit_length() - 48, 0) for value in magnitude])
    units = magnitude >> drop.astype(object)
    rest = (units << drop.astype(object) != magnitude).astype(bool)
    result = _pack((total < 0).astype(np.int64), units.astype(np.int64), rest, lowest + drop, *fmt, truncate)
    result = _special(result, *fmt, zero=(total == 0).astype(bool))
    return _special(result, *fmt, infinite=negative | positive, sign=negative.astype(np.int64),
                    invalid=negative & positive)
