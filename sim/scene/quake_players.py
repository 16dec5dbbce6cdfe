"""The scene Quake3-p of the paper's Table 3: a map with sixteen players standing at its items."""

import math
from dataclasses import replace
from pathlib import Path

import numpy as np

from .check import unusable_warnings
from .entities import numbers
from .pk3 import Archive
from .quake_map import map_scene
from .quake_player import Wardrobe, player_mesh
from .scene import Instance, Scene

__all__ = ["floors", "quake_players_scene"]

_MAP, _MAP_NAME, _PLAYERS = "openarena/quake3-oa_dm5.pk3", "oa_dm5", "openarena/players.pk3"
_CAST = ("sarge", "merman", "gargoyle", "major")
_NUM_PLAYERS = 16
# Coarse, as the paper has some 840 triangles a player.
_LEVEL = 2
# Where the parts of the gargoyle's coarse model meet, which has no tags: measured on its waist and its neck.
_JOINTS = {"gargoyle": {"tag_torso": (2.0, 0.0, 7.5), "tag_head": (0.5, 0.0, 16.5)}}
_ITEMS = ("item_", "weapon_", "ammo_", "holdable_")
# The game's: a player's origin above its feet.
_ORIGIN_HEIGHT = 24.0


def floors(corners, points):
    """Height of the first triangle straight below each point, float64[N]; that of the point where there is none.

    Parameters
    ----------
    corners : float64[T, 3, 3]
    points : float64[N, 3]
    """
    a, b, c = corners.swapaxes(0, 1)
    ab, ac = (b - a)[:, :2], (c - a)[:, :2]
    area = ab[:, 0] * ac[:, 1] - ab[:, 1] * ac[:, 0]
    flat, area = area != 0, np.where(area != 0, area, 1.0)
    heights = points[:, 2].copy()
    for number, point in enumerate(points):
        to = point[:2] - a[:, :2]
        u = (to[:, 0] * ac[:, 1] - to[:, 1] * ac[:, 0]) / area
        v = (ab[:, 0] * to[:, 1] - ab[:, 1] * to[:, 0]) / area
        z = a[:, 2] + u * (b - a)[:, 2] + v * (c - a)[:, 2]
        below = flat & (u >= 0) & (v >= 0) & (u + v <= 1) & (z <= point[2])
        heights[number] = z[below].max(initial=-math.inf) if below.any() else point[2]
    return heights


def quake_players_scene(folder):
    """The map ``oa_dm5`` and sixteen players, four each of sarge, merman, gargoyle and major.

    They stand below the first sixteen items in the order of the map's entities, and face the middle of them all.

    Parameters
    ----------
    folder : path-like
        Of scenes, with openarena/quake3-oa_dm5.pk3 and openarena/players.pk3.

    Raises
    ------
    SceneError
        If a file is damaged. (OSError if it is missing.)
    """
    folder = Path(folder)
    archive = Archive(folder / _MAP)
    world, entities = map_scene(archive, _MAP_NAME)
    places = np.array([numbers(entity, "origin", (0.0, 0.0, 0.0), archive.path) for entity in entities
                       if entity.get("classname", "").startswith(_ITEMS)][:_NUM_PLAYERS])
    ground = world.meshes[0]
    places[:, 2] = floors(ground.vertices[ground.triangles], places) + _ORIGIN_HEIGHT
    archive, warnings = Archive(folder / _PLAYERS), []
    wardrobe = Wardrobe(archive)
    cast = [player_mesh(archive, name, wardrobe, level=_LEVEL, joints=_JOINTS.get(name), warnings=warnings)
            for name in _CAST]
    cast = [replace(mesh, material_ids=mesh.material_ids + np.int32(len(world.materials))) for mesh in cast]
    meshes = world.meshes + cast
    warnings = world.warnings + warnings + wardrobe.warnings() + unusable_warnings(meshes)
    return Scene(meshes, world.instances + _standing(places, len(world.meshes)), world.materials + wardrobe.materials,
                 world.cameras, warnings=warnings)


def _standing(places, first):
    """An instance at each place, of the meshes from ``first`` on in turn, turned towards the middle of all."""
    middle, instances = places.mean(axis=0), []
    for number, place in enumerate(places):
        x, y = (middle - place)[:2] / max(np.linalg.norm((middle - place)[:2]), 1e-9)
        turned = np.array([(x, -y, 0.0), (y, x, 0.0), (0.0, 0.0, 1.0)])
        instances.append(Instance(first + number % len(_CAST), np.column_stack([turned, place]),
                                  f"{_CAST[number % len(_CAST)]} {number // len(_CAST)}"))
    return instances
