"""Each effect of shading alone: a chip that can do no more, its picture beside golden's."""

import os
from contextlib import contextmanager
from dataclasses import fields, replace

import numpy as np

from rtl.config import ChipConfig
from sim.golden import psnr, render_golden
from sim.machine import render_rtl
from sim.model import render_full
from sim.scene.effects import effect_scenes

from .figure import drawn_figure
from .pipeline_demos import DEPTH, FORMAT, NUDGE, prepared
from .sensitivity import MovedPictures, flip

__all__ = ["effect_rows"]

_SIZE, _JITTER, _COLUMNS = (80, 60), 20, 5
#: Caches that fill up even here.
_CHIP = ChipConfig(fmt=FORMAT, edge_tolerance=0, num_threads=16, shading_lines=16, texture_lines=32, node_lines=64,
                   list_lines=32, matrix_lines=32)
_OPTIMISE = "DYNRT_OPTIMISE"


@contextmanager
def _quickly_compiled():
    """Chips that draw one small picture: compiling them takes longer."""
    before = os.environ.get(_OPTIMISE)
    os.environ[_OPTIMISE] = "-O0"
    try:
        yield
    finally:
        if before is None:
            del os.environ[_OPTIMISE]
        else:
            os.environ[_OPTIMISE] = before


def _switches(features):
    return {field.name for field in fields(features) if getattr(features, field.name) is True}


def effect_rows(path, console):
    """Rows of the effects; ``path`` receives a picture with all of them, the chip's over golden's."""
    rows, pairs, common = [], {}, None
    for name, scene in effect_scenes().items():
        camera = scene.default_camera()
        image = prepared(scene, camera)
        common = common or _switches(image.needs)
        config = replace(_CHIP, shader=replace(image.needs, depth=DEPTH))
        model = render_full(image, camera, *_SIZE, config=config)
        with _quickly_compiled():
            drawn = render_rtl(image, camera, *_SIZE, config=config, jitter=_JITTER)
        golden = render_golden(scene, camera, *_SIZE, shading="full", depth=DEPTH)
        pairs[name] = drawn.color, golden.color
        kinds = model.report["ray_kinds"]
        rows.append({"effect": name, "switches": sorted(_switches(image.needs) - common),
                     "instructions": model.report["program"], "cycles": drawn.report["cycles"],
                     "rays": sum(number for kind, number in kinds.items() if kind != "hole"),
                     "rtl_wrong_pixels": int((drawn.color != model.color).any(axis=-1).sum()),
                     "psnr_db": round(psnr(model.color, golden.color), 2),
                     "golden_moved_psnr_db": round(
                         MovedPictures(scene, camera, _SIZE, depth=DEPTH).psnr(golden.color, NUDGE), 2),
                     "flip": round(flip(golden.color, model.color), 4)})
        console.print(f"{name}: {drawn.report['cycles']:,} cycles", highlight=False)
    num_rows = -(-len(pairs) // _COLUMNS)
    with drawn_figure(path, dpi=100, figsize=(2.2 * _COLUMNS, 3.6 * num_rows)) as figure:
        _sheet(figure, pairs, num_rows)
    return rows


def _sheet(figure, pairs, num_rows):
    for place, axes in zip(pairs, figure.subplots(num_rows, _COLUMNS).flat, strict=False):
        axes.imshow(np.concatenate(pairs[place]), interpolation="nearest")
        axes.set_title(place, fontsize=9)
    for axes in figure.axes:
        axes.axis("off")
