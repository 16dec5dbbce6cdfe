"""The chips that the paper's tables are measured with, and what tells one measurement from another."""

import ast
import hashlib
import json
from dataclasses import asdict, dataclass, replace
from functools import cache
from pathlib import Path

from rtl.config import ChipConfig
from rtl.program.features import SWITCHES, ShaderFeatures

__all__ = ["CHIPS", "SHADINGS", "BenchChip", "chip_digest"]

_ROOT = Path(__file__).parents[1]


@dataclass(frozen=True, kw_only=True)
class BenchChip:
    """A chip with its memories.

    Parameters
    ----------
    name : str
    config : ChipConfig
    latency : int
        Cycles from a request to the first word of a line.
    memory : str
        What that stands for.
    about : str
        What the chip is.
    """

    name: str
    config: ChipConfig
    latency: int
    memory: str
    about: str


_SRAM = "then a word a cycle: 32-bit SRAM, a bank a memory, as the paper's"
#: Edges that give are not the paper's.
_PAPER = ChipConfig(edge_tolerance=0)
#: Textures and no more: no light, no ray but the primary ones.
_TEXTURES = ShaderFeatures(**{**dict.fromkeys(SWITCHES, False), "textures": True, "directional_lights": True}, depth=0)

#: Of the tables, by name.
CHIPS = {chip.name: chip for chip in (
    BenchChip(name="paper", config=_PAPER, latency=4, memory=_SRAM, about="the paper's prototype, one pipeline"),
    BenchChip(
        name="ulx3s_85f", latency=20,
        config=replace(_PAPER, num_pipelines=2, num_threads=32, node_lines=512, list_lines=512, list_line_items=2,
                       matrix_lines=512),
        memory="then a word a cycle of every memory, whatever the others do; it stands for SDRAM",
        about="as much as fits an LFE5U-85F"),
)}
#: What each shading adds to a chip.
SHADINGS = {
    "simple": lambda config: config,
    "textured": lambda config: replace(config, shader=_TEXTURES, num_shaders=4),
}


@cache
def _sources():
    """Digest of all that the simulated chip is made of: the modules that it imports, and its bench."""
    found, waiting = {}, [_ROOT / "rtl" / "dynrtc.py"]
    while waiting:
        path = waiting.pop()
        if path in found or not path.exists():
            continue
        found[path] = path.read_bytes()
        waiting += _imported(path)
    code = hashlib.sha256(b"".join((_ROOT / "sim" / "machine" / name).read_bytes()
                                   for name in ("bench.cpp", "bench.h", "common.h")))
    for path in sorted(found):
        code.update(path.name.encode() + found[path])
    return code.hexdigest()


def _imported(path):
    """Files of this project that a file imports."""
    files = []
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.ImportFrom):
            folder = path.parents[node.level - 1] if node.level else _ROOT
            base = folder.joinpath(*(node.module or "").split("."))
            files += [base.with_suffix(".py"), base / "__init__.py", *(base / f"{name.name}.py" for name in node.names)]
    return files


def chip_digest(config, *, latency):
    """Of a simulated chip and its memories: what was measured on another is measured anew."""
    about = json.dumps([asdict(config), latency, _sources()], default=str, sort_keys=True)
    return hashlib.sha256(about.encode()).hexdigest()[:16]
