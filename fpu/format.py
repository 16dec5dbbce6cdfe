"""Floating-point formats without subnormals and NaN."""

import re
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from amaranth.hdl import Format, ShapeCastable
from amaranth.lib import data

__all__ = ["FloatFormat"]


@dataclass(frozen=True)
class FloatFormat(ShapeCastable):
    """Shape of a floating-point number, value = (-1)^sign * 2^(exp - bias) * (1 + frac / 2^frac_width).

    A stored exponent of zero is zero, whatever the fraction, and one of all ones is infinity, both with their sign.
    There are no subnormals and no NaN. All that makes numbers gives zeros and infinities a fraction of 0, and
    comparators take it for granted of infinities.

    A signal of this shape is a :class:`amaranth.lib.data.View` with the fields ``frac``, ``exp``, ``sign``, from
    the least significant bit up; its initial value and its value in a testbench are Python floats.

    Software carries the format's values as float64. Both limits below keep that exact: an operation on members,
    rounded to float64 and then to the format, equals the operation rounded once when 53 >= 2 * sig_width + 2
    (S. A. Figueroa, "When is double rounding innocuous?", SIGNUM 1995), and no operation leaves float64's range.

    Parameters
    ----------
    exp_width : int
        Bits of the exponent, 2 to 8.
    frac_width : int
        Bits of the fraction as stored, without the hidden bit, 1 to 23.

    Raises
    ------
    ValueError
        If a width is outside its limits.
    """

    exp_width: int
    frac_width: int

    def __post_init__(self):
        if not 2 <= self.exp_width <= 8:
            raise ValueError(f"Exponent width must be between 2 and 8 bits, not {self.exp_width!r}")
        if not 1 <= self.frac_width <= 23:
            raise ValueError(f"Fraction width must be between 1 and 23 bits, not {self.frac_width!r}")

    @classmethod
    def parse(cls, text):
        """Format written as exponent width, a dot, fraction width: ``FloatFormat.parse("7.16")``.

        Raises
        ------
        ValueError
            If the text is not of this form, or a width is outside its limits.
        """
        match = re.fullmatch(r"(\d+)\.(\d+)", text.strip(), re.ASCII)
        if match is None:
            raise ValueError(f"Float format must be written EXPONENT.FRACTION in bits, like 7.16, not {text!r}")
        return cls(*map(int, match.groups()))

    def __str__(self):
        return f"{self.exp_width}.{self.frac_width}"

    @property
    def width(self):
        """Bits of a number."""
        return 1 + self.exp_width + self.frac_width

    @property
    def sig_width(self):
        """Bits of the significand, with the hidden bit."""
        return self.frac_width + 1

    @property
    def bias(self):
        """Stored exponent of 1.0."""
        return 2 ** (self.exp_width - 1) - 1

    @property
    def exp_inf(self):
        """Stored exponent of infinity."""
        return 2 ** self.exp_width - 1

    @property
    def max(self):
        """Largest finite value."""
        return (2 - 2.0 ** -self.frac_width) * 2.0 ** (self.exp_inf - 1 - self.bias)

    @property
    def min_normal(self):
        """Smallest positive value."""
        return 2.0 ** (1 - self.bias)

    @cached_property
    def params(self):
        """What the operators' emulation takes: fraction bits dropped from a float64, smallest and largest value."""
        return (52 - self.frac_width, self.min_normal, self.max)

    def quantize(self, x):
        """Nearest values of the format as float64, ties to even; below the smallest normal zero, beyond the largest ∞.

        Raises
        ------
        ValueError
            If there is a NaN.
        """
        x = np.asarray(x, dtype=np.float64)
        if np.isnan(x).any():
            raise ValueError(f"NaN cannot be represented in float format {self}")
        drop = 52 - self.frac_width
        bits = np.ascontiguousarray(x).view(np.int64).reshape(x.shape)
        bits = bits + ((1 << (drop - 1)) - 1 + (bits >> drop & 1)) & -(1 << drop)
        rounded = bits.view(np.float64)
        rounded = np.where(np.abs(rounded) > self.max, np.copysign(np.inf, x), rounded)
        return np.where(np.abs(rounded) < self.min_normal, np.copysign(0.0, x), rounded)

    def encode(self, x):
        """Bit patterns (int64) of the values nearest to ``x``, rounded as by :meth:`quantize`."""
        x = self.quantize(x)
        sig, exp = np.frexp(np.where(np.isfinite(x), np.abs(x), 0.0))
        frac = np.ldexp(sig, self.sig_width).astype(np.int64) & (1 << self.frac_width) - 1
        exp = np.where(sig == 0, 0, exp - 1 + self.bias)
        exp = np.where(np.isinf(x), self.exp_inf, exp).astype(np.int64)
        return np.signbit(x).astype(np.int64) << self.width - 1 | exp << self.frac_width | frac

    def decode(self, bits):
        """Values (float64) of bit patterns."""
        bits = np.asarray(bits).astype(np.int64)
        frac = bits & (1 << self.frac_width) - 1
        exp = bits >> self.frac_width & self.exp_inf
        magnitude = np.ldexp((frac | 1 << self.frac_width).astype(np.float64), exp - self.bias - self.frac_width)
        magnitude = np.where(exp == 0, 0.0, np.where(exp == self.exp_inf, np.inf, magnitude))
        return np.where(bits >> self.width - 1 & 1, -magnitude, magnitude)

    # What Amaranth asks of a shape.

    def as_shape(self):
        return data.StructLayout({"frac": self.frac_width, "exp": self.exp_width, "sign": 1})

    def __call__(self, value):
        return data.View(self, value)

    def const(self, init):
        return data.Const(self.as_shape(), int(self.encode(0.0 if init is None else init)))

    def from_bits(self, raw):
        return float(self.decode(raw))

    def format(self, value, format_spec):
        return Format.Struct(value.as_value(), {
            name: Format(f"{{:{format_spec}}}", getattr(value, name)) for name in ("sign", "exp", "frac")})
