"""How much of a picture hangs on where exactly a pixel is sampled."""

import math

import numpy as np

from sim.golden import psnr, render_golden

__all__ = ["AROUND", "MovedPictures", "flip"]

#: Eight directions.
AROUND = [(math.cos(angle), math.sin(angle)) for angle in np.arange(8) * (math.pi / 4)]


def flip(reference, picture):
    """Mean FLIP error (Andersson et al. 2020) at its default 67 pixels a degree."""
    # Apart from drawing pictures, like all that measuring needs; see pyproject.toml.
    import flip_evaluator

    pictures = (np.float32(pixels) / 255 for pixels in (reference, picture))
    return float(flip_evaluator.evaluate(*pictures, "LDR")[1])


class MovedPictures:
    """Golden's pictures with all samples moved by a part of a pixel, into eight directions.

    Where a surface ends between two samples' places, rounding of any kind decides what a pixel shows. These pictures
    tell how much of an error is of that sort: they have no error, but their samples are elsewhere.

    Parameters
    ----------
    scene : Scene
    camera : Camera
    size : (int, int)
    depth : int
        See :func:`~sim.golden.render_golden`.
    """

    def __init__(self, scene, camera, size, *, depth):
        self._scene, self._camera, self._size, self._depth = scene, camera, size, depth

    def at(self, pixels):
        """uint8[8, height, width, 3]: the pictures of samples moved by so many pixels."""
        return np.stack([render_golden(self._scene, self._camera, *self._size, shading="full", depth=self._depth,
                                       shift=(x * pixels, y * pixels)).color for x, y in AROUND])

    def psnr(self, golden, pixels):
        """PSNR in dB of all eight together against ``golden``, whose samples are where they belong."""
        moved = self.at(pixels)
        return psnr(moved, np.broadcast_to(golden, moved.shape))

    def explains(self, color, pixels, *, levels):
        """bool[height, width]: where a picture is within ``levels`` of what one of the eight shows."""
        return (np.abs(self.at(pixels).astype(int) - color).max(axis=-1) <= levels).any(axis=0)
