"""The operators that are characterised, and what each would compute without rounding."""

import inspect
import math
from dataclasses import dataclass, field

import fpu
from fpu import Rounding

__all__ = ["OPERATORS", "Entry"]


@dataclass(frozen=True, kw_only=True, eq=False)
class Entry:
    """An operator to characterise.

    Parameters
    ----------
    operator : type
        Its class, to be called with a format, ``latency`` and, if it takes one, ``rounding``; with an ``emulation`` by
        rounding.
    exact : callable or None
        Result without rounding, of the emulation's operands as float64; what numba compiles. None where an error in
        units in the last place means nothing.
    parameters : dict
        More keyword arguments for the class.
    int_width : int or None
        Width of the operand, if that is an integer.
    constants : callable
        Of a format, what the emulation takes between its parameters and the operands.
    """

    operator: type
    exact: object = None
    parameters: dict = field(default_factory=dict)
    int_width: int | None = None
    constants: object = lambda fmt: ()

    @property
    def name(self):
        return self.operator.__name__

    @property
    def roundings(self):
        """Ways of rounding it can be built with; nearest even alone if it does not round."""
        takes = "rounding" in inspect.signature(self.operator).parameters
        return list(Rounding) if takes else [Rounding.NEAREST_EVEN]

    def build(self, fmt, *, latency=None, rounding=Rounding.NEAREST_EVEN):
        """New component.

        Raises
        ------
        ValueError
            If there is none for the format.
        """
        rounded = {"rounding": rounding} if len(self.roundings) > 1 else {}
        return self.operator(fmt, latency=latency, **rounded, **self.parameters)

    def default_latency(self, fmt):
        """Latency that the class chooses for a format.

        Raises
        ------
        ValueError
            If there is none for the format.
        """
        return self.build(fmt).latency


def _dot(ax, ay, az, bx, by, bz, c):
    # Knuth's two-sum: what float64 loses of each sum is added at the end.
    total, lost = c, 0.0
    for product in (ax * bx, ay * by, az * bz):
        both = total + product
        part = both - total
        lost += (total - (both - part)) + (product - part)
        total = both
    return total + lost


_INT = {"int_width": 24}

# A subtractor is an adder but for one sign, a maximum a minimum.
OPERATORS = {entry.name: entry for entry in (
    Entry(operator=fpu.Adder, exact=lambda a, b: a + b),
    Entry(operator=fpu.Multiplier, exact=lambda a, b: a * b),
    Entry(operator=fpu.Divider, exact=lambda a, b: a / b),
    Entry(operator=fpu.Comparator),
    Entry(operator=fpu.TableDivider, exact=lambda a, b: a / b),
    Entry(operator=fpu.Reciprocal, exact=lambda a: 1 / a),
    Entry(operator=fpu.SquareRoot, exact=lambda a: math.sqrt(a)),
    Entry(operator=fpu.ReciprocalSquareRoot, exact=lambda a: 1 / math.sqrt(a)),
    Entry(operator=fpu.DigitReciprocalSquareRoot, exact=lambda a: 1 / math.sqrt(a)),
    Entry(operator=fpu.DotProduct, exact=_dot, constants=lambda fmt: (-1,)),
    Entry(operator=fpu.Minimum, exact=lambda a, b: min(a, b)),
    Entry(operator=fpu.IntToFloat, exact=lambda i: i, parameters=_INT, **_INT),
    Entry(operator=fpu.FloatToInt, parameters=_INT),
)}
