"""From triangles to the transforms that the chip tests rays with."""

import numpy as np

__all__ = ["pack_fields", "unit_triangle_maps", "unpack_fields"]


def unit_triangle_maps(corners, *, normal_scale):
    """The maps X ↦ m·(X − C) that take each triangle to the unit triangle (paper §2.1.1).

    C = v0 goes to the origin, v1 to (1, 0, 0), v2 to (0, 1, 0); so u and v are the weights of v1 and v2. The third
    row of m is the unit normal times ``normal_scale``: t does not depend on its length, and D′z becomes the cosine
    between ray and normal in whatever unit is wanted. (The paper's matrix has N − C there, which is a slip: a
    direction takes no translation.)

    Parameters
    ----------
    corners : float64[T, 3, 3]
        v0, v1, v2 of each triangle, already members of the chip's format.
    normal_scale : float64[T, 3, 3] or float
        Factor of the third row, or the matrix that it is multiplied with from the right.

    Returns
    -------
    rows : float64[T, 3, 3]
    centers : float64[T, 3]
    usable : bool[T]
        False where the triangle has no area.
    """
    edge1 = corners[:, 1] - corners[:, 0]
    edge2 = corners[:, 2] - corners[:, 0]
    normal = np.cross(edge1, edge2)
    area = np.linalg.norm(normal, axis=1)
    longest = np.maximum(np.linalg.norm(edge1, axis=1), np.linalg.norm(edge2, axis=1))
    usable = area > 4 * np.finfo(np.float64).eps * longest**2
    area = np.where(usable, area, 1.0)[:, None]
    unit = normal / area
    rows = np.stack([np.cross(edge2, unit), np.cross(unit, edge1), unit], axis=1)
    rows[:, :2] /= area[:, :, None]
    if np.ndim(normal_scale):
        rows[:, 2] = np.einsum("ti,tij->tj", unit, normal_scale)
    else:
        rows[:, 2] *= normal_scale
    return rows, corners[:, 0], usable


def pack_fields(fields, width):
    """Rows of ``width``-bit fields, least significant first, in rows of 32-bit words.

    Parameters
    ----------
    fields : int array[N, K]
    width : int
        Bits of a field, at most 32.

    Returns
    -------
    uint32[N, ceil(K·width / 32)]
    """
    count, per_row = fields.shape
    words = np.zeros((count, -(-per_row * width // 32) + 1), np.uint64)
    for k in range(per_row):
        word, shift = divmod(k * width, 32)
        value = fields[:, k].astype(np.uint64) << np.uint64(shift)
        words[:, word] |= value & np.uint64(0xFFFFFFFF)
        words[:, word + 1] |= value >> np.uint64(32)
    return words[:, :-1].astype(np.uint32)


def unpack_fields(words, width, count=12):
    """What :func:`pack_fields` has packed, int64[N, count]."""
    padded = np.concatenate([words, np.zeros((len(words), 1), np.uint32)], axis=1).astype(np.uint64)
    fields = np.empty((len(words), count), np.int64)
    for k in range(count):
        word, shift = divmod(k * width, 32)
        pair = padded[:, word] | padded[:, word + 1] << np.uint64(32)
        fields[:, k] = pair >> np.uint64(shift) & np.uint64((1 << width) - 1)
    return fields
