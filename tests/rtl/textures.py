"""Texture lookups in exact fractions, texel by texel, after docs/shading.md, sections 8 and 9."""

import math
from fractions import Fraction

from . import colors

__all__ = ["address", "interesting_coordinates", "look_up", "packed_words", "place"]

_LINEAR = [colors.linear_color(byte) for byte in range(256)]
_FRACTION = [colors.byte_fraction(byte) for byte in range(256)]


def address(width, column, row):
    """Where a texel of a texture lies in it."""
    return 4 * ((row >> 1) * (max(width, 2) >> 1) + (column >> 1)) + 2 * (row & 1) + (column & 1)


def packed_words(pixels):
    """Words of rows of (red, green, blue, opacity), one after the other."""
    height, width = len(pixels), len(pixels[0])
    words = [None] * (max(width, 2) * max(height, 2))
    for row in range(max(height, 2)):
        for column in range(max(width, 2)):
            texel = pixels[row % height][column % width]
            words[address(width, column, row)] = sum(int(byte) << 8 * place for place, byte in enumerate(texel))
    assert None not in words
    return words


def _within_one(coordinate, folded):
    """The part of a coordinate behind its point, cut to 24 places; of a map that does not repeat, what is nearest."""
    if math.isinf(coordinate):
        return Fraction(0)
    ulp = Fraction(1, 2**24)
    exact = Fraction(coordinate)
    if folded:
        return min(max(math.floor(exact / ulp) * ulp, Fraction(0)), 1 - ulp)
    return math.floor((exact - math.floor(exact)) / ulp) * ulp


def place(coordinate, side, folded):
    """Where it is, in 1/256 of a texel."""
    return math.floor(256 * side * _within_one(coordinate, folded))


def _texel(pixels, column, row, folded):
    size = len(pixels)
    if not folded:
        return pixels[row % size][column % len(pixels[0])]
    if not 0 <= column < size:
        column, row = min(max(column, 0), size - 1), size - 1 - row
    if not 0 <= row < size:
        column, row = size - 1 - column, min(max(row, 0), size - 1)
    return pixels[row][column]


def look_up(pixels, s, t, *, filtered, folded):
    """(red, green, blue, opacity) in units of 2^-16."""
    x, y = (_within_one(coordinate, folded) * side for coordinate, side in ((s, len(pixels[0])), (t, len(pixels))))
    if not filtered:
        red, green, blue, opacity = pixels[math.floor(y)][math.floor(x)]
        return _LINEAR[red], _LINEAR[green], _LINEAR[blue], _FRACTION[opacity]
    x, y = x - Fraction(1, 2), y - Fraction(1, 2)
    i, j = math.floor(x), math.floor(y)
    f, g = (Fraction(math.floor(256 * (value - whole)), 256) for value, whole in ((x, i), (y, j)))
    sums = [Fraction(0)] * 4
    for column, row, weight in ((i, j, (1 - f) * (1 - g)), (i + 1, j, f * (1 - g)), (i, j + 1, (1 - f) * g),
                                (i + 1, j + 1, f * g)):
        texel = _texel(pixels, column, row, folded)
        for channel in range(4):
            sums[channel] += weight * (_FRACTION if channel == 3 else _LINEAR)[texel[channel]]
    return tuple(math.floor(value + Fraction(1, 2)) for value in sums)


def interesting_coordinates(fmt, side, rng, count):
    """Coordinates of a format: middles and edges of texels and what is just below, far out, tiny, anywhere."""
    tiny, below = 2.0**-30, 1 - 2.0**-(fmt.frac_width + 1)
    values = [0.0, -0.0, 1.0, -1.0, below, -below, tiny, -tiny, fmt.min_normal, -fmt.min_normal, fmt.max, -fmt.max,
              math.inf, -math.inf, 0.5, 3 + 0.5 / side, -0.5 / side, 1 - 0.5 / side, 0.5 / side, 12345.678, -12345.678]
    values += [value * 2.0**place for place in range(-27, -15) for value in (1, -1, 1.75, -1.75)]
    while len(values) < count:
        values.append(rng.choice([
            rng.random(), rng.uniform(-3, 3), rng.randrange(-2 * side, 2 * side + 1) / (2 * side),
            rng.choice([1, -1]) * rng.uniform(1, 2) * 2.0**rng.randrange(-28, 28)]))
    return [float(value) for value in fmt.quantize(rng.sample(values, count))]
