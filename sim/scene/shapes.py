"""Shapes made by formulas, for the built-in scenes: triangles with normals and texture coordinates."""

from dataclasses import dataclass, replace

import numpy as np

from .normals import flat_normals, smooth_normals
from .scene import Mesh

__all__ = ["Shape", "ball", "box", "box_uvs", "grid", "joined", "lathe", "sheet", "tube"]


@dataclass(frozen=True, eq=False)
class Shape:
    """Triangles that are not in a mesh yet.

    Parameters
    ----------
    vertices : float64[V, 3]
    triangles : int[T, 3]
    normals, uvs : float64[T, 3, 3], float64[T, 3, 2]
        Of the corners.
    """

    vertices: np.ndarray
    triangles: np.ndarray
    normals: np.ndarray
    uvs: np.ndarray

    def moved(self, matrix):
        """The shape under an affine map [A | b], float64[3, 4]."""
        matrix = np.asarray(matrix, np.float64)
        linear = matrix[:, :3]
        triangles = self.triangles if np.linalg.det(linear) > 0 else self.triangles[:, [0, 2, 1]]
        order = [0, 1, 2] if np.linalg.det(linear) > 0 else [0, 2, 1]
        return replace(self, vertices=self.vertices @ linear.T + matrix[:, 3], triangles=triangles,
                       normals=self.normals[:, order] @ np.linalg.inv(linear), uvs=self.uvs[:, order])


def _rows(num_u, num_v, *, wraps):
    """Triangles of a lattice of num_u × num_v cells; vertex (i, j) has number i·columns + j."""
    columns = num_v if wraps else num_v + 1
    i, j = np.indices((num_u, num_v)).reshape(2, -1)
    a, b = i * columns + j, i * columns + (j + 1) % columns
    c, d = a + columns, b + columns
    return np.stack([a, c, d, a, d, b], axis=1).reshape(-1, 3)


def grid(surface, num_u, num_v, *, wraps=False):
    """The surface (u, v) ↦ point over 0…1 × 0…1 as 2·num_u·num_v triangles with smooth normals.

    Parameters
    ----------
    surface : callable
        Of arrays u, v of one shape; gives float64[…, 3].
    num_u, num_v : int
        Cells each way.
    wraps : bool
        v = 1 is v = 0 again.
    """
    u, v = np.indices((num_u + 1, num_v + 1)) / np.array((num_u, num_v))[:, None, None]
    corners = np.stack([u, v], axis=-1).reshape(-1, 2)
    cells = _rows(num_u, num_v, wraps=False)
    if wraps:
        u, v = u[:, :-1], v[:, :-1]
    points = surface(u, v).reshape(-1, 3)
    triangles = _rows(num_u, num_v, wraps=wraps)
    return Shape(points, triangles, smooth_normals(points, triangles), corners[cells])


def sheet(corner, edge_u, edge_v, *, repeats=(1.0, 1.0)):
    """Parallelogram of two triangles whose front is at edge_u × edge_v, with a texture repeated along each edge."""
    corner, edge_u, edge_v = (np.asarray(vector, np.float64) for vector in (corner, edge_u, edge_v))
    vertices = np.array([corner, corner + edge_u, corner + edge_u + edge_v, corner + edge_v])
    triangles = np.array([(0, 1, 2), (0, 2, 3)])
    # Upright on walls: v runs down a texture, and edge_v up the wall.
    uvs = np.array([(0, 1), (1, 1), (1, 0), (0, 0)]) * repeats
    return Shape(vertices, triangles, np.repeat(flat_normals(vertices[triangles])[:, None], 3, axis=1), uvs[triangles])


def box_uvs(corners, *, size=1.0):
    """Texture coordinates float64[T, 3, 2] of triangles float64[T, 3, 3] by their position, ``size`` units a repeat."""
    axis = np.abs(flat_normals(corners)).argmax(axis=1)
    first, second = np.array([1, 0, 0])[axis], np.array([2, 2, 1])[axis]
    rows = np.arange(len(corners))[:, None]
    columns = np.arange(3)[None]
    return np.stack([corners[rows, columns, first[:, None]], -corners[rows, columns, second[:, None]]], axis=-1) / size


def box(lower, upper, *, size=1.0):
    """Axis-aligned closed box, its texture repeating every ``size`` units."""
    bits = np.indices((2, 2, 2)).reshape(3, 8).T
    vertices = np.where(bits == 1, upper, lower).astype(np.float64)
    quads = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    triangles = np.array([corners for a, b, c, d in quads for corners in ((a, b, c), (a, c, d))])
    corners = vertices[triangles]
    return Shape(vertices, triangles, np.repeat(flat_normals(corners)[:, None], 3, axis=1), box_uvs(corners, size=size))


def lathe(profile, num_segments):
    """Surface of revolution about z of (radius, height) pairs, from below upwards; radius 0 at an end closes it."""
    profile = np.asarray(profile, np.float64)
    steps = np.linspace(0, 1, len(profile))

    def surface(u, v):
        radius, height = np.interp(u, steps, profile[:, 0]), np.interp(u, steps, profile[:, 1])
        return np.stack([radius * np.cos(2 * np.pi * v), -radius * np.sin(2 * np.pi * v), height], axis=-1)

    shape = grid(surface, len(profile) - 1, num_segments, wraps=True)
    corners = shape.vertices[shape.triangles]
    keeps = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1) > 1e-12
    return Shape(shape.vertices, shape.triangles[keeps], shape.normals[keeps], shape.uvs[keeps])


def ball(center, radius, *, num_rings=24):
    """Sphere with exact normals; 4·num_rings·(num_rings − 1) triangles."""
    angle = np.pi * np.arange(num_rings + 1) / num_rings
    profile = np.stack([np.sin(angle), -np.cos(angle)], axis=1)
    profile[[0, -1], 0] = 0
    shape = lathe(profile, 2 * num_rings)
    return replace(shape, vertices=shape.vertices * radius + center, normals=shape.vertices[shape.triangles])


def tube(path, radii, num_sides):
    """Round tube along points float64[N, 3] with a radius at each; 2·(N − 1)·num_sides triangles, open at the ends."""
    path = np.asarray(path, np.float64)
    along = np.gradient(path, axis=0)
    along /= np.linalg.norm(along, axis=1, keepdims=True)
    side = np.cross(along, np.eye(3)[np.abs(along).sum(axis=0).argmin()])
    side /= np.linalg.norm(side, axis=1, keepdims=True)
    other = np.cross(along, side)
    radii = np.broadcast_to(radii, len(path))

    def surface(u, v):
        k, angle = np.rint(u * (len(path) - 1)).astype(int), -2 * np.pi * v[..., None]
        return path[k] + radii[k][..., None] * (np.cos(angle) * side[k] + np.sin(angle) * other[k])

    return grid(surface, len(path) - 1, num_sides, wraps=True)


def joined(name, parts):
    """One mesh of (shape, material number) pairs."""
    starts = np.cumsum([0, *(len(shape.vertices) for shape, _ in parts)])
    return Mesh(name, np.concatenate([shape.vertices for shape, _ in parts]),
                np.concatenate([shape.triangles + start for (shape, _), start in zip(parts, starts, strict=False)])
                .astype(np.int32),
                np.concatenate([np.full(len(shape.triangles), material, np.int32) for shape, material in parts]),
                normals=np.concatenate([shape.normals for shape, _ in parts]),
                uvs=np.concatenate([shape.uvs for shape, _ in parts]))
