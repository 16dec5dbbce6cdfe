"""Scenes of any size, to stand where a scene that is measured on is missing."""

import math

import numpy as np

from .camera import Camera
from .material import Material
from .patterns import bricks
from .scene import IDENTITY, Instance, Scene
from .shapes import ball, grid, joined, sheet

__all__ = ["field_scene", "hall_scene"]

_SIZE = np.array((16.0, 12.0, 6.0))
_WALL, _BALL = range(2)
_NUM_BALLS = 24
# Triangles of the hall itself: a floor, a ceiling and four walls.
_SHELL = 12
# A tree of fewer is a bush.
_GROUND_PART = 0.05


def _materials():
    bricked = bricks("bricks", (0.25, 0.08, 0.05), (0.55, 0.25, 0.16), (0.4, 0.38, 0.35), size=64)
    return [Material("wall", (1.0, 1.0, 1.0), texture=bricked), Material("ball", (0.30, 0.52, 0.24))]


def _ball_of(center, radius, num_triangles):
    """A ball of at most so many triangles, but 8 at least: 4·n·(n − 1) of n rings."""
    return ball(center, radius, num_rings=max(2, math.floor((1 + math.sqrt(1 + num_triangles)) / 2)))


def _shell():
    x, y, z = _SIZE
    return [(sheet(corner, along, up, repeats=(8, 4)), _WALL) for corner, along, up in (
        ((0, 0, 0), (x, 0, 0), (0, y, 0)), ((0, 0, z), (0, y, 0), (x, 0, 0)), ((0, y, 0), (x, 0, 0), (0, 0, z)),
        ((x, 0, 0), (-x, 0, 0), (0, 0, z)), ((x, y, 0), (0, -y, 0), (0, 0, z)), ((0, 0, 0), (0, y, 0), (0, 0, z)))]


def hall_scene(num_triangles, *, num_objects):
    """A hall with balls in it, of ``num_objects`` meshes with about ``num_triangles`` together.

    Parameters
    ----------
    num_triangles : int
        300 or more; what is made has at most as many, and less than a tenth fewer.
    num_objects : int
        1, or so many that all but the hall are balls.
    """
    num_balls = max(_NUM_BALLS if num_objects == 1 else num_objects - 1, 1)
    rng, parts, left = np.random.default_rng(1), [], num_triangles - _SHELL
    for number in range(num_balls):
        center = rng.uniform((1.0, 1.0, 0.8), _SIZE - (4.0, 1.0, 0.8))
        shape = _ball_of(center, rng.uniform(0.3, 0.8), left // (num_balls - number))
        left -= len(shape.triangles)
        parts.append((shape, _BALL))
    meshes = [joined("hall", _shell() + (parts if num_objects == 1 else []))]
    if num_objects > 1:
        meshes += [joined(f"ball {number}", [part]) for number, part in enumerate(parts)]
    camera = Camera((_SIZE[0] - 0.7, 0.9, 3.4), (3.0, 8.0, 2.2), (0, 0, 1), 75.0)
    return Scene(meshes, [Instance(k, IDENTITY.copy(), mesh.name) for k, mesh in enumerate(meshes)], _materials(),
                 [camera])


def field_scene(num_triangles, *, num_objects):
    """Hills with ``num_objects`` − 1 instances of a ball on them, with about ``num_triangles`` together.

    Parameters
    ----------
    num_triangles : int
        100 times the number of objects or more; what is made has at most as many, and less than a tenth fewer.
    num_objects : int
        2 or more.
    """
    rng, extent = np.random.default_rng(2), 100.0

    def height(x, y):
        return 3.0 * np.sin(x / 9) * np.cos(y / 7)

    def surface(u, v):
        x, y = extent * u, extent * v
        return np.stack([x, y, height(x, y)], axis=-1)

    cells = max(1, math.floor(math.sqrt(_GROUND_PART * num_triangles / 2)))
    ground = grid(surface, cells, cells)
    bush = _ball_of((0, 0, 0), 1.0, (num_triangles - len(ground.triangles)) // (num_objects - 1))
    instances = [Instance(0, IDENTITY.copy(), "ground")]
    for number in range(num_objects - 1):
        (x, y), radius = rng.uniform(0, extent, 2), rng.uniform(0.6, 1.8)
        place = np.column_stack([radius * np.eye(3), (x, y, height(x, y) + 0.6 * radius)])
        instances.append(Instance(1, place, f"bush {number}"))
    camera = Camera((-4.0, -4.0, 9.0), (30.0, 30.0, 0.0), (0, 0, 1), 60.0)
    return Scene([joined("ground", [(ground, _WALL)]), joined("bush", [(bush, _BALL)])], instances, _materials(),
                 [camera])
