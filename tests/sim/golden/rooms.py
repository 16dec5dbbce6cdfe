"""Small scenes whose pictures can be worked out by hand."""

import numpy as np

from sim.golden import shade_full
from sim.scene import Instance, Light, Material, Mesh, Scene, Texture

__all__ = ["BLACK", "CHECKED", "DOWN", "FAR", "WHITE", "ball", "ground", "leaf", "lit", "quad", "scene_of", "see"]

WHITE = Material("white", (1.0, 1.0, 1.0))
BLACK = Material("black", (0.0, 0.0, 0.0))
#: A lamp that reaches nothing: scenes with it have no headlight.
FAR = Light("point", position=(0, 0, 1e6), intensity=0.0)
DOWN = (0.0, 0.0, -1.0)
#: Red, green with opacity 0, blue with 64/255, white; from v = 0.
CHECKED = Texture("checked", np.array([[(255, 0, 0, 255), (0, 255, 0, 0)], [(0, 0, 255, 64), (255, 255, 255, 255)]],
                                      np.uint8), filtered=False)
_CORNERS = [(0, 0), (1, 0), (1, 1), (0, 1)]


def quad(corners, material, *, uvs=None):
    """A plane piece of two triangles, wound so that its front is where the corners run counter-clockwise."""
    triangles = np.array([(0, 1, 2), (0, 2, 3)], np.int32)
    uvs = None if uvs is None else np.asarray(uvs, np.float64)[triangles]
    return Mesh("quad", np.asarray(corners, np.float64), triangles, np.zeros(2, np.int32), uvs=uvs), material


def ball(center, radius, material, *, num_rings=24, smooth=False):
    """A sphere of triangles about ``center``, its vertices on the sphere."""
    theta, phi = np.pi * np.arange(1, num_rings) / num_rings, np.pi * np.arange(2 * num_rings) / num_rings
    ring = np.stack([np.outer(np.sin(theta), np.cos(phi)), np.outer(np.sin(theta), np.sin(phi)),
                     np.outer(np.cos(theta), np.ones(len(phi)))], axis=2)
    points = np.concatenate([ring.reshape(-1, 3), [(0, 0, 1), (0, 0, -1)]])
    n, triangles = len(phi), []
    for j in range(n):
        k = (j + 1) % n
        triangles.append((len(points) - 2, j, k))
        for row in range(0, (num_rings - 2) * n, n):
            triangles += [(row + j, row + n + j, row + n + k), (row + j, row + n + k, row + k)]
        triangles.append((len(points) - 1, (num_rings - 2) * n + k, (num_rings - 2) * n + j))
    triangles = np.array(triangles, np.int32)
    normals = points[triangles] if smooth else None
    mesh = Mesh("ball", points * radius + center, triangles, np.zeros(len(triangles), np.int32), normals=normals)
    return mesh, material


def scene_of(*parts, transforms=(), **others):
    """Scene of pairs (mesh, material), each an instance of its own."""
    meshes, materials, instances = [], [], []
    for number, (mesh, material) in enumerate(parts):
        meshes.append(Mesh(mesh.name, mesh.vertices, mesh.triangles, np.full(mesh.num_triangles, number, np.int32),
                           normals=mesh.normals, uvs=mesh.uvs))
        materials.append(material)
        placed = transforms[number] if number < len(transforms) else np.eye(3, 4)
        instances.append(Instance(number, np.asarray(placed, np.float64), f"part{number}"))
    return Scene(meshes, instances, materials, **others)


def see(scene, origin, directions, **options):
    """Linear colours float64[…, 3] of rays from one origin."""
    directions = np.asarray(directions, np.float64)
    colors, _ = shade_full(scene, np.asarray(origin, np.float64), directions.reshape(1, -1, 3), **options)
    return colors.reshape(directions.shape)


def ground(material=WHITE, **others):
    """A large floor at z = 0."""
    return quad([(-50, -50, 0), (50, -50, 0), (50, 50, 0), (-50, 50, 0)], material, **others)


def lit(light, point=(0.0, 0.0), *, material=WHITE, eye=(0.3, 0.2, 1.0), **others):
    """Colour of a point of the ground."""
    scene = scene_of(ground(material), lights=[light], **others)
    return see(scene, eye, np.array((*point, 0.0)) - eye)


def leaf(material, z):
    """A square from (0, 0) to (2, 2) with a texture once across."""
    return quad([(0, 0, z), (2, 0, z), (2, 2, z), (0, 2, z)], material, uvs=_CORNERS)
