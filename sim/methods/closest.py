"""The closest hit of each ray by a method, tested against all triangles whose widened boxes it meets."""

from dataclasses import dataclass
from itertools import pairwise

import numba
import numpy as np

from ..golden.bvh import MAX_DEPTH, build_bvh

__all__ = ["Answers", "Pairs", "closest_hits", "near_pairs"]

_STACK_DEPTH = MAX_DEPTH + 1
#: Pairs that are tested at a time.
_BATCH = 1 << 18


@dataclass(frozen=True, eq=False)
class Pairs:
    """Rays and the triangles that each may meet.

    Parameters
    ----------
    first : int64[N + 1]
        Where each ray's pairs begin.
    triangle : int64[P]
    """

    first: np.ndarray
    triangle: np.ndarray

    @property
    def ray(self):
        """int64[P]: the ray of each pair."""
        return np.repeat(np.arange(len(self.first) - 1), np.diff(self.first))


@dataclass(frozen=True, eq=False)
class Answers:
    """Closest hits of rays.

    Parameters
    ----------
    t : float64[N]
        inf for none.
    triangle : int64[N]
        −1 for none.
    is_odd : bool[N]
        Something that is not a number came out of a test.
    """

    t: np.ndarray
    triangle: np.ndarray
    is_odd: np.ndarray

    def of(self, rays):
        """The answers of some rays, by an index array."""
        return Answers(self.t[rays], self.triangle[rays], self.is_odd[rays])


@numba.njit(cache=True, error_model="numpy")
def _meets(lower, upper, origin, direction):
    t_near, t_far = 0.0, np.inf
    for k in range(3):
        if direction[k] == 0.0:
            if origin[k] < lower[k] or origin[k] > upper[k]:
                return False
            continue
        t0, t1 = (lower[k] - origin[k]) / direction[k], (upper[k] - origin[k]) / direction[k]
        t_near, t_far = max(t_near, min(t0, t1)), min(t_far, max(t0, t1))
    return t_near <= t_far * (1 + 1e-12)


@numba.njit(cache=True, parallel=True, error_model="numpy")
def _collect(lower, upper, first, count, items, origins, directions, starts, found):
    """Number of items of each ray if ``found`` is empty, else the items themselves."""
    numbers = np.zeros(len(origins), np.int64)
    for ray in numba.prange(len(origins)):
        stack = np.empty(_STACK_DEPTH, np.int64)
        stack[0] = 0
        waiting = 1
        while waiting:
            waiting -= 1
            node = stack[waiting]
            if not _meets(lower[node], upper[node], origins[ray], directions[ray]):
                continue
            if count[node]:
                for i in range(first[node], first[node] + count[node]):
                    if len(found):
                        found[starts[ray] + numbers[ray]] = items[i]
                    numbers[ray] += 1
            else:
                stack[waiting], stack[waiting + 1] = first[node] + 1, first[node]
                waiting += 2
    return numbers


def near_pairs(corners, origins, directions, *, pad):
    """Every triangle near which a ray comes.

    Parameters
    ----------
    corners : float64[T, 3, 3]
    origins, directions : float64[N, 3]
    pad : float64[T]
        By how much each triangle's box is widened.
    """
    lower, upper = corners.min(axis=1) - pad[:, None], corners.max(axis=1) + pad[:, None]
    tree = build_bvh(lower, upper, np.ones(len(corners), np.bool_))
    arguments = *tree, origins, directions
    numbers = _collect(*arguments, np.zeros(0, np.int64), np.zeros(0, np.int64))
    starts = np.concatenate([[0], np.cumsum(numbers)])
    found = np.empty(starts[-1], np.int64)
    if len(found):
        _collect(*arguments, starts, found)
    return Pairs(starts, found)


def _joined(fmt, ray, tested, reach):
    """Soft hits that another before them, within reach on the same side, makes hits; as if tested by distance."""
    joined = np.zeros(len(ray), np.bool_)
    soft = np.flatnonzero(tested.is_soft)
    order = soft[np.lexsort((tested.t[soft], tested.is_back[soft], ray[soft]))]
    one, other = order[:-1], order[1:]
    bits = fmt.encode(tested.t[order])
    joined[other] = ((ray[one] == ray[other]) & (tested.is_back[one] == tested.is_back[other])
                     & (bits[1:] - bits[:-1] <= reach * 2**fmt.frac_width)
                     & ~(tested.is_loose[one] & tested.is_loose[other]))
    return joined


def closest_hits(method, fmt, corners, origins, directions, pairs, *, excluded=None):
    """The nearest hit of each ray, of equally near ones any.

    Parameters
    ----------
    method : Method
    fmt : FloatFormat
    corners : float64[T, 3, 3]
    origins, directions : float64[N, 3]
        Members of the format.
    pairs : Pairs
    excluded : int[N], optional
        A triangle that each ray does not hit.

    Returns
    -------
    Answers
    """
    stored, usable = method.store(fmt, corners)
    rays = method.begin(fmt, origins, directions)
    t, triangle = np.full(len(origins), np.inf), np.full(len(origins), -1)
    nearest, is_odd = np.full(len(origins), np.inf), np.zeros(len(origins), np.bool_)
    ray_of = pairs.ray
    # All of a ray's pairs go together.
    starts = np.unique(pairs.first[np.searchsorted(pairs.first, np.arange(0, len(ray_of), _BATCH))])
    for start, end in pairwise([*starts, len(ray_of)]):
        ray, of = ray_of[start:end], pairs.triangle[start:end]
        keeps = usable[of] if excluded is None else usable[of] & (excluded[ray] != of)
        ray, of = ray[keeps], of[keeps]
        tested = method.test(fmt, {name: value[of] for name, value in stored.items()},
                             {name: value[ray] for name, value in rays.items()})
        is_odd[ray[np.isnan(tested.t) | np.isnan(tested.u) | np.isnan(tested.v)]] = True
        hit = tested.hit | _joined(fmt, ray, tested, method.reach)
        ray, of, t_pair, key = ray[hit], of[hit], tested.t[hit], tested.key[hit]
        # The nearest of each ray comes last, so that it is what stays.
        order = np.lexsort((-key, ray))
        order = order[np.append(ray[order][1:] != ray[order][:-1], True)[:len(ray)]]
        order = order[key[order] < nearest[ray[order]]]
        ray = ray[order]
        t[ray], triangle[ray], nearest[ray] = t_pair[order], of[order], key[order]
    return Answers(t, triangle, is_odd)
