"""From triangles to the transforms that the chip tests rays with."""

import numpy as np

__all__ = ["pack_fields", "turned", "unit_triangle_maps", "unpack_fields", "weights"]


def turned(corners):
    """Triangles turned so that their longest edge lies across from C, and what their maps see of it.

    Of the three edges that is the one of which no coordinate of the unit triangle is the distance: it is u + v = 1, and
    what is known of u + v is what is known of u and of v. These are distances in units of the triangle's heights over
    the two other edges, so it is known well if the height over the third is the least.

    Parameters
    ----------
    corners : float64[T, 3, 3]
        v0, v1, v2 of each triangle.

    Returns
    -------
    corners : float64[T, 3, 3]
        The same, beginning with another, and as they go round.
    first : int8[T]
        The one that they begin with; 0 where edges are equally long.
    """
    across = corners[:, [2, 0, 1]] - corners[:, [1, 2, 0]]
    first = np.einsum("tij,tij->ti", across, across).argmax(axis=1)
    order = (first[:, None] + np.arange(3)) % 3
    return np.take_along_axis(corners, order[:, :, None], axis=1), first.astype(np.int8)


def weights(first, u, v):
    """The weights of v1 and v2 by those of a turned triangle's second and third corner: float64[N] each."""
    third = 1 - u - v
    return np.choose(first, (u, third, v)), np.choose(first, (v, u, third))


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
