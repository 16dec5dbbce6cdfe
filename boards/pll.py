"""The clocks of a board out of its oscillator's, by a PLL of an ECP5."""

from dataclasses import dataclass
from itertools import product

from amaranth.hdl import ClockSignal, Instance, Module, ResetSignal, Signal
from amaranth.lib import wiring
from amaranth.lib.cdc import AsyncFFSynchronizer, ResetSynchronizer
from amaranth.lib.wiring import In, Out

__all__ = ["Clock", "Pll", "PllPlan", "plan_pll"]

#: Lattice, *ECP5 and ECP5-5G Family Data Sheet* (FPGA-DS-02012), sysCLOCK PLL timing; MHz.
_INPUT, _COMPARED, _OSCILLATOR, _OUTPUT = (8, 400), (10, 400), (400, 800), (3.125, 400)
_MAX_INPUT_DIVIDER, _MAX_FEEDBACK_DIVIDER, _MAX_OUTPUT_DIVIDER = 128, 80, 128
#: Of EHXPLLL; a fourth, CLKOS3, is what goes back inside of it to be compared.
_OUTPUTS = ("CLKOP", "CLKOS", "CLKOS2")
#: Of the clock that is asked for
_TOLERANCE = 0.008


@dataclass(frozen=True, kw_only=True)
class Clock:
    """A clock domain.

    Parameters
    ----------
    domain : str
        Its name.
    mhz : float
        Frequency, within 0.8 %.
    lag_ns : float
        By how much it is later than the first of its PLL.
    reset : bool
        Whether the domain has a reset, until the PLL has locked.
    global_reset : bool
        Whether the reset goes by one of the device's global networks: for flip-flops all over it, at clocks that
        leave it the time to get to the device's middle first.
    """

    domain: str
    mhz: float
    lag_ns: float = 0
    reset: bool = True
    global_reset: bool = False


@dataclass(frozen=True, kw_only=True)
class PllPlan:
    """What makes some clocks of one.

    Attributes
    ----------
    input_divider, feedback_divider, feedback_output : int
        The oscillator's clock is the input's · ``feedback_divider`` · ``feedback_output`` / ``input_divider``.
    dividers, phases : tuple of int
        Of the oscillator, for each clock, and by how many of its periods each is late.
    oscillator_mhz : float
        Clock of the oscillator.
    mhz : tuple of float
        The clocks as they are.
    """

    input_divider: int
    feedback_divider: int
    feedback_output: int
    dividers: tuple
    phases: tuple
    oscillator_mhz: float
    mhz: tuple


def _within(value, limits):
    return limits[0] <= value <= limits[1]


