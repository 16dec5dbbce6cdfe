"""Texture lookups as the chip does them."""

import math

import numpy as np

from rtl.srgb import linear_colors

from .compiled import compiled

__all__ = ["sample_texture"]

_LINEAR = np.array(linear_colors(), dtype=np.int64)


@compiled()
def _place(coordinate, size, folded):
    """Place of a coordinate, in 1/256 of one of ``size`` texels from the edge of the first, rounded down."""
    limit = size << 8
    if math.isinf(coordinate):
        return 0
    if folded:
        return min(int(min(max(coordinate, 0.0), 1.0) * limit), limit - 1)
    # Powers of two times numbers of the chip's formats: exact, however far out or small.
    place = np.floor(coordinate * limit)
    return int(place - np.floor(place / limit) * limit)


@compiled()
def sample_texture(texels, base, packed, s, t):
    """What :class:`~rtl.texture.Texture` answers, bit for bit.

    Parameters
    ----------
    texels : uint32[:]
        Texture memory, see :func:`~sim.scene.texture_memory.pack_texture`.
    base : int
        Where the texture starts, a multiple of 4.
    packed : int
        log2(width) | log2(height) << 4 | filtered << 8 | folded << 9.
    s, t : float
        Coordinates, values of the chip's format.

    Returns
    -------
    tuple of int
        Red, green, blue, opacity, in units of 2^-16.
    """
    width, height = 1 << (packed & 15), 1 << (packed >> 4 & 15)
    filtered, folded = packed >> 8 & 1, packed >> 9 & 1
    x, y = _place(s, width, folded), _place(t, height, folded)
    if filtered:
        x, y = x - 128, y - 128
    left, upper = x >> 8, y >> 8
    f, g = (x & 255, y & 255) if filtered else (0, 0)
    red = green = blue = opacity = 1 << 15
    for corner in range(4 if filtered else 1):
        column, row = left + (corner & 1), upper + (corner >> 1)
        weight = (f if corner & 1 else 256 - f) * (g if corner >> 1 else 256 - g)
        # Beyond one edge lies the same edge mirrored, beyond two the opposite corner.
        mirrored = folded != 0 and (0 <= column < width) != (0 <= row < height)
        column, row = column & width - 1, row & height - 1
        if mirrored:
            column, row = width - 1 - column, height - 1 - row
        block = (row >> 1) * (max(width, 2) >> 1) + (column >> 1)
        texel = np.int64(texels[base + 4 * block + 2 * (row & 1) + (column & 1)])
        red += weight * _LINEAR[texel & 255]
        green += weight * _LINEAR[texel >> 8 & 255]
        blue += weight * _LINEAR[texel >> 16 & 255]
        opacity += weight * ((texel >> 24) * 257 + (texel >> 31))
    return red >> 16, green >> 16, blue >> 16, opacity >> 16
