"""Rays at a scene's own edges: which edges are shared, and that leaks are found where there are any."""

import numpy as np
import pytest

import sim.stability.chip as chip
from fpu import FloatFormat
from sim.stability.meshes import ball, cube
from sim.stability.real import KINDS, Count, SceneEdges
from sim.stability.truth import scene_of

FMT = FloatFormat(7, 16)
RAYS = 8000


def edges_of(corners):
    return SceneEdges(scene_of(corners), fmt=FMT)


@pytest.fixture(scope="module")
def rough():
    return edges_of(ball(16, roughness=0.3, rng=np.random.default_rng(2)).corners)


def test_edges_of_a_closed_mesh(rough):
    """Euler: three edges for every two triangles."""
    assert rough.num_triangles == 8 * 16**2
    assert rough.num_edges == rough.num_triangles * 3 // 2


def test_edges_of_two_triangles_alone():
    square = cube(2).corners[:2]
    assert edges_of(square).num_edges == 1
    turned = square.copy()
    turned[1] = turned[1, ::-1]
    for corners in (square, turned):
        flat = edges_of(corners)
        # No vertex is without a loose edge, and a flat fold is seen from both its triangles' fronts.
        assert flat.measure("vertices", 100, np.random.default_rng(1)) == Count()
        assert flat.measure("silhouettes", 400, np.random.default_rng(1)).rays > 300


def test_nothing_shared():
    with pytest.raises(ValueError, match=r"^no two triangles share an edge$"):
        edges_of(cube(2).corners[:1])


@pytest.mark.parametrize("kind", KINDS)
def test_leaks_are_found(rough, kind, monkeypatch):
    found = {}
    for tolerance in (0, 8):
        monkeypatch.setattr(chip, "_TOLERANCE", tolerance)
        found[tolerance] = rough.measure(kind, RAYS, np.random.default_rng(3))
        assert 0.3 * RAYS < found[tolerance].rays <= RAYS
    assert found[0].cracks > 100
    assert found[8].cracks == 0
    assert found[8].odd == 0


def test_counts_add_up():
    assert Count(1, 2, 3, 4, 5) + Count(10, 20, 30, 40, 50) == Count(11, 22, 33, 44, 55)
