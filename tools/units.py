"""``dynrt units``: what each unit of a chip takes, and how fast it is, alone."""

import re
from dataclasses import asdict

import click
from rich.console import Console

from boards.catalog import BOARDS
from boards.chip import DEVICE
from boards.ecp5 import critical_path, place
from boards.packing import pack
from boards.toolchain import versions
from boards.unit import Units
from rtl.dynrtc import DynRTC

from .board_options import board_chip, chip_option
from .engines import progress_on
from .errors import BadInput, clear_errors
from .options import docs_option
from .page import check_places, filled_page, markdown_table
from .results import code_version, earlier_results, json_text, write_texts

__all__ = ["units"]

#: The slowest grade, as boards have it.
_GRADE = 6
#: The first pipeline's units; of a shader its own, as they are larger than others'.
_UNIT = re.compile(r"chip\.pipeline0\.(?P<name>shader\.shader0\.\w+|(?!shader\.)\w+|shader\.(?!shader)\w+)")
_PLUMBING = re.compile(r"_(queue|merge|results|tag|registers)$|^shader$|^shader\.merge$")
#: What a netlist depends on.
_CODE = ("fpu/**/*.py", "rtl/**/*.py", "boards/**/*.py")


def _table(results):
    return markdown_table(
        ("unit alone", "LUT", "FF", "DSP", "EBR", "MHz, worst seed", "of seeds", "slowest path"),
        [(row["unit"], f"{row['lut']:,}", f"{row['ff']:,}", row["dsp"], row["ebr"], f"{row['mhz']:.1f}",
          ", ".join(f"{mhz:.1f}" for mhz in row["seeds"]), row["path"]) for row in results.get("rows", [])])


_PARTS = {"alone": _table}


def _named(every):
    """Paths of units by the names that are shown."""
    found = {match["name"]: path for path in every if (match := _UNIT.fullmatch(path))}
    return {name.replace("shader.shader0.", "shader."): path for name, path in found.items()
            if not _PLUMBING.search(name)}


def _row(name, design, seeds):
    runs = [(place(design, grade=_GRADE, seed=seed).fmax_mhz, seed) for seed in range(1, seeds + 1)]
    worst, seed = min(runs)
    path = critical_path(design, grade=_GRADE, seed=seed)
    return {"unit": name, **asdict(pack(design)), "mhz": round(worst, 1), "seeds": [round(mhz, 1) for mhz, _ in runs],
            "path": path.words, "through": path.through}


@click.command()
@click.argument("names", nargs=-1, metavar="[UNIT]...")
@chip_option
@click.option("--seeds", type=click.IntRange(1), default=1, show_default=True, help="Placements of each")
@docs_option("Where board.md is, and results/units.json goes")
def units(names, parameters, seeds, docs):
    """Place and route units of a chip, by default all of an 85F's full one, each alone between registers.

    The slowest of them bounds the chip's clock from above. What has been measured with the same code is kept.
    """
    console = Console(stderr=True, highlight=False)
    config = board_chip(BOARDS["ulx3s_85f"], parameters)
    page, path = docs / "board.md", docs / "results" / "units.json"
    with clear_errors():
        check_places(page, _PARTS)
        built = Units(DynRTC(config))
        known = _named(built.paths)
        for name in names:
            if name not in known:
                raise BadInput(f"{name}: no such unit; there are {', '.join(known)}")
        version = code_version(*_CODE, what=(repr(config), seeds))
        earlier = earlier_results(path)
        rows = {row["unit"]: row for row in earlier.get("rows", []) if row["version"] == version}
        chosen = [name for name in names or known if name not in rows]
        with progress_on(console, "units") as progress:
            for name in chosen:
                progress(name)
                rows[name] = {**_row(name, built.design(known[name]), seeds), "version": version}
                console.print(f"{name}: {rows[name]['mhz']} MHz, {rows[name]['path']}", markup=False, soft_wrap=True)
                results = {"device": DEVICE.name, "grade": _GRADE, "config": repr(config), "tools": versions(),
                           "rows": sorted(rows.values(), key=lambda row: row["mhz"])}
                # Kept after each: all take half an hour.
                write_texts({path: json_text(results), page: filled_page(page, _PARTS, results)})
