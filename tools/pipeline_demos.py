"""The demos of full shading: the chip against its model, the model against golden."""

from dataclasses import replace

import numpy as np
from PIL import Image

from fpu import FloatFormat
from rtl.config import ChipConfig
from sim.golden import psnr, render_golden
from sim.machine import render_rtl
from sim.model import render_full
from sim.scene import load_scene
from sim.scene.compile import CompiledScene

from .errors import written_whole
from .sensitivity import MovedPictures, flip

__all__ = ["DEPTH", "FORMAT", "JITTER", "LATENCY", "NUDGE", "demo_rows", "prepared"]

FORMAT = FloatFormat(7, 16)
#: Formats that the model draws each demo in.
FORMATS = tuple(map(FloatFormat.parse, ("7.12", "7.14", "7.16", "7.18", "7.20", "7.22", "8.23")))
#: From where on a picture is as good as golden's.
MIN_PSNR_DB, MAX_FLIP = 50, 0.01
DEPTH = 4
#: Scenes, the sizes of their pictures, and their cameras.
DEMOS = (("room", (128, 96), 0), ("mirror-room", (128, 96), 0), ("mirror-room", (128, 96), 1), ("walk", (96, 72), 0),
         ("vpl", (32, 24), 0), ("sunflowers", (96, 72), 0))
#: The chip of the demos. A tolerance of edges would hide what a format does to them.
DEMO_CHIP = ChipConfig(fmt=FORMAT, num_shaders=2, edge_tolerance=0)
#: Memory latency of the demos: cycles to a line's first word, and up to so many more at random.
LATENCY, JITTER = 4, 8
#: Levels by which a pixel may differ before it is counted.
_FAR = 8
#: Part of a pixel by which golden's samples are moved, to compare with.
NUDGE = 1 / 256
#: Part of a pixel within which golden may show what is far off.
_REACH = 1 / 64


def prepared(scene, camera, *, fmt=FORMAT):
    """A scene's image with the records of full shading."""
    return CompiledScene(scene, fmt=fmt).image(scene, eye=camera.eye, is_full=True)


def _model(scene, camera, size, fmt):
    image = prepared(scene, camera, fmt=fmt)
    config = replace(DEMO_CHIP, fmt=fmt, shader=replace(image.needs, depth=DEPTH))
    return render_full(image, camera, *size, config=config), image, config


def _accuracy(scene, camera, size, golden):
    """The model in each format against golden."""
    found = {str(fmt): _model(scene, camera, size, fmt)[0].color for fmt in FORMATS}
    return [{"format": fmt, "psnr_db": round(psnr(color, golden), 2), "flip": round(flip(golden, color), 4)}
            for fmt, color in found.items()]


def _wrong_pixels(drawn, model):
    return int((drawn.color != model.color).any(axis=-1).sum())


def _enough(scene, camera, size, formats):
    """The narrowest format in which the picture is as good as golden's, or the widest, drawn by a chip of it."""
    good = next((point for point in formats if point["psnr_db"] >= MIN_PSNR_DB and point["flip"] <= MAX_FLIP),
                formats[-1])
    model, image, config = _model(scene, camera, size, FloatFormat.parse(good["format"]))
    drawn = render_rtl(image, camera, *size, config=config, latency=LATENCY, jitter=JITTER)
    return {**good, "cycles": drawn.report["cycles"], "rtl_wrong_pixels": _wrong_pixels(drawn, model)}


def _demo(name, size, view, pictures, console):
    scene = load_scene(name)
    camera = scene.cameras[view] if scene.cameras else scene.default_camera()
    model, image, config = _model(scene, camera, size, FORMAT)
    drawn = render_rtl(image, camera, *size, config=config, latency=LATENCY, jitter=JITTER)
    golden = render_golden(scene, camera, *size, shading="full", depth=DEPTH)
    moved = MovedPictures(scene, camera, size, depth=DEPTH)
    kinds = model.report["ray_kinds"]
    num_rays = sum(number for kind, number in kinds.items() if kind != "hole")
    far = np.abs(model.color.astype(int) - golden.color).max(axis=-1) > _FAR
    title = name if not view else f"{name}, view {view}"
    for picture, engine in ((drawn, "chip"), (golden, "golden")):
        with written_whole(pictures / f"pipeline-{name}-{view}-{engine}.png") as path:
            Image.fromarray(picture.color).save(path, format="PNG")
    console.print(f"{title}: {drawn.report['cycles']:,} cycles", highlight=False)
    formats = _accuracy(scene, camera, size, golden.color)
    return {
        "demo": title, "size": list(size), "cycles": drawn.report["cycles"], "rays": num_rays, "rays_by_kind": kinds,
        "cycles_per_ray": round(drawn.report["cycles"] / num_rays, 2),
        "instructions_per_pixel": round(model.report["counts"]["instructions"] / (size[0] * size[1]), 1),
        "rtl_wrong_pixels": _wrong_pixels(drawn, model),
        "psnr_db": round(psnr(model.color, golden.color), 2), "flip": round(flip(golden.color, model.color), 4),
        "golden_moved_psnr_db": round(moved.psnr(golden.color, NUDGE), 2),
        "other_surface_pixels": int(model.differs_in_surface(golden).sum()), "far_pixels": int(far.sum()),
        "explained_pixels": int((far & moved.explains(model.color, _REACH, levels=_FAR)).sum()),
        "psnr_near_db": round(psnr(model.color[~far], golden.color[~far]), 2),
        "formats": formats, "enough": _enough(scene, camera, size, formats),
        "busy": {unit: round(part, 3) for unit, part in drawn.report["busy"].items()},
        "hit_rate": {cache: round(events["hits"] / max(sum(events.values()), 1), 3)
                     for cache, events in drawn.report["cache"].items()},
        "bytes": drawn.report["bytes"]}


def demo_rows(pictures, console):
    """Rows of the demos; their pictures go into the folder ``pictures``."""
    return [_demo(*demo, pictures, console) for demo in DEMOS]
