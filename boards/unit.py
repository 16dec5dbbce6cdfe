"""Units of a chip, each alone between registers, as it is built there."""

import re
from functools import cached_property

from amaranth.back import rtlil
from amaranth.hdl import ClockSignal, Const, Instance, Module, ResetSignal, Value
from amaranth.lib import wiring
from amaranth.lib.wiring import In, Out

from .chip import DEVICE, WITHOUT_CHECKS, Unobserved
from .design import Design
from .harness import between_registers

__all__ = ["Units"]

_MODULE = re.compile(r"^(?:attribute [^\n]*\n)*module \\(?P<path>\S+)\n.*?^end$", re.MULTILINE | re.DOTALL)
_PORT = re.compile(r"^  wire width (?P<width>\d+) (?P<flow>input|output) \d+ +(?:signed )?\\(?P<name>\S+)$",
                   re.MULTILINE)
_FLOWS = {"input": In, "output": Out}
_CLOCKING = {"clk": ClockSignal, "rst": ResetSignal}


class _Unit(wiring.Component):
    """A module of which the text is known, in the domain ``sync``; not all names of its ports are Python's."""

    #: Not all its outputs come from registers.
    latency = 0

    def __init__(self, path, ports):
        self._path = path
        self._clocking = [name for name, _, _ in ports if name in _CLOCKING]
        self._ports = {f"port{number}": (name, flow, width) for number, (name, flow, width) in enumerate(ports)
                       if name not in _CLOCKING}
        super().__init__({member: _FLOWS[flow](width) for member, (_, flow, width) in self._ports.items()})

    def elaborate(self, platform):
        m = Module()
        m.submodules.unit = Instance(
            self._path, **{f"i_{name}": _CLOCKING[name]() for name in self._clocking},
            **{f"{flow[0]}_{name}": getattr(self, member) for member, (name, flow, _) in self._ports.items()})
        return m


class Units:
    """Units of a chip by their paths, such as ``chip.pipeline0.traversal``.

    Parameters
    ----------
    chip : Component
        Usually a :class:`~rtl.dynrtc.DynRTC`; of one clock.
    """

    def __init__(self, chip):
        self._chip = Unobserved(chip)

    @cached_property
    def _modules(self):
        values = (Value.cast(value) for _, _, value in self._chip.signature.flatten(self._chip))
        text = rtlil.convert(self._chip, ports=[value for value in values if not isinstance(value, Const)], name="unit",
                             emit_src=False)
        return {match["path"]: match[0] for match in _MODULE.finditer(text)}

    @property
    def paths(self):
        """All of them."""
        return [path.removeprefix("unit.") for path in self._modules if path != "unit"]

    def design(self, path, *, device=DEVICE):
        """A unit with all that is in it, between registers.

        Raises
        ------
        KeyError
            If there is no such unit.
        """
        full = f"unit.{path}"
        module = self._modules[full]
        ports = [(port["name"], port["flow"], int(port["width"])) for port in _PORT.finditer(module)]
        m, harness = between_registers(_Unit(full, ports))
        text = rtlil.convert(m, ports=harness, name="top", emit_src=False)
        inside = [other for name, other in self._modules.items() if name == full or name.startswith(f"{full}.")]
        return Design(name=path, files={"unit.il": "\n".join(inside), "top.il": text}, device=device,
                      script=f"read_rtlil unit.il; read_rtlil top.il; {WITHOUT_CHECKS}")
