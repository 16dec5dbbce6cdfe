"""Textures as words of the chip's texture memory."""

import numpy as np

__all__ = ["pack_texture"]


def pack_texture(pixels):
    """Words of a texture: red in the lowest byte, then green, blue, opacity; in blocks of 2×2 texels, row after row.

    Texel (i, j) of W × H is word 4 ((j >> 1) (max(W, 2) >> 1) + (i >> 1)) + 2 (j & 1) + (i & 1). A side of 1 is
    doubled.

    Parameters
    ----------
    pixels : uint8[H, W, 4]
        Sides are powers of two.

    Returns
    -------
    uint32[max(H, 2) · max(W, 2)]
    """
    height, width = pixels.shape[:2]
    pixels = np.tile(pixels, (1 + (height == 1), 1 + (width == 1), 1))
    words = np.ascontiguousarray(pixels).view("<u4")[..., 0].astype(np.uint32)
    blocks = words.reshape(words.shape[0] // 2, 2, words.shape[1] // 2, 2)
    return blocks.swapaxes(1, 2).reshape(-1)
