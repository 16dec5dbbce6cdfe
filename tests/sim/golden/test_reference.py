"""Scenes of everything at random, by golden and by a second shader that shares nothing with it."""

import numpy as np
import pytest

from sim.golden import shade_full
from sim.scene import Camera, Instance, Light, Material, Mesh, Scene, Sky, Texture

from .reference import Reference
from .rooms import ball


def any_material(rng, textures):
    return Material(
        "m", tuple(rng.uniform(0.2, 1, 3)), textures[rng.integers(len(textures))],
        emission=tuple(rng.uniform(0, 0.2, 3)), specular=rng.uniform(), shininess=2.0 ** rng.uniform(0, 8),
        reflection=rng.choice([0.0, rng.uniform()]), fresnel=bool(rng.integers(2)), tinted=bool(rng.integers(2)),
        transmission=rng.choice([0.0, rng.uniform(0.3, 1)]), ior=rng.uniform(0.7, 2), thin=rng.uniform() < 0.2,
        opacity=rng.uniform(0.3, 1), alpha_mode=str(rng.choice(["opaque", "opaque", "mask", "blend"])),
        alpha_cutoff=rng.uniform(0.2, 0.6))


def soup(rng, count):
    """Loose triangles with normals that lean to their fronts, and texture coordinates far out."""
    corners = rng.uniform(-1, 1, (count, 1, 3)) + rng.uniform(-0.7, 0.7, (count, 3, 3))
    front = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    front /= np.linalg.norm(front, axis=1, keepdims=True)
    return Mesh("soup", corners.reshape(-1, 3), np.arange(3 * count, dtype=np.int32).reshape(-1, 3),
                rng.integers(8, size=count).astype(np.int32),
                normals=front[:, None] + rng.uniform(-0.4, 0.4, (count, 3, 3)), uvs=rng.uniform(-5, 5, (count, 3, 2)))


def lights(rng):
    def somewhere():
        return tuple(rng.uniform(-3, 3, 3))

    return [Light("directional", direction=somewhere(), color=tuple(rng.uniform(0, 2, 3))),
            Light("point", position=somewhere(), intensity=4.0, color=tuple(rng.uniform(0, 1, 3))),
            Light("point", position=somewhere(), intensity=9.0, radius=2.0, reach=4.0),
            Light.spot(somewhere(), somewhere(), inner_angle=0.4, outer_angle=1.2, intensity=9.0),
            Light.patch(somewhere(), somewhere(), intensity=9.0, radius=0.5)]


def random_scene(seed):
    rng = np.random.default_rng(seed)
    textures = [None, *(Texture("t", rng.integers(0, 256, (2**rng.integers(4), 2**rng.integers(4), 4), dtype=np.uint8),
                                bool(filtered)) for filtered in (0, 1, 1))]
    sphere, _ = ball((0, 0, 0), 1.0, None, num_rings=6, smooth=True)
    sphere = Mesh(sphere.name, sphere.vertices, sphere.triangles, np.full(sphere.num_triangles, 8, np.int32),
                  normals=sphere.normals)
    flat = Mesh("flat", sphere.vertices, sphere.triangles, np.full(sphere.num_triangles, 9, np.int32))
    meshes = [soup(rng, 12), sphere, flat]
    instances = []
    for number in range(5):
        linear = np.linalg.qr(rng.normal(size=(3, 3)))[0] @ np.diag(rng.uniform(0.4, 1.1, 3))
        linear += rng.normal(0, 0.1, (3, 3))
        instances.append(Instance(number % 3, np.column_stack([linear, rng.uniform(-1.5, 1.5, 3)]), f"i{number}"))
    sky = Sky(rng.integers(0, 256, (8, 8, 3), dtype=np.uint8)) if seed % 2 else None
    return Scene(meshes, instances, [any_material(rng, textures) for _ in range(10)], lights=lights(rng), sky=sky,
                 ambient=tuple(rng.uniform(0, 0.3, 3)))


@pytest.mark.parametrize("seed", range(16))
def test_golden_agrees_with_the_second_shader(seed):
    scene = random_scene(seed)
    origin, directions = Camera((0.3, -4, 0.8), (0, 0, 0), (0, 0, 1), 50.0).rays(14, 11)
    golden, levels = shade_full(scene, origin, directions, depth=3, background=(30, 90, 160))
    reference = Reference(scene, depth=3, background=(30, 90, 160))
    expected = np.array([[reference.color(origin, direction) for direction in row] for row in directions])
    different = np.abs(golden - expected).max(axis=2) > 1e-9 * (1 + expected.max(axis=2))
    # A ray in a hundred may pass an edge on another side.
    assert different.mean() <= 0.01
    assert levels[0]["hits"] > 20
    assert sum(level["reflection"] + level["refraction"] + level["transparency"] for level in levels) > 20


def test_it_would_notice():
    """The same with lights a thousandth stronger differs nearly everywhere that light falls."""
    scene = random_scene(1)
    origin, directions = Camera((0.3, -5, 1), (0, 0, 0), (0, 0, 1), 50.0).rays(14, 11)
    golden, _ = shade_full(scene, origin, directions, depth=3)
    stronger = [Light(light.kind, light.color, light.intensity * 1.001, light.position, light.direction, light.radius,
                      light.reach, light.cone) for light in scene.lights]
    other, _ = shade_full(Scene(scene.meshes, scene.instances, scene.materials, lights=stronger, sky=scene.sky,
                                ambient=scene.ambient), origin, directions, depth=3)
    assert (np.abs(golden - other).max(axis=2) > 1e-9 * (1 + golden.max(axis=2))).mean() > 0.2
