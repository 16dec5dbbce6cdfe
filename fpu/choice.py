"""The lesser and the greater of two numbers."""

from types import MappingProxyType

from amaranth.hdl import Mux, Value

from .comparator import Comparator
from .operator import BinaryOperator
from .pipeline import lut_delay
from .rounding import Rounding, emulated

__all__ = ["Maximum", "Minimum", "maximum", "minimum"]


@emulated
def minimum(params, a, b):
    """a if a < b, else b."""
    return a if a < b else b


@emulated
def maximum(params, a, b):
    """a if a > b, else b."""
    return a if a > b else b


class Minimum(BinaryOperator):
    """r = a if a < b, else b: exactly one of them; of equal ones, such as zeros of both signs, b.

    Parameters
    ----------
    fmt : FloatFormat
        Format of operands and result.
    latency : int or None
        See :class:`~fpu.operator.Operator`.

    Members
    -------
    a, b : In(fmt)
        Operands.
    r : Out(fmt)
        The lesser, ``latency`` cycles later.
    """

    emulation = MappingProxyType({Rounding.NEAREST_EVEN: minimum})
    _relation = "lt"

    def __init__(self, fmt, *, latency=None):
        super().__init__(fmt, latency=latency)

    @classmethod
    def _step_delays(cls, fmt):
        return {**Comparator._step_delays(fmt), "choose": lut_delay(2)}

    def _compute(self, m, step):
        a, b = Value.cast(self.a), Value.cast(self.b)
        s = Comparator.compare(m, step, self.a, self.b, kept_a=a, kept_b=b)
        chosen = step("choose", r=Mux(getattr(s, self._relation), s.kept_a, s.kept_b))
        m.d.comb += Value.cast(self.r).eq(chosen.r)


class Maximum(Minimum):
    """r = a if a > b, else b: exactly one of them; of equal ones, such as zeros of both signs, b.

    Parameters
    ----------
    fmt : FloatFormat
        Format of operands and result.
    latency : int or None
        See :class:`~fpu.operator.Operator`.

    Members
    -------
    a, b : In(fmt)
        Operands.
    r : Out(fmt)
        The greater, ``latency`` cycles later.
    """

    emulation = MappingProxyType({Rounding.NEAREST_EVEN: maximum})
    _relation = "gt"
