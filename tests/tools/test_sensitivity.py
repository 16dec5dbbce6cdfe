"""Golden with its samples moved, on an edge whose place is known."""

import numpy as np

from sim.golden import psnr, render_golden
from sim.scene import Camera, Material
from tests.sim.golden.rooms import quad, scene_of
from tools.sensitivity import MovedPictures, flip

SIZE = 16, 12
#: An upright edge, so many pixels to the right of the middle of column 8.
BEYOND = 0.03


def half_white():
    """White to the right of an edge, black to the left, and what it looks like."""
    # The camera is one unit away, and its picture two units wide.
    edge = 2 * (8.5 + BEYOND) / SIZE[0] - 1
    white = Material("white", (0.0, 0.0, 0.0), emission=(1.0, 1.0, 1.0))
    scene = scene_of(quad([(edge, -2, 0), (2, -2, 0), (2, 2, 0), (edge, 2, 0)], white))
    return scene, Camera((0, 0, 1), (0, 0, 0), (0, 1, 0), 90.0)


def test_an_edge_beside_the_samples():
    scene, camera = half_white()
    golden = render_golden(scene, camera, *SIZE, shading="full").color
    assert (golden[:, :9] == 0).all()
    assert (golden[:, 9:] == 255).all()
    moved = MovedPictures(scene, camera, SIZE, depth=4)
    assert (moved.at(BEYOND / 2) == golden).all()
    assert moved.psnr(golden, BEYOND / 2) == np.inf
    # Of eight directions, one goes straight over the edge, and two aslant.
    assert (moved.at(1.1 * BEYOND)[..., 8, 0] == 255).all(axis=1).sum() == 1
    assert (moved.at(1.5 * BEYOND)[..., 8, 0] == 255).all(axis=1).sum() == 3
    assert moved.psnr(golden, 1.5 * BEYOND) == psnr(np.uint8([255] * 3 + [0] * 125), np.zeros(128, np.uint8))


def test_what_an_edge_explains():
    scene, camera = half_white()
    golden = render_golden(scene, camera, *SIZE, shading="full").color
    moved = MovedPictures(scene, camera, SIZE, depth=4)
    picture = golden.copy()
    picture[3, 8] = 250
    picture[3, 9] = 0
    picture[3, 4] = 7
    picture[5, 8] = 128
    for reach, explained in ((BEYOND / 2, False), (2 * BEYOND, True)):
        found = moved.explains(picture, reach, levels=8)
        assert found[3, 8] == explained
        # The edge is a pixel away from one, and shows no grey to the other.
        assert not found[3, 9]
        assert not found[5, 8]
        assert found[3, 4]
        assert found.sum() == found.size - 2 - (not explained)


def test_flip():
    scene, camera = half_white()
    golden = render_golden(scene, camera, *SIZE, shading="full").color
    assert flip(golden, golden) == 0
    worse = [flip(golden, np.where(np.arange(SIZE[0])[:, None] < columns, 255 - golden, golden))
             for columns in (1, 4, 16)]
    assert 0 < worse[0] < worse[1] < worse[2] <= 1
