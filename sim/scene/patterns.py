"""Textures made by formulas, for the built-in scenes."""

import numpy as np

from .srgb import encode
from .texture import Texture

__all__ = ["blend", "bricks", "cells", "noise", "planks", "texture"]


def noise(size, *, cells=8, octaves=4, seed=0, stretch=(1, 1)):
    """Smooth random values in 0…1, float64[size, size], that repeat; each octave twice as fine and half as strong."""
    rng = np.random.default_rng(seed)
    total, weight = np.zeros((size, size)), 0.0
    for octave in range(octaves):
        num = [max(cells * s << octave, 1) for s in stretch]
        values = rng.random(num)
        y, x = (np.arange(size) * n / size for n in num)
        i, j = y.astype(int), x.astype(int)
        f, g = ((t - t.astype(int)) ** 2 * (3 - 2 * (t - t.astype(int))) for t in (y, x))
        f, g = f[:, None], g[None]
        i, j, below, right = i[:, None], j[None], (i[:, None] + 1) % num[0], (j[None] + 1) % num[1]
        total += 0.5**octave * ((1 - f) * ((1 - g) * values[i, j] + g * values[i, right])
                                + f * ((1 - g) * values[below, j] + g * values[below, right]))
        weight += 0.5**octave
    return total / weight


def blend(amount, low, high):
    """Linear RGB float64[…, 3] between two colours, by an array of amounts in 0…1."""
    return np.asarray(low) + np.clip(amount, 0, 1)[..., None] * (np.asarray(high) - np.asarray(low))


def texture(name, linear, *, opacity=1.0):
    """Texture of linear RGB float64[H, W, 3] and opacity."""
    pixels = np.empty((*linear.shape[:2], 4), np.uint8)
    pixels[..., :3] = np.rint(255 * encode(linear))
    pixels[..., 3] = np.rint(255 * np.broadcast_to(opacity, linear.shape[:2]))
    return Texture(name, pixels)


def cells(size, rows, columns, *, shift=0.0):
    """Of a wall of rows × columns stones: ``(row, column, distance to the nearest joint)`` of each texel.

    Every second row is shifted by ``shift`` of a stone. Distances are parts of a row's height.
    """
    y, x = (np.arange(size) + 0.5) / size * rows, (np.arange(size) + 0.5) / size * columns
    row = y.astype(int)[:, None] + np.zeros((1, size), int)
    x = x[None] + shift * (row % 2)
    column = x.astype(int) % columns
    across, up = x % 1, (y % 1)[:, None]
    distance = np.minimum(np.minimum(across, 1 - across) * rows / columns, np.minimum(up, 1 - up))
    return row, column, distance


def bricks(name, low, high, joint, *, rows=8, columns=4, shift=0.5, width=0.07, size=256, seed=0):
    """Stones of colours between two, with joints of a third."""
    row, column, distance = cells(size, rows, columns, shift=shift)
    rng = np.random.default_rng(seed)
    stone = rng.random((rows, columns))[row, column]
    grain = noise(size, cells=16, seed=seed + 1)
    color = blend(0.6 * stone + 0.4 * grain, low, high)
    solid = np.clip((distance - width / 2) / width, 0, 1)[..., None]
    return texture(name, np.asarray(joint) * (0.7 + 0.3 * grain[..., None]) * (1 - solid) + color * solid)


def planks(name, low, high, *, rows=8, columns=2, size=512, seed=0):
    """Boards along u, with grain."""
    row, column, distance = cells(size, rows, columns, shift=0.37)
    rng = np.random.default_rng(seed)
    board = rng.random((rows, columns))[row, column]
    grain = noise(size, cells=2, octaves=6, seed=seed + 1, stretch=(24, 1))
    dark = np.clip(distance / 0.04, 0.35, 1)[..., None]
    return texture(name, blend(0.45 * board + 0.55 * grain, low, high) * dark)
