"""Texture and sky lookups, against the plain formula."""

import math

import numpy as np
import pytest

from sim.golden.texture import DECODED, sample, sky_color
from sim.scene import Sky
from sim.scene.sky import octahedral_directions


def linear(byte):
    e = byte / 255
    return e / 12.92 if e <= 0.04045 else ((e + 0.055) / 1.055) ** 2.4


def by_the_book(pixels, s, t):
    """Mean of the four texels round (s, t) by the areas opposite them, texel by texel."""
    height, width = pixels.shape[:2]
    x, y = s * width - 0.5, t * height - 0.5
    total = np.zeros(4)
    for column in (math.floor(x), math.floor(x) + 1):
        for row in (math.floor(y), math.floor(y) + 1):
            area = (1 - abs(x - column)) * (1 - abs(y - row))
            texel = pixels[row % height, column % width]
            total += area * np.array([*map(linear, texel[:3]), texel[3] / 255])
    return total


@pytest.mark.parametrize("shape", [(1, 1), (2, 8), (16, 4), (64, 64)])
def test_bilinear_is_the_formula(shape):
    rng = np.random.default_rng(shape[0])
    other, pixels = (rng.integers(0, 256, (*size, 4), dtype=np.uint8) for size in ((4, 4), shape))
    texels = np.concatenate([other.reshape(-1, 4), pixels.reshape(-1, 4)])
    layout = np.array([16, shape[1], shape[0], 1])
    for s, t in rng.uniform(-3, 3, (300, 2)):
        assert sample(texels, layout, DECODED, s, t) == pytest.approx(by_the_book(pixels, s, t), abs=1e-12)


def test_texel_centres_edges_and_repeats():
    pixels = np.zeros((2, 4, 4), np.uint8)
    pixels[0, 1] = pixels[1, 3] = (255, 0, 0, 255)
    texels, layout = pixels.reshape(-1, 4), np.array([0, 4, 2, 1])
    assert sample(texels, layout, DECODED, 1.5 / 4, 0.25)[0] == 1
    assert sample(texels, layout, DECODED, 1.5 / 4 - 7, 0.25 + 9)[0] == 1
    assert sample(texels, layout, DECODED, 2 / 4, 0.25)[0] == 0.5
    # The left edge is half way between the last column and the first.
    assert sample(texels, layout, DECODED, 0.0, 0.75)[0] == 0.5
    assert sample(texels, layout, DECODED, 1.0, 0.75)[0] == 0.5
    assert sample(texels, layout, DECODED, 1.5 / 4, 0.5)[0] == 0.5
    for odd in (math.inf, -math.inf, math.nan, 1e300):
        assert 0 <= sample(texels, layout, DECODED, odd, 0.3)[0] <= 1


def test_unfiltered_takes_the_texel_it_is_in():
    rng = np.random.default_rng(3)
    pixels = rng.integers(0, 256, (8, 4, 4), dtype=np.uint8)
    layout = np.array([0, 4, 8, 0])
    for s, t in rng.uniform(-2, 2, (200, 2)):
        texel = pixels[math.floor(t * 8) % 8, math.floor(s * 4) % 4]
        assert sample(pixels.reshape(-1, 4), layout, DECODED, s, t) == pytest.approx(
            [*map(linear, texel[:3]), texel[3] / 255])


def sky_at(sky, direction):
    texels = np.pad(sky.pixels.reshape(-1, 3), ((0, 0), (0, 1)))
    return sky_color(texels, len(sky.pixels), DECODED, tuple(float(x) for x in direction))


def test_sky_has_its_texels_where_octahedral_directions_says():
    rng = np.random.default_rng(4)
    sky = Sky(rng.integers(0, 256, (8, 8, 3), dtype=np.uint8))
    for row, column in np.ndindex(8, 8):
        direction = octahedral_directions(8)[row, column] * rng.uniform(0.01, 100)
        assert sky_at(sky, direction) == pytest.approx([linear(byte) for byte in sky.pixels[row, column]], abs=1e-12)


def test_sky_is_what_it_was_made_of():
    def color(directions):
        return 0.5 + 0.4 * directions

    sky = Sky.of(color, size=256)
    rng = np.random.default_rng(5)
    directions = rng.normal(size=(2000, 3))
    for direction in np.concatenate([directions, np.eye(3), -np.eye(3)]):
        expected = color(direction / np.linalg.norm(direction))
        assert sky_at(sky, direction) == pytest.approx(expected, abs=0.012)


def test_sky_has_no_seams():
    """Directions a hair apart see nearly the same, most of all where the octahedron's map is folded."""
    sky = Sky.of(lambda directions: 0.5 + 0.5 * np.sin(3 * directions), size=64)
    rng = np.random.default_rng(6)
    for _ in range(2000):
        direction = rng.normal(size=3)
        direction[rng.integers(3)] = 0.0
        step = rng.normal(size=3) * 1e-7
        assert sky_at(sky, direction + step) == pytest.approx(sky_at(sky, direction - step), abs=1e-4)


def test_panorama_comes_out_where_it_is_looked_at():
    panorama = np.zeros((64, 128, 3), np.uint8)
    panorama[:32, :, 2] = 255
    panorama[28:36, 60:68, 0] = 255
    panorama[28:36, 92:100, 1] = 255
    sky = Sky.from_panorama(panorama)
    assert sky_at(sky, (1, 0, 0))[0] > 0.9
    # A quarter to the right of straight ahead, with z up, is −y.
    assert sky_at(sky, (0, -1, 0))[1] > 0.9
    assert sky_at(sky, (0, 0.3, 1))[2] == pytest.approx(1)
    assert sky_at(sky, (0, 0.3, -1)) == (0, 0, 0)
    glTF = Sky.from_panorama(panorama, up=(0, 1, 0))
    assert sky_at(glTF, (0, 0, -1))[0] > 0.9
    assert sky_at(glTF, (1, 0, 0))[1] > 0.9
