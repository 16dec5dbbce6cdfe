"""How far the model's pictures are from float64, in figures."""

import math
from dataclasses import replace

import numpy as np

from rtl.config import ChipConfig
from sim.golden import psnr, render_golden
from sim.golden.tracer import render
from sim.model import render_full
from sim.scene import SceneError

from .pipeline_demos import DEPTH, prepared
from .sensitivity import AROUND, flip

__all__ = ["Truth"]

#: Relative distance within which two surfaces count as one.
_SAME = 1e-3
#: Part of a pixel within which golden's samples are moved to see what else it might show.
_REACH = 1 / 64


class Truth:
    """Golden's picture of a scene, and what it shows close to each sample.

    Parameters
    ----------
    scene : Scene
    camera : Camera
    size : (int, int)
    shading, depth
        Of golden's picture, see :func:`~sim.golden.render_golden`.
    """

    def __init__(self, scene, camera, size, *, shading="full", depth=DEPTH):
        self._scene, self._camera, self._size = scene, camera, size
        self.golden = render_golden(scene, camera, *size, shading=shading, depth=depth)
        self._around = np.stack([render(scene, camera, *size, shift=(x * _REACH, y * _REACH)).t for x, y in AROUND])

    def measure(self, fmt, variants):
        """Figures of the model's pictures in a format, for each of ``variants``, parameters of a chip by name.

        Where a scene does not fit the format, there is its ``error`` alone.
        """
        try:
            image = prepared(self._scene, self._camera, fmt=fmt)
        except SceneError as error:
            return {name: {"error": str(error)} for name in variants}
        config = replace(ChipConfig(fmt=fmt), shader=replace(image.needs, depth=DEPTH))
        return {name: self._figures(image, replace(config, **parameters)) for name, parameters in variants.items()}

    def _figures(self, image, config):
        try:
            drawn = render_full(image, self._camera, *self._size, config=config)
        except OverflowError as error:
            return {"error": str(error)}
        golden = self.golden
        pixels, wrong, found = golden.t.size, drawn.differs_in_surface(golden), drawn.prim_id >= 0
        with np.errstate(invalid="ignore"):
            error = np.abs(drawn.t / golden.t - 1)[(golden.prim_id >= 0) & found & ~wrong]
        part = np.quantile(error, (0.5, 0.999, 1.0)) if error.size else np.full(3, math.nan)
        counts = drawn.report["counts"]
        return {
            **self.faults(drawn),
            **{f"t_err_{name}": float(f"{value:.3g}") for name, value in zip(("median", "p999", "max"), part,
                                                                             strict=True)},
            "psnr": self.psnr(drawn), "flip": round(flip(golden.color, drawn.color), 4),
            "steps_per_pixel": round(counts["steps"] / pixels, 2),
            "triangle_tests_per_pixel": round(counts["triangle_tests"] / pixels, 2)}

    def faults(self, drawn):
        """``wrong_percent``, ``cracks`` and ``phantoms`` of a picture."""
        golden = self.golden
        expected, found = golden.prim_id >= 0, drawn.prim_id >= 0
        # What golden has at this distance within the reach is an outline, which any rounding moves.
        with np.errstate(invalid="ignore"):
            known = (np.abs(self._around - drawn.t) <= _SAME * self._around).any(axis=0) | (
                ~found & np.isinf(self._around).any(axis=0))
            farther = expected & (~found | (drawn.t > golden.t * (1 + _SAME)))
            nearer = found & (~expected | (drawn.t < golden.t * (1 - _SAME)))
        return {"wrong_percent": round(100 * float(drawn.differs_in_surface(golden).mean()), 4),
                "cracks": int((farther & ~known).sum()), "phantoms": int((nearer & ~known).sum())}

    def psnr(self, drawn):
        """Of a picture in dB."""
        return round(psnr(drawn.color, self.golden.color), 2)
