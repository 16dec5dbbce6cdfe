"""Operators that others wrote, in Verilog, to be measured by the same flow."""

import json
from dataclasses import dataclass
from pathlib import Path

from amaranth.hdl import ClockSignal, Instance, Module, Signal, Value
from amaranth.lib import wiring
from amaranth.lib.wiring import In, Out

from boards import ecp5
from fpu import FloatFormat

from .errors import BadInput
from .fpu_operators import OPERATORS

__all__ = ["Peer", "load_peers"]


@dataclass(frozen=True, kw_only=True)
class Peer:
    """An operator that others wrote; the fields are those of an element of ``peers`` in a peer file.

    Parameters
    ----------
    name, source, note : str
        What it is, where it comes from with its version, and what must be known to compare it.
    operator : str
        Class of the operator to be compared with.
    format : FloatFormat
        In which format.
    files : dict from str to str
        Verilog by file name; in the peer file a list of paths from its folder.
    top : str
        Verilog module.
    inputs, outputs : dict from str to int
        Widths of its ports, but for the clock.
    clock : str or None
        Its clock, if it has one.
    latency : int
        Its registers; ``"default"`` in the peer file are as many as the operator to be compared with has.
    retime : bool
        Whether synthesis is to bring the registers in, the module having none.
    cycles_per_result : int
        Clocks between two results.
    """

    name: str
    source: str
    operator: str
    format: FloatFormat
    files: dict
    top: str
    inputs: dict
    outputs: dict
    clock: str | None = None
    latency: int = 0
    retime: bool = False
    cycles_per_result: int = 1
    note: str = ""

    @property
    def title(self):
        """Name for messages."""
        return f"{self.name} {self.format}, latency {self.latency}"

    @property
    def beside_latency(self):
        """Latency of ours to compare it with: the same, or the default of one that gives no result every clock."""
        return self.latency if self.cycles_per_result == 1 else None

    def design(self):
        """What :func:`boards.ecp5.place` takes."""
        return ecp5.design_of(_Component(self), name=self.title, verilog=self.files,
                              synthesis=ecp5.RETIMING if self.retime else ecp5.SYNTHESIS)


class _Component(wiring.Component):
    def __init__(self, peer):
        self.peer = peer
        self.latency = peer.latency
        self.fixed_output = peer.retime and peer.latency > 0
        super().__init__({name: In(width) for name, width in peer.inputs.items()} |
                         {name: Out(width) for name, width in peer.outputs.items()})

    def elaborate(self, platform):
        m = Module()
        ports = {f"i_{name}": getattr(self, name) for name in self.peer.inputs}
        for name, width in self.peer.outputs.items():
            value = ports[f"o_{name}"] = Signal(width)
            for _ in range(self.latency - 1 if self.fixed_output else 0):
                following = Signal(width, reset_less=True)
                m.d.sync += following.eq(value)
                value = following
            m.d.comb += Value.cast(getattr(self, name)).eq(value)
        if self.peer.clock:
            ports[f"i_{self.peer.clock}"] = ClockSignal()
        m.submodules.peer = Instance(self.peer.top, **ports)
        return m


def _widths(value):
    return isinstance(value, dict) and bool(value) and all(isinstance(width, int) and width > 0
                                                           for width in value.values())


#: Whether a field of the file is what it must be, and what that is.
_FIELDS = {
    "name": (lambda value: isinstance(value, str), "a text"),
    "source": (lambda value: isinstance(value, str), "a text"),
    "note": (lambda value: isinstance(value, str), "a text"),
    "operator": (lambda value: value in OPERATORS, f"one of {', '.join(OPERATORS)}"),
    "format": (lambda value: isinstance(value, str), "a text like \"7.16\""),
    "files": (lambda value: isinstance(value, list) and value and all(isinstance(path, str) for path in value),
              "a list of paths"),
    "top": (lambda value: isinstance(value, str), "a text"),
    "inputs": (_widths, "an object with the width of each port"),
    "outputs": (_widths, "an object with the width of each port"),
    "clock": (lambda value: value is None or isinstance(value, str), "a text"),
    "latency": (lambda value: value == "default" or (isinstance(value, int) and value >= 0),
                "a number of cycles or \"default\""),
    "retime": (lambda value: isinstance(value, bool), "true or false"),
    "cycles_per_result": (lambda value: isinstance(value, int) and value > 0, "a number of cycles"),
}
_REQUIRED = ("name", "source", "operator", "format", "files", "top", "inputs", "outputs")


def load_peers(path):
    """Peers of a peer file: JSON with a list ``peers``.

    Raises
    ------
    BadInput
        If the file, or one that it names, cannot be read or used.
    """
    path = Path(path)
    try:
        elements = json.loads(path.read_text())["peers"]
    except (OSError, ValueError, KeyError, TypeError) as error:
        raise BadInput(f"{path}: is not a JSON file with an object that has a list 'peers' ({error})") from error
    return [_peer(path, index, element) for index, element in enumerate(elements)]


def _peer(path, index, element):
    place = f"{path}: peers[{index}]"
    if not isinstance(element, dict):
        raise BadInput(f"{place}: must be an object")
    if missing := [name for name in _REQUIRED if name not in element]:
        raise BadInput(f"{place}: lacks {', '.join(missing)}")
    for name, value in element.items():
        if name not in _FIELDS:
            raise BadInput(f"{place}: {name!r} is not a field of a peer; there are {', '.join(_FIELDS)}")
        is_good, wanted = _FIELDS[name]
        if not is_good(value):
            raise BadInput(f"{place}: {name} must be {wanted}, not {value!r}")
    try:
        fmt = FloatFormat.parse(element["format"])
        default = OPERATORS[element["operator"]].default_latency(fmt)
    except ValueError as error:
        raise BadInput(f"{place}: format: {error}") from error
    latency = element.get("latency", 0)
    return Peer(**element | {"format": fmt, "latency": default if latency == "default" else latency,
                             "files": _read(place, path.parent, element["files"])})


def _read(place, folder, files):
    texts = {}
    for file in files:
        name = Path(file).name
        if name in texts:
            raise BadInput(f"{place}: files: there are two of the name {name}, which include each other by name")
        try:
            texts[name] = (folder / file).read_text()
        except (OSError, ValueError) as error:
            raise BadInput(f"{place}: files: {file} cannot be read: {error}") from error
    return texts
