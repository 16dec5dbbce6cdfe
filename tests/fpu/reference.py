"""Floating-point operations on bit patterns, in exact fractions, after the specification of the formats."""

from fractions import Fraction
from math import copysign, inf, isinf, isqrt

__all__ = ["add", "divide", "maximum", "minimum", "multiply", "order", "pack", "reciprocal",
           "reciprocal_square_root", "square_root", "subtract", "to_int", "unpack"]


def unpack(bits, exp_width, frac_width):
    """(sign, magnitude) of a bit pattern: magnitude is a Fraction, or inf."""
    frac = bits % 2 ** frac_width
    exp = bits // 2 ** frac_width % 2 ** exp_width
    sign = bits // 2 ** (frac_width + exp_width)
    if exp == 0:
        return sign, Fraction(0)
    if exp == 2 ** exp_width - 1:
        return sign, inf
    return sign, (1 + Fraction(frac, 2 ** frac_width)) * Fraction(2) ** (exp - 2 ** (exp_width - 1) + 1)


def pack(sign, magnitude, exp_width, frac_width, truncate=False):
    """Bit pattern of an exact magnitude, rounded once."""
    exp_max = 2 ** exp_width - 1
    sign_bit = sign * 2 ** (exp_width + frac_width)
    infinity = sign_bit + exp_max * 2 ** frac_width
    if isinf(magnitude):
        return infinity
    if magnitude == 0:
        return sign_bit
    scale = magnitude.numerator.bit_length() - magnitude.denominator.bit_length()
    if magnitude < Fraction(2) ** scale:
        scale -= 1
    units, rest = divmod(magnitude * Fraction(2) ** (frac_width - scale), 1)
    if not truncate and (rest > Fraction(1, 2) or (rest == Fraction(1, 2) and units % 2 == 1)):
        units += 1
    if units == 2 ** (frac_width + 1):
        units //= 2
        scale += 1
    exp = scale + 2 ** (exp_width - 1) - 1
    if exp >= exp_max:
        return infinity
    if exp <= 0:
        return sign_bit
    return sign_bit + exp * 2 ** frac_width + int(units) - 2 ** frac_width


def add(a, b, *fmt, truncate=False):
    (sign_a, a), (sign_b, b) = unpack(a, *fmt), unpack(b, *fmt)
    if isinf(a) and isinf(b):
        return pack(sign_a, inf, *fmt) if sign_a == sign_b else 0
    if isinf(a) or isinf(b):
        return pack(sign_a if isinf(a) else sign_b, inf, *fmt)
    total = (-1) ** sign_a * a + (-1) ** sign_b * b
    if total == 0:
        return pack(int(sign_a and sign_b and a == b == 0), 0, *fmt)
    return pack(int(total < 0), abs(total), *fmt, truncate=truncate)


def subtract(a, b, *fmt, truncate=False):
    return add(a, b ^ 1 << sum(fmt), *fmt, truncate=truncate)


def multiply(a, b, *fmt, truncate=False):
    (sign_a, a), (sign_b, b) = unpack(a, *fmt), unpack(b, *fmt)
    if isinf(a) or isinf(b):
        return 0 if a == 0 or b == 0 else pack(sign_a ^ sign_b, inf, *fmt)
    return pack(sign_a ^ sign_b, a * b, *fmt, truncate=truncate)


def divide(a, b, *fmt, truncate=False):
    (sign_a, a), (sign_b, b) = unpack(a, *fmt), unpack(b, *fmt)
    if (isinf(a) and isinf(b)) or a == b == 0:
        return 0
    if isinf(a) or b == 0:
        return pack(sign_a ^ sign_b, inf, *fmt)
    if isinf(b):
        return pack(sign_a ^ sign_b, 0, *fmt)
    return pack(sign_a ^ sign_b, a / b, *fmt, truncate=truncate)


def _root(radicand, frac_width):
    """√radicand to more places than any rounding looks at, and one more if that is not exact."""
    scale = 2 ** (frac_width + 60)
    root = isqrt(radicand.numerator * radicand.denominator * scale ** 2)
    exact = root ** 2 == radicand.numerator * radicand.denominator * scale ** 2
    return Fraction(2 * root + (not exact), 2 * scale * radicand.denominator)


def square_root(a, exp_width, frac_width, truncate=False):
    sign, a = unpack(a, exp_width, frac_width)
    if sign or a == 0:
        return pack(sign if a == 0 else 0, 0, exp_width, frac_width)
    if isinf(a):
        return pack(0, inf, exp_width, frac_width)
    return pack(0, _root(a, frac_width), exp_width, frac_width, truncate=truncate)


def reciprocal(a, exp_width, frac_width, truncate=False):
    sign, a = unpack(a, exp_width, frac_width)
    if isinf(a) or a == 0:
        return pack(sign, 0 if isinf(a) else inf, exp_width, frac_width)
    return pack(sign, 1 / a, exp_width, frac_width, truncate=truncate)


def reciprocal_square_root(a, exp_width, frac_width, truncate=False):
    sign, a = unpack(a, exp_width, frac_width)
    if a == 0:
        return pack(sign, inf, exp_width, frac_width)
    if sign or isinf(a):
        return 0
    return pack(0, _root(1 / a, frac_width), exp_width, frac_width, truncate=truncate)


def order(a, b, *fmt):
    """Bit 0, 1 or 2 for less, equal or greater."""
    a, b = ((-1) ** sign * magnitude for sign, magnitude in (unpack(a, *fmt), unpack(b, *fmt)))
    return 1 if a < b else 2 if a == b else 4


def to_int(a, lowest, highest, exp_width, frac_width, num_frac_bits=0):
    sign, magnitude = unpack(a, exp_width, frac_width)
    value = copysign(inf, -sign) if isinf(magnitude) else (-1) ** sign * int(magnitude * Fraction(2) ** num_frac_bits)
    return int(min(max(value, lowest), highest))


def minimum(a, b, *fmt, truncate=False):
    return a if order(a, b, *fmt) == 1 else b


def maximum(a, b, *fmt, truncate=False):
    return a if order(a, b, *fmt) == 4 else b
