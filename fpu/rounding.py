"""Rounding: how results are fitted to a format, in software."""

import math

import numba
import numpy as np
from amaranth.lib import enum

__all__ = ["Rounding", "emulated", "round_nearest", "round_truncate"]


class Rounding(enum.Enum):
    """Which of the two neighbouring values of a format a result becomes."""

    #: The nearest, of two equally near the one with an even fraction.
    NEAREST_EVEN = "nearest-even"
    #: The one towards zero; overflow still gives infinity.
    TRUNCATE = "truncate"


#: Compiles a scalar emulation. Division by zero follows IEEE 754 instead of raising.
emulated = numba.njit(error_model="numpy")


@emulated
def _fit(params, x):
    _, min_normal, max_finite = params
    if math.isnan(x):
        return 0.0
    if abs(x) > max_finite:
        return math.copysign(math.inf, x)
    if abs(x) < min_normal:
        return math.copysign(0.0, x)
    return x


@emulated
def round_nearest(params, x):
    """Value of the format ``params`` nearest to the float64 ``x``, ties to even; NaN gives +0.

    If ``x`` is a sum, difference, product or quotient of members that was itself rounded to float64, the result is
    that of rounding once: float64's 53 bits are at least 2 * sig_width + 2 (Figueroa 1995).
    """
    drop = params[0]
    bits = np.float64(x).view(np.int64)
    # The carry out of the fraction is the increment of the exponent; infinity stays, its fraction being zero.
    bits = (bits + ((np.int64(1) << (drop - 1)) - 1 + ((bits >> drop) & 1))) & -(np.int64(1) << drop)
    return _fit(params, x if math.isnan(x) else np.int64(bits).view(np.float64))


@emulated
def round_truncate(params, x):
    """Value of the format ``params`` nearest to ``x`` towards zero; NaN gives +0."""
    bits = np.float64(x).view(np.int64) & -(np.int64(1) << params[0])
    return _fit(params, x if math.isnan(x) else np.int64(bits).view(np.float64))
