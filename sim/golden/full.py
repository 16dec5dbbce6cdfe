"""Full shading of a picture, or of rays, by the rules of docs/shading.md."""

import numpy as np

from ..scene import Light
from .shade import COUNTS, shade_pixels
from .tables import background_color, lamps, looks, surfaces
from .tracer import scene_geometry

__all__ = ["MAX_DEPTH", "shade_full"]

#: Generations of secondary rays that can be asked for.
MAX_DEPTH = 16

# Light from everywhere in scenes that have no lights of their own.
_HEADLIGHTS_AMBIENT = 0.15


def shade_full(scene, origin, directions, *, depth=4, background=(0, 0, 0)):
    """Linear colours that rays from one origin see, and how many rays it took.

    Parameters
    ----------
    scene : Scene
    origin : float64[3]
    directions : float64[H, W, 3]
        Of any length, not zero.
    depth : int
        Generations of secondary rays, 0…16; 0 is primary and shadow rays alone.
    background : tuple of int
        sRGB-encoded bytes that rays see that meet nothing, if the scene has no sky.

    Returns
    -------
    colors : float64[H, W, 3]
        Not bounded: 1 is white.
    levels : list of dict
        For each depth from 0, numbers by the names of :data:`~sim.golden.shade.COUNTS`.

    Raises
    ------
    ValueError
        For a depth out of range.
    """
    if not 0 <= depth <= MAX_DEPTH:
        raise ValueError(f"depth is {depth}; it must be from 0 to {MAX_DEPTH}")
    height, width = directions.shape[:2]
    colors = np.zeros((height, width, 3))
    counts = np.zeros((height, depth + 1, len(COUNTS)), np.int64)
    sky, sky_size = np.zeros((1, 4), np.uint8), 0
    if scene.sky is not None:
        sky_size = len(scene.sky.pixels)
        sky = np.pad(scene.sky.pixels.reshape(-1, 3), ((0, 0), (0, 1)), constant_values=255)
    lights, ambient = scene.lights, scene.ambient
    if not lights:
        lights, ambient = [Light.headlight(origin)], ambient if any(ambient) else (_HEADLIGHTS_AMBIENT,) * 3
    ambient = tuple(float(channel) for channel in lamps([Light("point", color=ambient)]).color[0])
    shade_pixels(np.asarray(origin, np.float64), np.ascontiguousarray(directions, np.float64), depth,
                 *scene_geometry(scene), surfaces(scene), looks(scene.materials),
                 lamps(lights), ambient, sky, sky_size,
                 background_color(background), colors, counts)
    return colors, [dict(zip(COUNTS, level.tolist(), strict=True)) for level in counts.sum(axis=0)]
