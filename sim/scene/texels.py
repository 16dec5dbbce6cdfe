"""The texture memory: words of one texel each, in blocks of 2×2.

Bits 0–7 of a word are red, 8–15 green, 16–23 blue, 24–31 opacity. Texel (column i, row j) of a texture W texels wide
lies at base + 4·((j ≫ 1)·(max(W, 2) ≫ 1) + (i ≫ 1)) + 2·(j & 1) + (i & 1); sides of 1 are doubled. A texture is
described by its base, a multiple of 4, and log₂ W | log₂ H ≪ 4 | filtered ≪ 8 | folded ≪ 9.
"""

import numpy as np

from .error import SceneError
from .texture_memory import pack_texture

__all__ = ["FILTERED", "FOLDED", "pack_textures"]

FILTERED, FOLDED = 1 << 8, 1 << 9


def _size(pixels):
    height, width = pixels.shape[:2]
    return (width.bit_length() - 1) | (height.bit_length() - 1) << 4


def pack_textures(textures, sky):
    """The texture memory.

    Parameters
    ----------
    textures : list of Texture or None
    sky : Sky or None

    Returns
    -------
    descriptors : list of (int, int) or None
        Base and the rest, of each texture.
    sky : (int, int)
        Likewise; (0, 0) for none.
    texels : uint32[K]

    Raises
    ------
    SceneError
        If they are more than a descriptor addresses.
    """
    known, parts, total = {}, [], 0

    def placed(key, pixels):
        nonlocal total
        if key not in known:
            parts.append(pack_texture(pixels))
            known[key] = total
            total += len(parts[-1])
        return known[key]

    descriptors = [None if texture is None else (
        placed(id(texture), texture.pixels), _size(texture.pixels) | (FILTERED if texture.filtered else 0))
        for texture in textures]
    above = (0, 0)
    if sky is not None:
        pixels = np.pad(sky.pixels, ((0, 0), (0, 0), (0, 1)), constant_values=255)
        above = placed(id(sky), pixels), _size(pixels) | FILTERED | FOLDED
    if total > 1 << 24:
        raise SceneError(f"textures have {total:,} texels, more than the {1 << 24:,} that the shader addresses; use "
                         "smaller ones")
    return descriptors, above, np.concatenate([np.zeros(0, np.uint32), *parts])
