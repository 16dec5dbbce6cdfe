"""Which way triangles face: neighbours the same way, however a mesh winds them."""

import numba
import numpy as np

__all__ = ["facing"]

# Odd, so that no bit of a coordinate is lost.
_MIX = np.array([0x9E3779B97F4A7C15, 0xC2B2AE3D27D4EB4F, 0x165667B19E3779F9], np.uint64)


def _vertices(corners):
    """int64[T, 3]: a number of each corner, equal where all coordinates are."""
    bits = np.ascontiguousarray(corners + 0.0).view(np.uint64)
    # By a hash, as to sort three numbers a corner takes long; what it confuses is some far triangle's way.
    bits = (bits ^ bits >> np.uint64(29)) * _MIX
    bits = (bits ^ bits >> np.uint64(32)).sum(axis=2, dtype=np.uint64)
    return np.unique(bits, return_inverse=True)[1].reshape(bits.shape)


def _neighbours(vertices):
    """int64[T, 3] and bool[T, 3]: across each edge the triangle if there is just one, else −1; whether both run along
    it in the same direction."""
    start, end = vertices.ravel(), np.roll(vertices, -1, axis=1).ravel()
    key = np.minimum(start, end) * (vertices.max(initial=0) + 1) + np.maximum(start, end)
    order = np.argsort(key, kind="stable")
    first = np.flatnonzero(np.append(True, key[order][1:] != key[order][:-1])[:len(key)])
    first = first[np.diff(np.append(first, len(key))) == 2]
    one, other = order[first], order[first + 1]
    across, same = np.full(len(key), -1), np.zeros(len(key), np.bool_)
    across[one], across[other] = other // 3, one // 3
    same[one] = same[other] = start[one] == start[other]
    return across.reshape(-1, 3), same.reshape(-1, 3)


@numba.njit(cache=True)
def _spread(across, same, may_turn):
    sign = np.zeros(len(across), np.int8)
    stack = np.empty(len(across), np.int64)
    for is_free in (False, True):
        for seed in range(len(across)):
            if sign[seed] or may_turn[seed] != is_free:
                continue
            sign[seed] = 1
            stack[0], waiting = seed, 1
            while waiting:
                waiting -= 1
                triangle = stack[waiting]
                for k in range(3):
                    other = across[triangle, k]
                    if other >= 0 and not sign[other]:
                        turn = -1 if same[triangle, k] else 1
                        sign[other] = turn * sign[triangle] if may_turn[other] else 1
                        stack[waiting] = other
                        waiting += 1
    return sign


def facing(corners, may_turn):
    """Signs of triangles' normals with which neighbours look to the same side of the surface that they make.

    Neighbours are two triangles that have an edge with no third. Where a surface has but one side, some of them
    differ.

    Parameters
    ----------
    corners : float64[T, 3, 3]
    may_turn : bool[T]
        Others keep their sign, and their neighbours go by them.

    Returns
    -------
    int8[T]
        1, or −1 where the normal is to be turned.
    """
    return _spread(*_neighbours(_vertices(corners)), may_turn)
