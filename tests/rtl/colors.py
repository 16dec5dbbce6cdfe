"""Colours of bytes and bytes of colours after IEC 61966-2-1, to 40 decimal places."""

from decimal import Decimal, localcontext
from fractions import Fraction

__all__ = ["byte_fraction", "encoded_byte", "linear_color"]


def _power(base, numerator, denominator):
    with localcontext(prec=40):
        return base ** (Decimal(numerator) / denominator)


def _decimal(fraction):
    with localcontext(prec=40):
        return Decimal(fraction.numerator) / fraction.denominator


def linear_color(byte):
    """Colour of an encoded byte, in units of 2^-16."""
    encoded = Fraction(byte, 255)
    if encoded <= Fraction("0.04045"):
        return round(65536 * encoded / Fraction("12.92"))
    return round(65536 * _power(_decimal((encoded + Fraction("0.055")) / Fraction("1.055")), 12, 5))


def byte_fraction(byte):
    """byte/255 in units of 2^-16."""
    return round(Fraction(65536 * byte, 255))


def encoded_byte(color):
    """Byte of a colour, a number, in units of 2^-16; at most 255."""
    linear = min(Fraction(color) / 65536, Fraction(1))
    if linear <= Fraction("0.0031308"):
        return round(255 * Fraction("12.92") * linear)
    return round(255 * (Fraction("1.055") * Fraction(_power(_decimal(linear), 5, 12)) - Fraction("0.055")))
