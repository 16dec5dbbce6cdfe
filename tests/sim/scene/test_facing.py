"""Triangles that face one way whatever their winding, and what they are turned to for the chip's test."""

import numpy as np
import pytest

from fpu import FloatFormat
from rtl.config import ChipConfig
from sim.model import render_full
from sim.scene.compile import CompiledScene
from sim.scene.facing import facing
from sim.scene.triangles import turned, unit_triangle_maps, weights
from sim.stability.meshes import ball
from sim.stability.truth import scene_of

FMT = FloatFormat(7, 16)


def shuffled(corners, rng):
    """Triangles in another order, each beginning anywhere, some the other way round; and which."""
    corners = corners[rng.permutation(len(corners))]
    corners = np.stack([np.roll(three, rng.integers(3), axis=0) for three in corners])
    is_over = rng.random(len(corners)) < 0.4
    corners[is_over] = corners[is_over, ::-1]
    return corners, is_over


@pytest.mark.parametrize("seed", range(4))
def test_a_closed_surface_faces_in_or_out(seed):
    rng = np.random.default_rng(seed)
    corners, is_over = shuffled(ball(6, roughness=0.2, rng=rng).corners, rng)
    sign = facing(corners, np.ones(len(corners), bool))
    assert set(sign.tolist()) == {1, -1}
    assert len(set((sign * np.where(is_over, -1, 1)).tolist())) == 1


def test_what_may_not_turn_is_gone_by():
    rng = np.random.default_rng(5)
    corners, is_over = shuffled(ball(4, roughness=0.2, rng=rng).corners, rng)
    for fixed in (3, 70):
        may_turn = np.arange(len(corners)) != fixed
        sign = facing(corners, may_turn)
        assert sign[fixed] == 1
        assert (sign == np.where(is_over == is_over[fixed], 1, -1)).all()
    assert (facing(corners, np.zeros(len(corners), bool)) == 1).all()


def test_edges_of_three_and_surfaces_apart_do_not_matter():
    fin = np.array([[(0.0, 0, 0), (1, 0, 0), corner] for corner in ((0, 1, 0), (0, -1, 0), (0, 0, 1))])
    assert (facing(fin, np.ones(3, bool)) == 1).all()
    assert (facing(np.concatenate([fin[:1], fin[:1, ::-1] + 5]), np.ones(2, bool)) == 1).all()
    assert facing(fin[:2], np.ones(2, bool)).tolist() == [1, -1]
    assert facing(fin[:0], np.ones(0, bool)).tolist() == []


def test_the_longest_edge_is_u_and_v_are_1():
    rng = np.random.default_rng(7)
    corners = rng.normal(size=(200, 3, 3))
    found, first = turned(corners)
    assert set(first.tolist()) == {0, 1, 2}
    for before, after, k in zip(corners, found, first, strict=True):
        assert (np.roll(before, -k, axis=0) == after).all()
        lengths = [np.linalg.norm(after[j] - after[i]) for i, j in ((1, 2), (0, 1), (0, 2))]
        assert lengths[0] == max(lengths)
    # Rows of u and v are over the two others: their sum is not known less well than the third distance.
    rows = unit_triangle_maps(found, normal_scale=1.0)[0]
    sizes = np.linalg.norm(rows, axis=2)
    assert (np.linalg.norm(rows[:, 0] + rows[:, 1], axis=1) > 0.999 * sizes[:, :2].max(axis=1)).all()


def test_weights_are_those_of_the_mesh():
    rng = np.random.default_rng(8)
    corners = rng.normal(size=(200, 3, 3))
    found, first = turned(corners)
    u, v = rng.uniform(0, 0.5, (2, 200))
    points = found[:, 0] + u[:, None] * (found[:, 1] - found[:, 0]) + v[:, None] * (found[:, 2] - found[:, 0])
    u, v = weights(first, u, v)
    again = corners[:, 0] + u[:, None] * (corners[:, 1] - corners[:, 0]) + v[:, None] * (corners[:, 2] - corners[:, 0])
    assert np.abs(points - again).max() < 1e-12


def test_pictures_do_not_know_of_winding():
    rng = np.random.default_rng(9)
    corners = ball(5, roughness=0.2, rng=rng).corners
    frames = []
    for is_mixed in (False, True):
        if is_mixed:
            over = rng.random(len(corners)) < 0.5
            corners[over] = corners[over][:, [0, 2, 1]]
        scene = scene_of(corners)
        camera = scene.default_camera()
        image = CompiledScene(scene, fmt=FMT).image(scene, eye=camera.eye, is_full=True)
        frames.append(render_full(image, camera, 64, 48, config=ChipConfig(shader=image.needs)))
    one, other = frames
    is_hit = one.prim_id >= 0
    same = is_hit & (one.prim_id == other.prim_id)
    assert is_hit.sum() > 400
    assert same.sum() > 0.97 * is_hit.sum()
    assert (np.abs(one.color.astype(int) - other.color)[same] <= 1).mean() > 0.99
