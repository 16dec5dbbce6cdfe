"""How far an operator's results are from the exact ones, in units in the last place, by its bit-exact emulation."""

import inspect
import math
from dataclasses import dataclass
from functools import lru_cache

import numba
import numpy as np
from numba.np.unsafe.ndarray import to_fixed_tuple

__all__ = ["UlpError", "measure_error"]

_COUNT = 1 << 20


@dataclass(frozen=True)
class UlpError:
    """Largest and mean |error| in units in the last place of the exact result, and of how many results."""

    max: float
    mean: float
    samples: int


@lru_cache
def _compiled(emulation, exact, arity):
    exact = numba.njit(error_model="numpy")(exact)

    @numba.njit(error_model="numpy")
    def sweep(params, constants, operands):
        drop, min_normal, max_finite = params
        worst, total, count = 0.0, 0.0, 0
        for index in range(len(operands)):
            row = to_fixed_tuple(operands[index], arity)
            wanted = exact(*row)
            if min_normal <= abs(wanted) <= max_finite:
                _, exponent = math.frexp(wanted)
                error = math.ldexp(abs(emulation(params, *constants, *row) - wanted), 53 - drop - exponent)
                worst = max(worst, error)
                total += error
                count += 1
        return worst, total, count

    return sweep


def _floats(fmt, exp, frac, rng):
    sign = rng.integers(0, 2, exp.shape)
    return fmt.decode(sign << fmt.width - 1 | np.clip(exp, 1, fmt.exp_inf - 1) << fmt.frac_width | frac)


def _structured(fmt, arity, rng):
    """Exponents equal, near, as far apart as alignment reaches, opposite; runs of ones; near cancellation."""
    shape = _COUNT, arity
    mask = (1 << fmt.frac_width) - 1
    first = rng.integers(1, fmt.exp_inf, (_COUNT, 1))
    exp = np.choose(rng.integers(0, 5, shape), [
        first, first + rng.integers(-2, 3, shape), first + rng.integers(-fmt.frac_width - 3, fmt.frac_width + 4, shape),
        2 * fmt.bias - first + rng.integers(-2, 3, shape), rng.integers(1, fmt.exp_inf, shape)])
    exp[:, 0] = first[:, 0]
    runs = mask >> rng.integers(0, fmt.frac_width + 1, shape) << rng.integers(0, fmt.frac_width + 1, shape) & mask
    frac = np.choose(rng.integers(0, 3, shape), [rng.integers(0, mask + 1, shape), runs, mask - runs])
    operands = _floats(fmt, exp, frac, rng)
    if arity > 1:
        close = rng.integers(0, 8, _COUNT) == 0
        near = operands[:, -2] * (1 + rng.integers(-3, 4, _COUNT) * 2.0 ** -fmt.frac_width)
        operands[:, -1] = np.where(close, np.clip(fmt.quantize(-near), -fmt.max, fmt.max), operands[:, -1])
    return operands


def _uniform(fmt, arity, rng):
    """Uniform significands, exponents up to two from 1's."""
    shape = _COUNT, arity
    return _floats(fmt, fmt.bias + rng.integers(-2, 3, shape), rng.integers(0, 1 << fmt.frac_width, shape), rng)


def _all_significands(fmt, odd):
    return fmt.decode((fmt.bias + odd << fmt.frac_width) + np.arange(1 << fmt.frac_width))[:, np.newaxis]


def measure_error(entry, fmt, *, rounding):
    """Error of an operator's results, or None if its :class:`~tools.fpu_operators.Entry` has no exact ones.

    The largest is over about 2²⁰ structured and as many random operands, the mean over the random ones; of a function
    of one operand, both are over all significands with an even and with an odd exponent, of an integer over all of
    up to 2²⁴, in addition to the structured ones. Results outside the format's normal range are left out. Exact is
    float64, whose unit is at least 2²⁹ times smaller.

    Parameters
    ----------
    entry : Entry
        What.
    fmt : FloatFormat
        In which format.
    rounding : Rounding
        Rounded how.
    """
    if entry.exact is None:
        return None
    emulation = entry.operator.emulation[rounding]
    arity = len(inspect.signature(entry.exact).parameters)
    sweep = _compiled(emulation, entry.exact, arity)
    constants = entry.constants(fmt)
    rng = np.random.default_rng(1)
    if entry.int_width is not None:
        special = []
        mean_over = [np.arange(-1 << entry.int_width - 1, 1 << entry.int_width - 1, dtype=np.float64)[:, np.newaxis]]
    else:
        special = [_structured(fmt, arity, rng)]
        mean_over = [_uniform(fmt, arity, rng)] if arity > 1 else (_all_significands(fmt, odd) for odd in (0, 1))
    worst, samples, total, averaged = 0.0, 0, 0.0, 0
    for operands in special:
        worst, _, samples = sweep(fmt.params, constants, operands)
    for operands in mean_over:
        largest, added, count = sweep(fmt.params, constants, operands)
        worst, total, averaged = max(worst, largest), total + added, averaged + count
    return UlpError(worst, total / averaged if averaged else 0.0, samples + averaged)
