"""The cheapest plane to split a kd-tree's node at, by the surface-area heuristic."""

import math

import numba

__all__ = ["LEAF", "MAX_PLANES", "best_split", "round_down", "round_up"]

LEAF = 3
# Nodes with more primitives take their candidate planes from a grid, smaller ones from the primitives' bounds.
_MAX_EXACT = 512
_NUM_GRID = 256
MAX_PLANES = 2 * _MAX_EXACT


@numba.njit(cache=True)
def round_down(x, frac_width, min_normal):
    """Largest float ≤ x with ``frac_width`` fraction bits that is zero or at least ``min_normal`` in magnitude."""
    significand, exponent = math.frexp(x)
    y = math.ldexp(math.floor(math.ldexp(significand, frac_width + 1)), exponent - frac_width - 1)
    if 0.0 < y < min_normal:
        return 0.0
    if -min_normal < y < 0.0:
        return -min_normal
    return y


@numba.njit(cache=True)
def round_up(x, frac_width, min_normal):
    """Least such float ≥ x."""
    return -round_down(-x, frac_width, min_normal)


@numba.njit(cache=True)
def _candidates(planes, lower, upper, frac_width, min_normal):
    """Fill ``planes`` in ascending order; returns their number."""
    n = len(lower)
    if n <= _MAX_EXACT:
        for i in range(n):
            planes[i] = round_down(lower[i], frac_width, min_normal)
            planes[n + i] = round_up(upper[i], frac_width, min_normal)
        planes[:2 * n].sort()
        return 2 * n
    first, last = lower.min(), upper.max()
    for j in range(1, _NUM_GRID):
        planes[j] = round_down(first + (last - first) * j / _NUM_GRID, frac_width, min_normal)
    planes[0] = round_down(first, frac_width, min_normal)
    planes[_NUM_GRID] = round_up(last, frac_width, min_normal)
    return _NUM_GRID + 1


@numba.njit(cache=True)
def _first(planes, num_planes, x, above):
    """Number of the first plane ≥ x, or > x if ``above``."""
    low, high = 0, num_planes
    while low < high:
        middle = (low + high) >> 1
        if planes[middle] < x or (above and planes[middle] == x):
            low = middle + 1
        else:
            high = middle
    return low


@numba.njit(cache=True)
def best_split(lower, upper, box_lower, box_upper, costs, planes, events):
    """Cheapest split of a node: (cost, axis, position, flat primitives go up); axis 3 if a leaf is cheaper.

    cost = traversal + intersection · (A_lower · n_lower + A_upper · n_upper) / A with A the boxes' areas, the second
    term less its ``empty_bonus`` part if a side is empty; a leaf's is intersection · n.

    Parameters
    ----------
    lower, upper : float64[3, n]
        Bounds of the primitives in the node.
    box_lower, box_upper : float64[3]
        The node's box.
    costs : tuple
        traversal_cost, intersection_cost, empty_bonus, frac_width, min_normal.
    planes : float64[MAX_PLANES]
        Work space.
    events : int32[3, MAX_PLANES + 1]
        Work space.
    """
    traversal_cost, intersection_cost, empty_bonus, frac_width, min_normal = costs
    n = lower.shape[1]
    best = (intersection_cost * n, LEAF, 0.0, False)
    extent = box_upper - box_lower
    area = extent[0] * extent[1] + extent[1] * extent[2] + extent[2] * extent[0]
    if not area > 0.0:
        return best
    for axis in range(3):
        num_planes = _candidates(planes, lower[axis], upper[axis], frac_width, min_normal)
        # By first plane: primitives that reach below it, that no longer reach above it, that lie in it.
        events[:, :num_planes + 1] = 0
        for i in range(n):
            low, high = lower[axis, i], upper[axis, i]
            start, end = _first(planes, num_planes, low, True), _first(planes, num_planes, high, False)
            events[0, start] += 1
            events[1, end] += 1
            if start > end:
                events[2, end] += 1
        face = extent[(axis + 1) % 3] * extent[(axis + 2) % 3]
        girth = extent[(axis + 1) % 3] + extent[(axis + 2) % 3]
        num_lower, num_upper = 0, n
        for j in range(num_planes):
            num_lower += events[0, j]
            num_upper -= events[1, j]
            position = planes[j]
            if j > 0 and position == planes[j - 1] or not box_lower[axis] < position < box_upper[axis]:
                continue
            area_lower = face + (position - box_lower[axis]) * girth
            area_upper = face + (box_upper[axis] - position) * girth
            for flat_up in range(2 if events[2, j] else 1):
                n_lower = num_lower + (0 if flat_up else events[2, j])
                n_upper = num_upper + (events[2, j] if flat_up else 0)
                cost = intersection_cost * (area_lower * n_lower + area_upper * n_upper) / area
                if n_lower == 0 or n_upper == 0:
                    cost *= 1.0 - empty_bonus
                cost += traversal_cost
                if cost < best[0]:
                    best = (cost, axis, position, flat_up == 1)
    return best
