"""What the operators share: their parameters and their depth."""

from amaranth.hdl import Module
from amaranth.lib import wiring
from amaranth.lib.wiring import In, Out

from .pipeline import Pipeline, depth_for
from .rounding import Rounding

__all__ = ["BinaryOperator", "FloatOperator", "Operator", "UnaryOperator", "is_inf", "is_zero"]


def is_zero(x):
    """Whether a float is zero, of either sign."""
    return x.exp == 0


def is_inf(x):
    """Whether a float is infinite, of either sign."""
    return x.exp.all()


class Operator(wiring.Component):
    """Fully pipelined operator: one result a clock, ``latency`` cycles after its operands, nothing to reset.

    Parameters
    ----------
    fmt : FloatFormat
        Format of operands and result.
    latency : int or None
        Registers on the way, from 0 (combinational); more than there are steps follow the result. By default as
        many as 175 MHz on an ECP5 of grade 6 takes.
    rounding : Rounding
        How the result is fitted to the format.
    members : dict
        Ports of the component.

    Attributes
    ----------
    latency : int
        Cycles from operands to result.

    Raises
    ------
    ValueError
        If ``latency`` is negative.
    """

    def __init__(self, fmt, members, *, latency=None, rounding=Rounding.NEAREST_EVEN):
        if latency is not None and latency < 0:
            raise ValueError(f"Latency must not be negative, but is {latency!r}")
        self.fmt = fmt
        self.rounding = Rounding(rounding)
        self.latency = depth_for(self._delays().values()) if latency is None else latency
        super().__init__(members)

    def _delays(self):
        """Delay in ns of each step that :meth:`_compute` ends, by its name."""
        raise NotImplementedError

    def _compute(self, m, step):
        """Drive the results, ending each step by a call of ``step``."""
        raise NotImplementedError

    def elaborate(self, platform):
        m = Module()
        self._compute(m, Pipeline(m, weights=self._delays(), latency=self.latency))
        return m


class FloatOperator(Operator):
    """Operator on floats whose delays depend on their format alone."""

    @classmethod
    def default_latency(cls, fmt, *, stage_delay=None):
        """Latency in cycles where none is given, for a component that need not be there."""
        return depth_for(cls._step_delays(fmt).values(), stage_delay=stage_delay)

    @classmethod
    def _step_delays(cls, fmt):
        """Same as :meth:`_delays`."""
        raise NotImplementedError

    def _delays(self):
        return self._step_delays(self.fmt)


class BinaryOperator(FloatOperator):
    """Operator on two floats, ``a`` and ``b``, with a float result ``r``."""

    #: Compiled emulation by rounding: ``f(fmt.params, a, b)``, exact, on float64 values that are members.
    emulation = None

    def __init__(self, fmt, *, latency=None, rounding=Rounding.NEAREST_EVEN):
        super().__init__(fmt, {"a": In(fmt), "b": In(fmt), "r": Out(fmt)}, latency=latency, rounding=rounding)


class UnaryOperator(FloatOperator):
    """Operator on a float ``a`` with a float result ``r``."""

    #: Compiled emulation by rounding: ``f(fmt.params, a)``, exact, on float64 values that are members.
    emulation = None

    def __init__(self, fmt, *, latency=None, rounding=Rounding.NEAREST_EVEN):
        super().__init__(fmt, {"a": In(fmt), "r": Out(fmt)}, latency=latency, rounding=rounding)
