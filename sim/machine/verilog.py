"""A component as Verilog, each of its members a port."""

import re

from amaranth.back import verilog
from amaranth.hdl import ClockDomain, Const, Fragment, ValueCastable
from amaranth.hdl._ir import PortDirection
from amaranth.lib import wiring

__all__ = ["component_verilog"]

_INITIAL = re.compile(r"^  initial begin\n.*?^  end\n", re.MULTILINE | re.DOTALL)
_CONSTANT = re.compile(r"^  always @\*\n(?=    \S+ = \d+'h[0-9a-f]+;\n)", re.MULTILINE)
_ZERO = re.compile(r"^ +\S+ ?\[\d+\] = \d+'h0+;\n", re.MULTILINE)


def component_verilog(component, *, name, domains=()):
    """Verilog text of ``component`` as module ``name``; a member a.b becomes the port a_b.

    Of more ``domains`` than one the names must be given, in which order their clocks and resets become ports: else it
    would be another one each time.

    Unlike :func:`amaranth.back.verilog.convert` by itself, this takes streams that are always ready: their
    ``ready`` is a constant and becomes no port.
    """
    ports = {}
    for path, member, value in component.signature.flatten(component):
        if isinstance(value, ValueCastable):
            value = value.as_value()
        if not isinstance(value, Const):
            direction = PortDirection.Input if member.flow == wiring.In else PortDirection.Output
            ports["_".join(map(str, path))] = (value, direction)
    if domains:
        component = Fragment.get(component, None)
        clocks = [ClockDomain(domain) for domain in domains]
        component.add_domains(*clocks)
        ports |= {signal.name: (signal, PortDirection.Input) for clock in clocks for signal in (clock.clk, clock.rst)}
    text = verilog.convert(component, name=name, ports=ports, emit_src=False, strip_internal_attrs=True)
    # What has nothing to wait for is never executed: constant fields of signals that are assigned piece by piece.
    text = _CONSTANT.sub("  initial\n", text)
    # A simulator's memories are zero anyhow, and a line for each word is most of what would have to be compiled.
    return _INITIAL.sub(lambda block: _ZERO.sub("", block[0]), text)