def plan_pll(input_mhz, clocks):
    """The plan by which the clocks are nearest to what is asked for, with the fastest oscillator among such.

    Parameters
    ----------
    input_mhz : float
        The oscillator on the board.
    clocks : list of Clock
        Up to three.

    Raises
    ------
    ValueError
        If there is none.
    """
    if not _within(input_mhz, _INPUT):
        raise ValueError(f"an input of {input_mhz:g} MHz; a PLL takes {_INPUT[0]} to {_INPUT[1]}")
    if not 1 <= len(clocks) <= len(_OUTPUTS):
        raise ValueError(f"{len(clocks)} clocks; a PLL has 1 to {len(_OUTPUTS)}")
    best = None
    for divider, multiple in product(range(1, _MAX_INPUT_DIVIDER + 1), range(1, _OSCILLATOR[1] + 1)):
        oscillator = input_mhz / divider * multiple
        feedback = next((each for each in range(_MAX_FEEDBACK_DIVIDER, 0, -1)
                         if multiple % each == 0 and multiple // each <= _MAX_OUTPUT_DIVIDER), None)
        if feedback is None or not (_within(input_mhz / divider, _COMPARED) and _within(oscillator, _OSCILLATOR)):
            continue
        dividers = tuple(min(max(round(oscillator / clock.mhz), 1), _MAX_OUTPUT_DIVIDER) for clock in clocks)
        found = tuple(oscillator / each for each in dividers)
        error = max(abs(mhz / clock.mhz - 1) for mhz, clock in zip(found, clocks, strict=True))
        if error > _TOLERANCE or not all(_within(mhz, _OUTPUT) for mhz in found):
            continue
        phases = tuple(round(clock.lag_ns * oscillator / 1000) % each
                       for clock, each in zip(clocks, dividers, strict=True))
        rank = round(error, 6), -oscillator
        if best is None or rank < best[0]:
            best = rank, PllPlan(input_divider=divider, feedback_divider=feedback, feedback_output=multiple // feedback,
                                 dividers=dividers, phases=phases, oscillator_mhz=oscillator, mhz=found)
    if best is None:
        wanted = ", ".join(f"{clock.mhz:g}" for clock in clocks)
        raise ValueError(f"no PLL makes {wanted} MHz of {input_mhz:g} within {100 * _TOLERANCE:g} %; ask for others")
    return best[1]


class Pll(wiring.Component):
    """Makes clock domains of an oscillator's clock; resets last until it has locked.

    Parameters
    ----------
    input_mhz, clocks
        See :func:`plan_pll`.

    Attributes
    ----------
    plan : PllPlan

    Members
    -------
    clock : the oscillator's
    locked : the clocks are there; of no clock

    Raises
    ------
    ValueError
        See :func:`plan_pll`.
    """

    def __init__(self, input_mhz, clocks):
        self.plan = plan_pll(input_mhz, clocks)
        self._clocks = clocks
        super().__init__({"clock": In(1), "locked": Out(1)})

    def elaborate(self, platform):
        m = Module()
        plan, parameters, outputs = self.plan, {}, {}
        for output, clock, divider, phase in zip(_OUTPUTS, self._clocks, plan.dividers, plan.phases, strict=False):
            parameters |= {f"p_{output}_ENABLE": "ENABLED", f"p_{output}_DIV": divider,
                           # Of no phase is a divider's last period.
                           f"p_{output}_CPHASE": divider - 1 + phase, f"p_{output}_FPHASE": 0}
            outputs[f"o_{output}"] = ClockSignal(clock.domain)
            if clock.reset and clock.global_reset:
                reset = Signal(name=f"{clock.domain}_reset")
                # The last has a copy, for logic (boards/global_reset.py): what both take over has settled.
                m.submodules[f"{clock.domain}_reset"] = AsyncFFSynchronizer(~self.locked, reset, o_domain=clock.domain,
                                                                            stages=3)
                m.submodules[f"{clock.domain}_reset_buffer"] = Instance("DCCA", i_CLKI=reset,
                                                                        o_CLKO=ResetSignal(clock.domain))
            elif clock.reset:
                m.submodules[f"{clock.domain}_reset"] = ResetSynchronizer(~self.locked, domain=clock.domain)
        m.submodules.pll = Instance(
            "EHXPLLL", a_ICP_CURRENT="12", a_LPF_RESISTOR="8", a_MFG_ENABLE_FILTEROPAMP="1", a_MFG_GMCREF_SEL="2",
            p_CLKI_DIV=plan.input_divider, p_CLKFB_DIV=plan.feedback_divider, p_FEEDBK_PATH="INT_OS3",
            p_CLKOS3_ENABLE="ENABLED", p_CLKOS3_DIV=plan.feedback_output, p_CLKOS3_CPHASE=plan.feedback_output - 1,
            p_CLKOS3_FPHASE=0,
            p_PLLRST_ENA="DISABLED", p_INTFB_WAKE="DISABLED", p_STDBY_ENABLE="DISABLED", p_DPHASE_SOURCE="DISABLED",
            p_OUTDIVIDER_MUXA="DIVA", p_OUTDIVIDER_MUXB="DIVB", p_OUTDIVIDER_MUXC="DIVC", p_OUTDIVIDER_MUXD="DIVD",
            **parameters, i_CLKI=self.clock, i_CLKFB=0, i_RST=0, i_STDBY=0, i_PHASESEL0=0, i_PHASESEL1=0,
            i_PHASEDIR=0, i_PHASESTEP=0, i_PHASELOADREG=0, i_PLLWAKESYNC=0, i_ENCLKOP=0, o_LOCK=self.locked, **outputs)
        return m
