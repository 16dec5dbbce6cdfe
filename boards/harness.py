"""A component alone between registers, so that all its paths are from register to register."""

import re

from amaranth.hdl import ClockSignal, Const, Instance, Module, Signal, Value
from amaranth.lib.wiring import In

__all__ = ["between_registers", "is_of_harness"]


def is_of_harness(name):
    """Whether a flip-flop of this name is not the component's own."""
    # Yosys names cells after their neighbours, but by adding to the end.
    return re.fullmatch(r"harness\[\w+\]", name) is not None


def _register(m, owner, name, value):
    """``value`` a cycle later, by flip-flops that no tool moves into logic, merges or copies."""
    registered = Signal(len(value), name=f"{owner}_{name}")
    for bit in range(len(value)):
        m.submodules[f"{owner}[{name}_{bit}]"] = Instance(
            "TRELLIS_FF", p_GSR="DISABLED", p_CEMUX="1", p_CLKMUX="CLK", p_LSRMUX="LSR", p_REGSET="RESET",
            i_CLK=ClockSignal(), i_DI=value[bit], o_Q=registered[bit])
    return registered


def between_registers(component):
    """The component with registers before its inputs, and behind its outputs if it has none there itself.

    Parameters
    ----------
    component : Component
        With a ``latency``; only if that is zero, registers are put behind its outputs. A component whose last
        registers are to stay where they are, whatever synthesis moves, has an attribute ``fixed_output``; then one of
        its ``latency`` registers is put behind it here, and counts as its own.

    Returns
    -------
    m : Module
        In which :func:`is_of_harness` tells the flip-flops that are not the component's.
    ports : list of Signal
        Its ports but the clock.
    """
    m = Module()
    m.submodules.component = component
    ports = []
    fixed = getattr(component, "fixed_output", False)
    for path, member, member_value in component.signature.flatten(component):
        name = "_".join(map(str, path))
        value = Value.cast(member_value)
        # A stream that is always ready has a constant in place of ready.
        if not len(value) or isinstance(value, Const):
            continue
        if member.flow is In:
            port = Signal(len(value), name=name)
            m.d.comb += value.eq(_register(m, "harness", name, port))
        else:
            port = Signal(len(value), name=name)
            if component.latency == 0 or fixed:
                value = _register(m, "last" if component.latency else "harness", name, value)
            m.d.comb += port.eq(value)
        ports.append(port)
    return m, ports
