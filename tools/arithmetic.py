"""``dynrt arithmetic``: what fused dot products, reciprocals, tables and truncation do to a chip and its pictures."""

import os
from concurrent.futures import ThreadPoolExecutor

import click
from rich.console import Console

from boards import ecp5
from boards.toolchain import versions
from fpu import FloatFormat
from rtl.arithmetic import ARITHMETICS
from rtl.config import ChipConfig
from rtl.intersection import unit_triangle
from rtl.transformation import affine_map
from rtl.traversal import kd_step
from sim.golden import psnr, render_golden
from sim.model import render_model
from sim.scene.compile import CompiledScene

from .errors import clear_errors
from .options import docs_option, scenes_option
from .page import check_places, filled_page, markdown_table
from .real_scenes import real_scenes
from .results import json_text, write_texts

__all__ = ["arithmetic"]

SIZE = 512, 384
GRADE = 6
FORMAT = FloatFormat(7, 16)
#: Datapaths and the arithmetics in which what they are built of differs; what truncation saves is each operator's.
DATAPATHS = {"transformation": (affine_map, ("separate", "fused", "fused-narrow")),
             "kd-step": (kd_step, ("separate", "reciprocal", "table")),
             "intersection": (unit_triangle, ("separate", "table"))}


def _pictures(scenes, console):
    """Rows of scene and arithmetic: how far the model's picture is from golden, and what it takes to draw."""
    rows, pixels = [], SIZE[0] * SIZE[1]
    for name, scene, camera in real_scenes(scenes):
        golden = render_golden(scene, camera, *SIZE)
        image = CompiledScene(scene, fmt=FORMAT).image(scene, eye=camera.eye)
        for number, arithmetic in enumerate(ARITHMETICS):
            frame = render_model(image, camera, *SIZE, config=ChipConfig(
                fmt=FORMAT, arithmetic=number, edge_tolerance=0))
            counts = frame.report["counts"]
            rows.append({"scene": name, "arithmetic": arithmetic.name,
                         "wrong_pixels": int(frame.differs_in_surface(golden).sum()),
                         "psnr_db": round(psnr(frame.color, golden.color), 2),
                         **{f"{count}_per_ray": round(counts[count] / pixels, 3)
                            for count in ("steps", "triangle_tests")}})
        console.print(f"{name}: {len(ARITHMETICS)} arithmetics", soft_wrap=True)
    return rows


def _areas(seeds, jobs, console):
    """Rows of datapath and arithmetic: what it takes alone, at the operators' default depths."""
    designs = {}
    ways = {arithmetic.name: arithmetic for arithmetic in ARITHMETICS}
    for name, (datapath, different) in DATAPATHS.items():
        for way in different:
            component = datapath(FORMAT, arithmetic=ways[way]).component()
            designs[name, way] = component.latency, ecp5.design_of(component, name=f"{name}, {way}")

    def place(design):
        placements = [ecp5.place(design, grade=GRADE, seed=seed) for seed in range(1, seeds + 1)]
        console.print(f"{design.name}: placed", soft_wrap=True)
        first, slowest = placements[0], min(placement.fmax_mhz for placement in placements)
        return {"lut": first.lut, "ff": first.ff, "dsp": first.dsp, "ebr": first.ebr,
                "fmax_worst_mhz": round(slowest, 1)}

    with ThreadPoolExecutor(jobs) as pool:
        figures = pool.map(place, (design for _, design in designs.values()))
        return [{"datapath": name, "arithmetic": way, "latency": latency, **found}
                for ((name, way), (latency, _)), found in zip(designs.items(), figures, strict=True)]


def _page(results):
    names = [arithmetic.name for arithmetic in ARITHMETICS]
    scenes = list(dict.fromkeys(row["scene"] for row in results["pictures"]))
    pictures = {(row["scene"], row["arithmetic"]): row for row in results["pictures"]}
    tables = [markdown_table(
        ["scene: wrong pixels, PSNR", *names],
        [[scene, *(f"{pictures[scene, name]['wrong_pixels']:,}, {pictures[scene, name]['psnr_db']:.1f} dB"
                   for name in names)] for scene in scenes])]
    rows = [[*(row[name] for name in ("datapath", "arithmetic", "latency", "lut", "ff", "dsp", "ebr")),
             f"{row['fmax_worst_mhz']:.0f}"] for row in results["datapaths"]]
    tables.append(markdown_table(
        ["datapath", "arithmetic", "latency", "LUT", "FF", "DSP", "EBR", "MHz, worst"], rows))
    return "\n".join(tables)


_PARTS = {"arithmetic": _page}


@click.command()
@scenes_option
@docs_option("Where fpu.md is, and results/arithmetic.json goes")
@click.option("--seeds", type=click.IntRange(1), default=3, show_default=True, help="Placements of each datapath")
@click.option("--jobs", type=click.IntRange(1), default=os.cpu_count() or 1, show_default=True,
              help="Runs of place and route at a time")
def arithmetic(scenes, docs, seeds, jobs):
    """Draw scenes and place datapaths in each arithmetic that a chip can have, and fill its table in docs/fpu.md."""
    console = Console(stderr=True, highlight=False)
    page = docs / "fpu.md"
    with clear_errors():
        # Before the long work
        check_places(page, _PARTS)
        results = {"format": str(FORMAT), "size": list(SIZE), "grade": GRADE, "seeds": list(range(1, seeds + 1)),
                   "tools": versions(), "pictures": _pictures(scenes, console),
                   "datapaths": _areas(seeds, jobs, console)}
        (docs / "results").mkdir(exist_ok=True)
        write_texts({docs / "results" / "arithmetic.json": json_text(results),
                     page: filled_page(page, _PARTS, results)})
