"""What the operators share: their parameters, their depth, rounding and packing of a result."""

from types import SimpleNamespace

from amaranth.hdl import Cat, Const, Module, Mux
from amaranth.lib import wiring
from amaranth.lib.wiring import In, Out

from .pipeline import Pipeline, carry_delay, depth_for, lut_delay
from .rounding import Rounding

__all__ = ["BinaryOperator", "FloatOperator", "Operator", "is_inf", "is_zero", "normalise", "normalise_delays",
           "round_and_pack", "round_and_pack_delays"]


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
    """Operator on two floats, ``a`` and ``b``, whose delays depend on their format alone."""

    @classmethod
    def default_latency(cls, fmt):
        """Latency in cycles where none is given, for a component that need not be there."""
        return depth_for(cls._step_delays(fmt).values())

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


def normalise_delays(width):
    """Delays of the steps of :func:`normalise` on ``width`` bits."""
    # A tree of tables that looks at 2^level bits, and the one that shifts.
    return {f"normalise_{level}": lut_delay((level + 1) // 2 + 1) for level in range((width - 1).bit_length())[::-1]}


def normalise(step, s):
    """``s`` with ``s.magnitude`` shifted left until its top bit is set, if any is, and with the ``shift`` it took."""
    width = len(s.magnitude)
    s = SimpleNamespace(**vars(s), shift=Const(0, 0))
    for level in range((width - 1).bit_length())[::-1]:
        places = 1 << level
        clear = ~s.magnitude[-places:].any()
        s = step(f"normalise_{level}", s, shift=Cat(clear, s.shift),
                 magnitude=Mux(clear, s.magnitude << places, s.magnitude)[:width])
    return s


def round_and_pack_delays(fmt):
    """Delays of the steps of :func:`round_and_pack`."""
    return {"round": carry_delay(fmt.sig_width + 2), "range": lut_delay(3), "pack": lut_delay(1.5)}


def round_and_pack(step, s, *, fmt, rounding):
    """Float (-1)^sign * 2^(exp - bias) * sig, rounded once, with overflow, underflow and special cases.

    ``s.sig`` is in [1, 4), with ``sig_width`` fraction bits, the last of them the guard bit below 2. ``s.sticky`` says
    that there are nonzero bits below. ``s.exp`` and ``s.exp_carried``, one more, are signed; ``s.zero`` and ``s.inf``,
    never both, override the value.
    """
    above_two = s.sig[-1]
    rounded, tie = s.sig, Const(0)
    if rounding is Rounding.NEAREST_EVEN:
        # Half a unit is injected whichever place it has, without waiting for sticky; a tie that this has brought to
        # an odd fraction was even before, so clearing the last bit mends it.
        rounded = (s.sig + Cat(~above_two, above_two))[:len(s.sig)]
        tie = ~s.sticky & Mux(above_two, s.sig[:2] == 0b10, s.sig[0])
    # Whether rounding carries is not known before the end of the step: both exponents are made.
    s = step("round", sig=rounded, tie=tie, exp=s.exp, exp_carried=s.exp_carried,
             zero=s.zero, inf=s.inf, sign=s.sign)

    above_two = s.sig[-1]
    # Bit by bit, each of whichever exponent makes it cheap: a comparison would become a carry chain.
    under = s.exp[-1] | ~above_two & (s.exp == 0)
    over = ~s.exp_carried[-1] & s.exp_carried[fmt.exp_width:-1].any()
    over |= above_two & (s.exp_carried == fmt.exp_inf)
    s = step("range", sig=s.sig, tie=s.tie, sign=s.sign,
             exp=Mux(above_two, s.exp_carried, s.exp)[:fmt.exp_width],
             zero=s.zero | ~s.inf & under, inf=s.inf | ~s.zero & over)

    above_two = s.sig[-1]
    frac = Mux(above_two, Cat(s.sig[2] & ~s.tie, s.sig[3:-1]), Cat(s.sig[1] & ~s.tie, s.sig[2:-2]))
    exp = Mux(s.inf, fmt.exp_inf, Mux(s.zero, 0, s.exp))
    return step("pack", r=Cat(Mux(s.inf | s.zero, 0, frac), exp, s.sign)).r
