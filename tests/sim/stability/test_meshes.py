"""The meshes are closed, of the size they say, and their points lie on them."""

import numpy as np
import pytest

from sim.stability.meshes import Surface, ball, cube, ribbon, slab


def made(name):
    rng = np.random.default_rng(2)
    return {"ball": lambda: ball(5, roughness=0.3, rng=rng), "cube": lambda: cube(3),
            "slab": lambda: slab(4, thickness=0.2, rng=rng)}[name]()


@pytest.mark.parametrize(("name", "num_triangles"), [("ball", 8 * 25), ("cube", 6 * 9 * 2), ("slab", 6 * 16 * 2)])
def test_closed(name, num_triangles):
    mesh = made(name)
    assert len(mesh.triangles) == num_triangles
    assert mesh.num_open_edges == 0
    # Euler's formula for a sphere, and each edge between two triangles.
    assert len(mesh.vertices) - len(mesh.edges) + num_triangles == 2
    # Outwards: the volume by the divergence theorem is that of the shape.
    volume = np.linalg.det(mesh.corners).sum() / 6
    assert volume == pytest.approx({"ball": 4.0, "cube": 8.0, "slab": 0.8}[name], rel=0.1)
    ends, sides = mesh.folds.swapaxes(0, 1)
    for edge, (first, second) in zip(ends, sides, strict=True):
        assert set(edge) <= set(mesh.triangles[first]) & set(mesh.triangles[second])
    assert (sides[:, 0] != sides[:, 1]).all()


def test_an_open_mesh_is_known():
    mesh = made("cube")
    assert Surface(mesh.vertices, mesh.triangles[1:]).num_open_edges == 3
    assert ribbon(4, 0.1).num_open_edges == 22


@pytest.mark.parametrize("aspect", [1e1, 1e6])
def test_ribbon(aspect):
    corners = ribbon(8, 1 / aspect).corners
    edges = np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2)
    aspects = edges.max(axis=1) / edges.min(axis=1)
    assert np.count_nonzero(aspects > 1.5 * aspect) == 32
    area = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1).sum() / 2
    assert area == pytest.approx(2 * np.hypot(2, 0.8))


def test_points():
    mesh, rng = made("cube"), np.random.default_rng(4)
    for points in (mesh.on_edges(100, rng), mesh.on_vertices(100, rng), mesh.inside(100, rng)):
        assert np.abs(points).max(axis=1) == pytest.approx(1)
    assert {tuple(vertex) for vertex in mesh.on_vertices(50, rng)} <= {tuple(vertex) for vertex in mesh.vertices}
