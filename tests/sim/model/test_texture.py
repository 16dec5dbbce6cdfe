"""The model's texture lookups against exact fractions and against the golden tracer's."""

import random

import numpy as np
import pytest

from fpu import FloatFormat
from sim.golden import texture as golden
from sim.model.texture import sample_texture
from sim.scene.texture_memory import pack_texture
from tests.rtl import textures

FMT = FloatFormat(7, 16)
SIZES = [(1, 1), (1, 8), (8, 1), (2, 2), (64, 16), (4, 128)]
BASE = 20


def random_pixels(width, height, seed):
    return np.random.default_rng(seed).integers(0, 256, (height, width, 4), dtype=np.uint8)


def stored(pixels):
    """Texture memory with a texture at :data:`BASE`."""
    return np.concatenate([np.full(BASE, 0xdeadbeef, np.uint32), pack_texture(pixels)])


def packed(width, height, *, filtered, folded=False):
    return width.bit_length() - 1 | height.bit_length() - 1 << 4 | filtered << 8 | folded << 9


@pytest.mark.parametrize(("width", "height"), [*SIZES, (4096, 2)])
def test_words_of_a_texture(width, height):
    pixels = random_pixels(width, height, 1)
    words = pack_texture(pixels)
    assert words.dtype == np.uint32
    assert words.tolist() == textures.packed_words(pixels.tolist())


@pytest.mark.parametrize("filtered", [False, True])
@pytest.mark.parametrize(("width", "height", "folded"), [
    *((*size, False) for size in [*SIZES, (4096, 4096)]), *((size, size, True) for size in (1, 2, 16, 4096))])
def test_lookup_is_exact(width, height, folded, filtered):
    rng = random.Random(width * height)
    pixels = random_pixels(width, height, 2)
    rows, texels = pixels if width * height > 1 << 20 else pixels.tolist(), stored(pixels)
    places = [textures.interesting_coordinates(fmt, side, rng, 400)
              for side in (width, height) for fmt in (FMT, FloatFormat(8, 23))]
    for s, t in (*zip(places[0], places[2], strict=True), *zip(places[1], places[3], strict=True)):
        got = sample_texture(texels, BASE, packed(width, height, filtered=filtered, folded=folded), s, t)
        assert got == textures.look_up(rows, s, t, filtered=filtered, folded=folded), (s, t)


@pytest.mark.parametrize(("width", "height"), SIZES)
def test_lookup_is_near_golden(width, height):
    rng = random.Random(3)
    pixels = random_pixels(width, height, 4)
    layout = np.array([0, width, height, 1])
    places = [textures.interesting_coordinates(FMT, side, rng, 500) for side in (width, height)]
    # Of a pair with an infinity the chip takes the other as it is, golden none.
    for s, t in (pair for pair in zip(*places, strict=True) if np.isfinite(pair).all()):
        got = np.array(sample_texture(stored(pixels), BASE, packed(width, height, filtered=True), s, t)) / 65536
        want = golden.sample(pixels.reshape(-1, 4), layout, golden.DECODED, s, t)
        assert got == pytest.approx(want, abs=2.0**-7), (s, t)


def test_unfiltered_lookup_is_golden():
    """Nothing is rounded but the texel's colours."""
    rng = random.Random(4)
    pixels = random_pixels(64, 16, 5)
    layout = np.array([0, 64, 16, 0])
    for _ in range(500):
        s, t = FMT.quantize([rng.uniform(-3, 3), rng.uniform(-3, 3)])
        got = np.array(sample_texture(stored(pixels), BASE, packed(64, 16, filtered=False), s, t)) / 65536
        assert got == pytest.approx(golden.sample(pixels.reshape(-1, 4), layout, golden.DECODED, s, t), abs=2.0**-17)


@pytest.mark.parametrize("size", [1, 2, 4, 32])
def test_edges_of_a_sky_are_golden(size):
    """With no texel like another, the middle between four is told by its colour."""
    pixels = random_pixels(size, size, 6)
    texels = pixels.reshape(-1, 4)
    corners = [(column, row) for column in range(-1, size) for row in range(-1, size)
               if column in (-1, size - 1) or row in (-1, size - 1)]
    for column, row in corners:
        # Right in the middle between four, but for what the clamp at 1 takes off.
        s, t = ((place + 1) / size for place in (column, row))
        numbers = [golden._folded(column + i, row + j, size) for i in (0, 1) for j in (0, 1)]
        want = np.mean([[*golden.DECODED[texels[number, :3]], texels[number, 3] / 255] for number in numbers], axis=0)
        got = np.array(sample_texture(stored(pixels), BASE, packed(size, size, filtered=True, folded=True), s, t))
        assert got / 65536 == pytest.approx(want, abs=2.0**-7)


def test_white_stays_white():
    texels = pack_texture(np.full((8, 8, 4), 255, np.uint8))
    for s in np.linspace(-1, 2, 97):
        assert sample_texture(texels, 0, packed(8, 8, filtered=True), s, s / 3) == (65536,) * 4
