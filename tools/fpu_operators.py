"""The operators that are characterised, and what each would compute without rounding."""

import inspect
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
    """

    operator: type
    exact: object = None
    parameters: dict = field(default_factory=dict)
    int_width: int | None = None

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


_INT = {"int_width": 24}

OPERATORS = {entry.name: entry for entry in (
    Entry(operator=fpu.Adder, exact=lambda a, b: a + b),
    Entry(operator=fpu.Subtractor, exact=lambda a, b: a - b),
    Entry(operator=fpu.Multiplier, exact=lambda a, b: a * b),
    Entry(operator=fpu.Divider, exact=lambda a, b: a / b),
    Entry(operator=fpu.Comparator),
    Entry(operator=fpu.IntToFloat, exact=lambda i: i, parameters=_INT, **_INT),
    Entry(operator=fpu.FloatToInt, parameters=_INT),
)}
