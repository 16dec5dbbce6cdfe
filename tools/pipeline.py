"""``dynrt pipeline``: full shading on the simulated chip, its cost, and how it scales."""

import json
from dataclasses import replace
from pathlib import Path

import click
import numpy as np
from PIL import Image
from rich.console import Console

from fpu import FloatFormat
from rtl.config import ChipConfig
from sim.golden import psnr, render_golden
from sim.machine import render_rtl
from sim.model import render_full
from sim.scene import load_scene
from sim.scene.compile import CompiledScene

from .costs import cost_tables, measured_luts
from .errors import clear_errors, written_whole
from .pipeline_page import filled

__all__ = ["pipeline"]

FORMAT = FloatFormat(7, 16)
DEPTH = 4
#: Scenes, the sizes of their pictures, and their cameras.
DEMOS = (("room", (128, 96), 0), ("mirror-room", (128, 96), 0), ("mirror-room", (128, 96), 1), ("walk", (96, 72), 0),
         ("vpl", (32, 24), 0), ("sunflowers", (96, 72), 0))
#: The chip of the demos.
DEMO_CHIP = ChipConfig(fmt=FORMAT, num_shaders=2)
#: What the demos' chip is varied in for a lit room: threads, pipelines, shaders, with shadows or without.
SCALING = (*((threads, 1, 2, True) for threads in (1, 4, 16, 32, 64)), *((64, count, 2, True) for count in (2, 3, 4)),
           *((64, 1, count, shadows) for count in (1, 2, 4) for shadows in (True, False)))
SCALING_SIZE = 96, 72
#: Memory latency of the demos: cycles to a line's first word, and up to so many more at random.
LATENCY, JITTER = 4, 8
#: Levels by which a pixel may differ before it is counted.
_NEAR = 8


def _prepared(name, view):
    scene = load_scene(name)
    camera = scene.cameras[view] if scene.cameras else scene.default_camera()
    compiled = CompiledScene(scene, fmt=FORMAT)
    return scene, camera, compiled.image(scene, eye=camera.eye, is_full=True)


def _flip(reference, picture):
    """Mean FLIP error (Andersson et al. 2020) at its default 67 pixels a degree."""
    # Apart from drawing pictures, like all that measuring needs; see pyproject.toml.
    import flip_evaluator

    pictures = (np.float32(pixels) / 255 for pixels in (reference, picture))
    return float(flip_evaluator.evaluate(*pictures, "LDR")[1])


def _demo(name, size, view, pictures, console):
    """Row of a demo: the chip against its model, the model against golden."""
    scene, camera, image = _prepared(name, view)
    config = replace(DEMO_CHIP, shader=replace(image.needs, depth=DEPTH))
    model = render_full(image, camera, *size, config=config)
    drawn = render_rtl(image, camera, *size, config=config, latency=LATENCY, jitter=JITTER)
    golden = render_golden(scene, camera, *size, shading="full", depth=DEPTH)
    kinds = model.report["ray_kinds"]
    num_rays = sum(number for kind, number in kinds.items() if kind != "hole")
    far = np.abs(model.color.astype(int) - golden.color).max(axis=-1) > _NEAR
    title = name if not view else f"{name}, view {view}"
    for picture, engine in ((drawn, "chip"), (golden, "golden")):
        with written_whole(pictures / f"pipeline-{name}-{view}-{engine}.png") as path:
            Image.fromarray(picture.color).save(path, format="PNG")
    console.print(f"{title}: {drawn.report['cycles']:,} cycles", highlight=False)
    return {
        "demo": title, "size": list(size), "cycles": drawn.report["cycles"], "rays": num_rays, "rays_by_kind": kinds,
        "cycles_per_ray": round(drawn.report["cycles"] / num_rays, 2),
        "instructions_per_pixel": round(model.report["counts"]["instructions"] / (size[0] * size[1]), 1),
        "rtl_wrong_pixels": int((drawn.color != model.color).any(axis=-1).sum()),
        "psnr_db": round(psnr(model.color, golden.color), 2), "flip": round(_flip(golden.color, model.color), 4),
        "other_surface_pixels": int(model.differs_in_surface(golden).sum()), "far_pixels": int(far.sum()),
        "psnr_near_db": round(psnr(model.color[~far], golden.color[~far]), 2),
        "busy": {unit: round(part, 3) for unit, part in drawn.report["busy"].items()},
        "hit_rate": {cache: round(events["hits"] / max(sum(events.values()), 1), 3)
                     for cache, events in drawn.report["cache"].items()},
        "bytes": drawn.report["bytes"]}


def _scaling(console):
    """Rows of chips: cycles for the same lit room."""
    _, camera, image = _prepared("room", 0)
    models = {shadows: render_full(image, camera, *SCALING_SIZE, config=_lit(image, shadows=shadows))
              for shadows in (True, False)}
    rows = []
    for threads, pipelines, shaders, shadows in dict.fromkeys(SCALING):
        config = replace(_lit(image, shadows=shadows), num_threads=threads, num_pipelines=pipelines,
                         num_shaders=shaders)
        drawn = render_rtl(image, camera, *SCALING_SIZE, config=config, latency=LATENCY)
        model = models[shadows]
        num_rays = sum(model.report["ray_kinds"].values())
        rows.append({"threads": threads, "pipelines": pipelines, "shaders": shaders, "shadows": shadows,
                     "cycles": drawn.report["cycles"], "rays": num_rays,
                     "rtl_wrong_pixels": int((drawn.color != model.color).any(axis=-1).sum()),
                     "busy": {unit: round(part, 3) for unit, part in drawn.report["busy"].items()}})
        console.print(f"{threads} threads, {pipelines} pipelines, {shaders} shaders"
                      f"{'' if shadows else ', primary rays alone'}: {drawn.report['cycles']:,} cycles",
                      highlight=False)
    return rows


def _lit(image, *, shadows):
    return replace(DEMO_CHIP, shader=replace(image.needs, depth=0, shadows=shadows))


@click.command()
@click.option("--docs", type=click.Path(exists=True, file_okay=False, path_type=Path), default=Path("docs"),
              show_default=True, help="Where pipeline.md is, and results/pipeline.json goes")
@click.option("--only", type=click.Choice(["demos", "scaling", "operators"]), multiple=True,
              help="Measure these parts, keep the others  [default: all]")
def pipeline(docs, only):
    """Draw the demos of full shading on the simulated chip, scale it, and fill the tables of docs/pipeline.md."""
    console = Console(stderr=True)
    page, path = docs / "pipeline.md", docs / "results" / "pipeline.json"
    with clear_errors():
        # Before the long work
        filled(page, {})
        results = json.loads(path.read_text()) if path.exists() and only else {}
        pictures = docs / "pictures"
        for folder in (path.parent, pictures):
            folder.mkdir(exist_ok=True)
        results["chip"] = {"format": str(FORMAT), "depth": DEPTH, "latency": LATENCY, "jitter": JITTER,
                           "scaling_size": list(SCALING_SIZE)}
        if not only or "operators" in only:
            results["operators"] = cost_tables(
                fmt=FORMAT, luts=measured_luts(docs / "results" / "fpu.json", fmt=FORMAT))
        if not only or "demos" in only:
            results["demos"] = [_demo(*demo, pictures, console) for demo in DEMOS]
        if not only or "scaling" in only:
            results["scaling"] = _scaling(console)
        text = filled(page, results)
        for target, content in ((path, json.dumps(results, indent=1) + "\n"), (page, text)):
            with written_whole(target) as whole:
                whole.write_text(content)
