"""Arithmetic of a format from float64, each operation rounded to it, with the format's special cases."""

import math
import struct

import numpy as np

__all__ = ["Rounded", "same"]


class Rounded:
    """Operations on the values of ``fmt``; what would be NaN is +0."""

    def __init__(self, fmt):
        self.fmt = fmt

    def round(self, x):
        return 0.0 if math.isnan(x) else float(self.fmt.quantize(x))

    def add(self, a, b):
        return self.round(a + b)

    def sub(self, a, b):
        return self.round(a - b)

    def mul(self, a, b):
        return self.round(a * b)

    def div(self, a, b):
        with np.errstate(all="ignore"):
            return self.round(float(np.float64(a) / np.float64(b)))

    def any(self, rng):
        """A random finite value, any as likely as another."""
        bits = rng.getrandbits(self.fmt.width)
        value = float(self.fmt.decode(bits))
        return value if math.isfinite(value) else math.copysign(self.fmt.max, value)


def same(a, b):
    """Whether two floats are equal, and so are their signs."""
    return struct.pack("d", a) == struct.pack("d", b)
