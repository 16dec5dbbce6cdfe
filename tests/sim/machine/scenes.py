"""Small scenes that bring out what pictures of rooms do not."""

import numpy as np

from sim.scene import Camera, Instance, Material, Mesh, Scene

__all__ = ["instances_scene", "soup_scene"]


def _mesh(name, corners, num_materials, rng):
    triangles = np.arange(len(corners) * 3, dtype=np.int32).reshape(-1, 3)
    return Mesh(name, corners.reshape(-1, 3), triangles, rng.integers(num_materials, size=len(corners)))


def _materials(rng, count):
    return [Material(f"m{k}", tuple(rng.uniform(0.1, 1.0, 3))) for k in range(count)]


def soup_scene(seed, *, count=60):
    """Triangles at random, some of them axis-aligned, some thin, sharing planes and corners now and then."""
    rng = np.random.default_rng(seed)
    corners = rng.uniform(-1, 1, (count, 3, 3))
    corners[::3] = np.round(corners[::3] * 2) / 2
    corners[::5, :, 0] = 0.25
    corners[::7, 2] = corners[::7, 1] + rng.normal(0, 1e-3, (len(corners[::7]), 3))
    scene_materials = _materials(rng, 5)
    mesh = _mesh("soup", corners, len(scene_materials), rng)
    camera = Camera([0.1, -2.5, 0.4], [0, 0, 0], [0, 0, 1], 70.0)
    return Scene([mesh], [Instance(0, np.eye(3, 4), "soup")], scene_materials, [camera])


def instances_scene(seed, *, count=12):
    """Three meshes, instanced, turned, sheared, mirrored, scaled from 0.1 to 3, overlapping each other."""
    rng = np.random.default_rng(seed)
    scene_materials = _materials(rng, 4)
    meshes = [_mesh(f"mesh{k}", rng.uniform(-1, 1, (20 + 10 * k, 3, 3)), 4, rng) for k in range(3)]
    instances = []
    for number in range(count):
        linear = np.linalg.qr(rng.normal(size=(3, 3)))[0] @ np.diag(rng.uniform(0.3, 1.0, 3) * rng.choice([-1, 1], 3))
        linear = linear * 10.0 ** rng.uniform(-1, 0.5) + rng.normal(0, 0.1, (3, 3))
        instances.append(Instance(number % 3, np.column_stack([linear, rng.uniform(-2, 2, 3)]), f"i{number}"))
    camera = Camera([0.3, -6.0, 1.0], [0, 0, 0], [0, 0, 1], 60.0)
    return Scene(meshes, instances, scene_materials, [camera])
