"""A bounding volume hierarchy by the binned surface-area heuristic.

Wald: On fast construction of SAH-based bounding volume hierarchies, RT 2007.
"""

from typing import NamedTuple

import numba
import numpy as np

__all__ = ["MAX_DEPTH", "Bvh", "build_bvh"]

_NUM_BINS = 16
_MAX_LEAF = 4
# From this depth on nodes are halved by number: the heuristic alone can peel primitives off one by one.
_MAX_SAH_DEPTH = 64
MAX_DEPTH = _MAX_SAH_DEPTH + 32


class Bvh(NamedTuple):
    """Nodes in an array, the root first.

    Parameters
    ----------
    lower, upper : float64[N, 3]
        Bounds of everything below the node.
    first : int32[N]
        Inner node: index of its first child, the second follows. Leaf: offset of its first item.
    count : int32[N]
        Number of items of a leaf, 0 for an inner node (an empty hierarchy has no nodes).
    items : int32[M]
        Primitive numbers.
    """

    lower: np.ndarray
    upper: np.ndarray
    first: np.ndarray
    count: np.ndarray
    items: np.ndarray


@numba.njit(cache=True)
def _half_area(lower, upper):
    e = upper - lower
    return e[0] * e[1] + e[1] * e[2] + e[2] * e[0]


@numba.njit(cache=True)
def _find_split(lower, upper, items):
    """(axis, bin edge, scale, offset) of the cheapest split by centroid bins; axis −1 if centroids coincide."""
    best_cost, best = np.inf, (-1, 0, 0.0, 0.0)
    bin_lower = np.empty((_NUM_BINS, 3))
    bin_upper = np.empty((_NUM_BINS, 3))
    bin_count = np.empty(_NUM_BINS, np.int64)
    cost_above = np.empty(_NUM_BINS)
    for axis in range(3):
        least, most = np.inf, -np.inf
        for item in items:
            center = lower[item, axis] + upper[item, axis]
            least, most = min(least, center), max(most, center)
        if not most > least:
            continue
        scale = _NUM_BINS * (1 - 1e-12) / (most - least)
        bin_lower[:], bin_upper[:], bin_count[:] = np.inf, -np.inf, 0
        for item in items:
            b = int((lower[item, axis] + upper[item, axis] - least) * scale)
            bin_count[b] += 1
            for k in range(3):
                bin_lower[b, k] = min(bin_lower[b, k], lower[item, k])
                bin_upper[b, k] = max(bin_upper[b, k], upper[item, k])
        run_lower, run_upper, num = np.full(3, np.inf), np.full(3, -np.inf), 0
        for b in range(_NUM_BINS - 1, 0, -1):
            run_lower, run_upper = np.minimum(run_lower, bin_lower[b]), np.maximum(run_upper, bin_upper[b])
            num += bin_count[b]
            cost_above[b] = num * _half_area(run_lower, run_upper) if num else np.inf
        run_lower, run_upper, num = np.full(3, np.inf), np.full(3, -np.inf), 0
        for b in range(1, _NUM_BINS):
            run_lower = np.minimum(run_lower, bin_lower[b - 1])
            run_upper = np.maximum(run_upper, bin_upper[b - 1])
            num += bin_count[b - 1]
            if num and num * _half_area(run_lower, run_upper) + cost_above[b] < best_cost:
                best_cost = num * _half_area(run_lower, run_upper) + cost_above[b]
                best = (axis, b, scale, least)
    return best


@numba.njit(cache=True)
def _build(lower, upper, items):
    n = len(items)
    node_lower, node_upper = np.empty((2 * n, 3)), np.empty((2 * n, 3))
    first, count = np.zeros(2 * n, np.int32), np.zeros(2 * n, np.int32)
    waiting = [(0, 0, n, 0)]
    num_nodes = 1
    while len(waiting):
        node, start, end, depth = waiting.pop()
        for k in range(3):
            node_lower[node, k], node_upper[node, k] = np.inf, -np.inf
        for item in items[start:end]:
            for k in range(3):
                node_lower[node, k] = min(node_lower[node, k], lower[item, k])
                node_upper[node, k] = max(node_upper[node, k], upper[item, k])
        first[node], count[node] = start, end - start
        if end - start <= _MAX_LEAF:
            continue
        axis, edge, scale, offset = _find_split(lower, upper, items[start:end])
        if axis < 0 or depth >= _MAX_SAH_DEPTH:
            middle = (start + end) // 2
        else:
            middle = start
            for i in range(start, end):
                item = items[i]
                if int((lower[item, axis] + upper[item, axis] - offset) * scale) < edge:
                    items[i], items[middle] = items[middle], item
                    middle += 1
        first[node], count[node] = num_nodes, 0
        waiting.append((num_nodes, start, middle, depth + 1))
        waiting.append((num_nodes + 1, middle, end, depth + 1))
        num_nodes += 2
    return node_lower[:num_nodes], node_upper[:num_nodes], first[:num_nodes], count[:num_nodes]


def build_bvh(lower, upper, present):
    """Hierarchy over the boxes ``lower, upper`` float64[P, 3] for which ``present`` bool[P] is true."""
    items = np.flatnonzero(present).astype(np.int32)
    if not len(items):
        nothing = np.zeros((0, 3)), np.zeros((0, 3)), np.zeros(0, np.int32), np.zeros(0, np.int32)
        return Bvh(*nothing, items)
    return Bvh(*_build(lower, upper, items), items)
