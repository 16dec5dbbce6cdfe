"""Shapes and textures made by formulas."""

import numpy as np
import pytest

from sim.scene.normals import flat_normals, smooth_normals
from sim.scene.patterns import bricks, noise, planks
from sim.scene.shapes import ball, box, grid, joined, lathe, sheet, tube

CLOSED = {"ball": (ball((1, 2, 3), 0.5, num_rings=8), 4 * 8 * 7), "box": (box((0, 0, 0), (1, 2, 3)), 12),
          "lathe": (lathe([(0, 0), (1, 0), (0.5, 2), (0, 2.5)], 9), 2 * 9 * 2)}


def volume(shape):
    """By the divergence theorem: positive if the fronts look outwards."""
    a, b, c = np.moveaxis(shape.vertices[shape.triangles], 1, 0)
    return (a * np.cross(b, c)).sum() / 6


@pytest.mark.parametrize("name", CLOSED)
def test_solids_are_closed_and_look_outwards(name):
    shape, count = CLOSED[name]
    assert len(shape.triangles) == count
    points, numbers = np.unique(np.round(shape.vertices, 9), axis=0, return_inverse=True)
    triangles = numbers.reshape(-1)[shape.triangles]
    edges = np.concatenate([triangles[:, [i, (i + 1) % 3]] for i in range(3)])
    keys, counts = np.unique(edges, axis=0, return_counts=True)
    assert (counts == 1).all()
    assert {tuple(key) for key in keys.tolist()} == {tuple(key) for key in keys[:, ::-1].tolist()}
    assert volume(shape) > 0
    assert len(points) - len(keys) // 2 + len(triangles) == 2


def test_volumes_are_right():
    assert volume(CLOSED["box"][0]) == pytest.approx(6)
    assert volume(ball((5, 0, 0), 2.0, num_rings=64)) == pytest.approx(4 / 3 * np.pi * 8, rel=3e-3)


@pytest.mark.parametrize("matrix", [np.eye(3, 4), np.diag((-1.0, 1, 1, 0))[:3],
                                    [[2, 1, 0, 3], [0, 1, 0.5, 4], [0, 0, 0.3, 5]]])
@pytest.mark.parametrize("name", CLOSED)
def test_moved_shapes_stay_right_side_out(name, matrix):
    moved = CLOSED[name][0].moved(matrix)
    assert volume(moved) == pytest.approx(abs(np.linalg.det(np.asarray(matrix)[:, :3])) * volume(CLOSED[name][0]))
    corners = moved.vertices[moved.triangles]
    assert ((moved.normals * flat_normals(corners)[:, None]).sum(axis=(1, 2)) > 0).all()
    if name == "box":
        unit = moved.normals / np.linalg.norm(moved.normals, axis=2, keepdims=True)
        assert unit == pytest.approx(np.repeat(flat_normals(corners)[:, None], 3, axis=1), abs=1e-12)


def test_balls_have_their_radii_as_normals():
    shape = ball((1, 2, 3), 0.5, num_rings=8)
    assert shape.normals == pytest.approx((shape.vertices[shape.triangles] - (1, 2, 3)) / 0.5)


def test_sheets_and_grids():
    shape = sheet((1, 0, 0), (2, 0, 0), (0, 3, 0), repeats=(4, 5))
    assert (flat_normals(shape.vertices[shape.triangles]) == (0, 0, 1)).all()
    assert shape.uvs.reshape(-1, 2).min(axis=0).tolist() == [0, 0]
    assert shape.uvs.reshape(-1, 2).max(axis=0).tolist() == [4, 5]
    # v = 0 is the texture's upper edge, which is at the end of the second edge.
    assert (shape.vertices[shape.triangles][shape.uvs[..., 1] == 0][:, 1] == 3).all()
    flat = grid(lambda u, v: np.stack([u, v, 0 * u], axis=-1), 3, 4)
    assert len(flat.triangles) == 24
    assert flat.normals == pytest.approx(np.tile((0, 0, 1.0), (24, 3, 1)))


def test_tubes_are_round():
    path = np.array([(0, 0, 0), (0, 1, 0), (0.5, 2, 0.5)])
    shape = tube(path, 0.1, 12)
    assert len(shape.triangles) == 2 * 2 * 12
    assert np.linalg.norm(shape.vertices[:12] - path[0], axis=1) == pytest.approx(0.1)
    middle = shape.vertices[shape.triangles].mean(axis=1)
    nearest = np.abs(middle[:, None] - path).sum(axis=2).argmin(axis=1)
    assert ((middle - path[nearest]) * flat_normals(shape.vertices[shape.triangles])).sum(axis=1).min() > -0.05
    assert volume(shape) > 0


def test_smooth_normals_keep_creases():
    shape = box((0, 0, 0), (1, 1, 1))
    flat = np.repeat(flat_normals(shape.vertices[shape.triangles])[:, None], 3, axis=1)
    assert smooth_normals(shape.vertices, shape.triangles, crease_deg=30) == pytest.approx(flat)
    rounded = smooth_normals(shape.vertices, shape.triangles)
    assert (rounded * flat).sum(axis=2).max() < 0.95
    assert np.linalg.norm(rounded, axis=2) == pytest.approx(1)


def test_joined_counts_on():
    parts = [(box((0, 0, 0), (1, 1, 1)), 2), (ball((3, 0, 0), 1.0, num_rings=4), 5)]
    mesh = joined("two", parts)
    assert mesh.num_triangles == 12 + 48
    assert mesh.material_ids.tolist() == [2] * 12 + [5] * 48
    assert mesh.vertices[mesh.triangles[12:]].min() >= -1
    assert mesh.vertices[mesh.triangles[12:], 0].min() >= 2


def test_patterns_repeat():
    """Across the edge a texture changes no more than elsewhere."""
    values = noise(64, cells=4, octaves=3, seed=1)
    for axis in (0, 1):
        inside = np.abs(np.diff(values, axis=axis)).max()
        assert np.abs(np.take(values, 0, axis) - np.take(values, -1, axis)).max() <= inside * 1.5
    assert 0 <= values.min() < 0.4 < 0.6 < values.max() <= 1
    wall = bricks("b", (0.5, 0, 0), (0.6, 0, 0), (0, 0, 1.0), size=64).pixels
    assert wall.shape == (64, 64, 4)
    assert set(map(bool, wall[..., 2].ravel() > 100)) == {True, False}
    assert planks("p", (0, 0, 0), (1, 1, 1)).pixels.std() > 10
