"""Texels by the chip's integers (docs/shading.md, section 8)."""

import numpy as np

from ..scene.texels import FILTERED, FOLDED
from .compiled import compiled

__all__ = ["texel"]

_FRACTION_BITS = 24


@compiled()
def _fraction(s):
    """s less the whole number below, in units of 2⁻²⁴, cut."""
    if not abs(s) < 2.0**30:
        return 0
    return np.int64(np.floor(s * 2.0**_FRACTION_BITS)) & (1 << _FRACTION_BITS) - 1


@compiled()
def _wrapped(i, j, width, height, folded):
    if not folded:
        return i & width - 1, j & height - 1
    if i < 0 or i >= width:
        i, j = min(max(i, 0), width - 1), height - 1 - j
    if j < 0 or j >= height:
        i, j = width - 1 - i, min(max(j, 0), height - 1)
    return i, j


@compiled()
def texel(texels, colors, base, size, s, t, result):
    """Fills ``result`` int64[4] with the linear colours and the opacity at (s, t).

    Parameters
    ----------
    texels : uint32[K]
    colors : int64[256]
        :func:`rtl.srgb.linear_colors`.
    base, size : int
        The texture's descriptor.
    """
    width, height = 1 << (size & 15), 1 << (size >> 4 & 15)
    columns = max(width, 2) >> 1
    x, y = _fraction(s) * width, _fraction(t) * height
    result[:] = 0
    if not size & FILTERED:
        i, j = x >> _FRACTION_BITS, y >> _FRACTION_BITS
        f = g = 0
    else:
        x, y = (x >> _FRACTION_BITS - 8) - 128, (y >> _FRACTION_BITS - 8) - 128
        i, j, f, g = x >> 8, y >> 8, x & 255, y & 255
    total0 = total1 = total2 = total3 = 0
    for k in range(4):
        across, down = k & 1, k >> 1
        weight = (f if across else 256 - f) * (g if down else 256 - g)
        if not weight:
            continue
        a, b = _wrapped(i + across, j + down, width, height, size & FOLDED != 0)
        word = int(texels[base + 4 * ((b >> 1) * columns + (a >> 1)) + 2 * (b & 1) + (a & 1)])
        total0 += weight * colors[word & 255]
        total1 += weight * colors[word >> 8 & 255]
        total2 += weight * colors[word >> 16 & 255]
        total3 += weight * ((2 * 65536 * (word >> 24) + 255) // 510)
    result[0], result[1] = total0 + 32768 >> 16, total1 + 32768 >> 16
    result[2], result[3] = total2 + 32768 >> 16, total3 + 32768 >> 16
