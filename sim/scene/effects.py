"""A built-in scene for each effect of shading: a ball on a floor under a lamp, and one thing more."""

from dataclasses import replace

import numpy as np

from .camera import Camera
from .light import Light
from .material import Material
from .patterns import bricks
from .scene import Instance, Scene
from .shapes import ball, joined, sheet
from .sky import Sky
from .texture import Texture

__all__ = ["effect_scenes"]

_CAMERA = Camera((2.6, -4.2, 2.3), (0.0, 0.1, 0.75), (0.0, 0.0, 1.0), 44.0)
_LAMP = Light("point", color=(1.0, 0.93, 0.84), intensity=16.0, position=(1.8, -1.6, 3.6), radius=0.2)
_FLOOR = Material("floor", (0.46, 0.42, 0.36))
_BALL = Material("ball", (0.75, 0.28, 0.12))
# Flat triangles, unless it is smoothness that is shown.
_NUM_RINGS = 10


def _lace(size=64):
    """Opaque with round holes."""
    y, x = ((np.arange(size) + 0.5) / size * 4 % 1 - 0.5 for _ in range(2))
    pixels = np.full((size, size, 4), 255, np.uint8)
    pixels[..., 3] = np.where(x[None] ** 2 + y[:, None] ** 2 < 0.1, 0, 255)
    return Texture("lace", pixels)


def _scene(*, floor=_FLOOR, thing=_BALL, smooth=False, lights=(_LAMP,), sky=None, copies=()):
    shapes = [(sheet((-3.5, -3.0, 0.0), (7.0, 0, 0), (0, 7.0, 0), repeats=(4, 4)), 0),
              (ball((0.0, 0.0, 0.9), 0.9, num_rings=_NUM_RINGS), 1)]
    meshes = [joined(name, [shape]) for name, shape in zip(("floor", "ball"), shapes, strict=True)]
    meshes[0] = replace(meshes[0], normals=None, uvs=meshes[0].uvs if floor.texture else None)
    meshes[1] = replace(meshes[1], normals=meshes[1].normals if smooth else None,
                        uvs=meshes[1].uvs if thing.texture else None)
    places = [np.eye(3, 4), np.eye(3, 4), *copies]
    instances = [Instance(min(number, 1), place, f"{meshes[min(number, 1)].name} {number}")
                 for number, place in enumerate(places)]
    return Scene(meshes, instances, [floor, thing], [_CAMERA], lights=list(lights), ambient=(0.12, 0.13, 0.16), sky=sky)


def _copies():
    """Two more balls, one of them stretched and sheared."""
    small = np.column_stack([0.45 * np.eye(3), (1.35, -0.9, 0.0)])
    leaning = np.array([[0.3, 0.0, 0.25, -1.5], [0.1, 0.45, 0.0, -0.6], [0.0, 0.0, 0.7, 0.0]])
    return small, leaning


def effect_scenes():
    """A scene for each effect, by its name; each needs the switches of the first one, and few of its own."""
    glass = Material("glass", (0.93, 0.98, 0.95), reflection=0.05, transmission=1.0, ior=1.5)
    sky = Sky.gradient(zenith=(0.12, 0.28, 0.68), horizon=(0.62, 0.78, 0.92), ground=(0.12, 0.16, 0.07), size=64)
    wall = bricks("bricks", (0.25, 0.08, 0.05), (0.55, 0.25, 0.16), (0.4, 0.38, 0.35), size=64)
    return {
        "point light, shadow": _scene(),
        "spot light": _scene(lights=[Light.spot((1.6, -1.4, 3.4), (-0.45, 0.4, -0.85), inner_angle=0.3, outer_angle=0.5,
                                                intensity=16.0, radius=0.2)]),
        "directional light": _scene(lights=[Light("directional", direction=(-0.6, 0.5, -1.0), intensity=1.4)]),
        "light with a range": _scene(lights=[replace(_LAMP, reach=4.6)]),
        "smooth normals": _scene(smooth=True),
        "texture": _scene(floor=replace(_FLOOR, base_color=(1.0, 1.0, 1.0), texture=wall)),
        "highlight": _scene(thing=replace(_BALL, specular=0.8, shininess=16.0), smooth=True),
        "emission": _scene(thing=replace(_BALL, emission=(0.35, 0.3, 0.05))),
        "sky": _scene(sky=sky),
        "instances": _scene(copies=_copies()),
        "reflection": _scene(floor=replace(_FLOOR, reflection=0.4), thing=replace(_BALL, reflection=0.3)),
        "Fresnel reflection": _scene(floor=replace(_FLOOR, reflection=0.04, fresnel=True)),
        "refraction": _scene(thing=glass, smooth=True),
        "transparency": _scene(thing=replace(_BALL, alpha_mode="blend", opacity=0.5)),
        "holes": _scene(thing=replace(_BALL, alpha_mode="mask", texture=_lace())),
    }
