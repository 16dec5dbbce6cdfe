"""Looking up textures and skies (docs/shading.md, sections 8 and 9)."""

import math

import numpy as np

from .compiled import compiled

__all__ = ["DECODED", "sample", "sky_color"]

#: Linear light of each sRGB-encoded byte.
DECODED = np.array([n / 255 / 12.92 if n / 255 <= 0.04045 else ((n / 255 + 0.055) / 1.055) ** 2.4 for n in range(256)])


@compiled()
def _mixed(texels, decoded, corners, f, g):
    """Bilinear mean of four texels, colours decoded: f to the right, g down."""
    weights = (1.0 - f) * (1.0 - g), f * (1.0 - g), (1.0 - f) * g, f * g
    red = green = blue = alpha = 0.0
    for k in range(4):
        texel = texels[corners[k]]
        red += weights[k] * decoded[texel[0]]
        green += weights[k] * decoded[texel[1]]
        blue += weights[k] * decoded[texel[2]]
        alpha += weights[k] * texel[3]
    return red, green, blue, alpha / 255.0


@compiled()
def sample(texels, layout, decoded, s, t):
    """Linear (red, green, blue, opacity) of a repeating texture at coordinates s, t.

    Parameters
    ----------
    texels : uint8[K, 4]
        All textures' texels, row after row.
    layout : int64[4]
        Where the texture starts, its width, height, and 1 if it is filtered.
    decoded : float64[256]
        See :data:`DECODED`.
    """
    base, width, height = layout[0], layout[1], layout[2]
    if not (math.isfinite(s) and math.isfinite(t)):
        s = t = 0.0
    # Whole repeats are taken off first, so that indices of far-out coordinates fit.
    x, y = (s - np.floor(s)) * width, (t - np.floor(t)) * height
    if not layout[3]:
        texel = texels[base + min(int(y), height - 1) * width + min(int(x), width - 1)]
        return decoded[texel[0]], decoded[texel[1]], decoded[texel[2]], texel[3] / 255.0
    x, y = x - 0.5, y - 0.5
    i, j = np.floor(x), np.floor(y)
    left, upper = int(i) % width, int(j) % height
    right, lower = (left + 1) % width, (upper + 1) % height
    corners = (base + upper * width + left, base + upper * width + right, base + lower * width + left,
               base + lower * width + right)
    return _mixed(texels, decoded, corners, x - i, y - j)


@compiled()
def _folded(i, j, size):
    """Number of texel (column i, row j) of an octahedron's map, each at most one beyond an edge."""
    if i < 0 or i >= size:
        i, j = min(max(i, 0), size - 1), size - 1 - j
    if j < 0 or j >= size:
        i, j = size - 1 - i, min(max(j, 0), size - 1)
    return j * size + i


@compiled()
def sky_color(texels, size, decoded, direction):
    """Linear colour of a sky's map uint8[size², 4] in a direction of any length."""
    x, y, z = direction
    m = abs(x) + abs(y) + abs(z)
    if not 0.0 < m < math.inf:
        return 0.0, 0.0, 0.0
    p, q = x / m, y / m
    if z < 0.0:
        p, q = (1.0 - abs(q)) * (-1.0 if p < 0.0 else 1.0), (1.0 - abs(p)) * (-1.0 if q < 0.0 else 1.0)
    x, y = (p + 1.0) / 2.0 * size - 0.5, (q + 1.0) / 2.0 * size - 0.5
    i, j = np.floor(x), np.floor(y)
    a, b = int(i), int(j)
    corners = (_folded(a, b, size), _folded(a + 1, b, size), _folded(a, b + 1, size), _folded(a + 1, b + 1, size))
    red, green, blue, _ = _mixed(texels, decoded, corners, x - i, y - j)
    return red, green, blue
