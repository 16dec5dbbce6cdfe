"""The cheapest plane to split a kd-tree's node at, by the surface-area heuristic."""

import math

import numba

__all__ = ["LEAF", "MAX_PLANES", "best_split", "round_down", "round_up"]

LEAF = 3
# Nodes with more primitives take their candidate planes from a grid, smaller ones from the primitives'
# bounds.
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
def _candidates(planes, bounds, start, end, axis, frac_width, min_normal):
    """Fill ``planes`` in ascending order; returns their number."""
    n = end - start
    if n <= _MAX_EXACT:
        for i in range(n):
            planes[i] = round_down(bounds[start + i, axis], frac_width, min_normal)
            planes[n + i] = round_up(bounds[start + i, 3 + axis], frac_width, min_normal)
        planes[:2 * n].sort()
        return 2 * n
    least, most = bounds[start, axis], bounds[start, 3 + axis]
    for i in range(start, end):
        least, most = min(least, bounds[i, axis]), max(most, bounds[i, 3 + axis])
    for j in range(_NUM_GRID):
        planes[j] = round_down(least + (most - least) * j / _NUM_GRID, frac_width, min_normal)
    planes[_NUM_GRID] = round_up(most, frac_width, min_normal)
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
def best_split(bounds, start, end, box, costs, planes, events):
    """Cheapest split of a node: (cost, axis, position, flat primitives go up); axis 3 if a leaf is cheaper.

    cost = traversal + intersection · (A_lower · n_lower + A_upper · n_upper) / A with A the boxes' areas, the
    second term less its ``empty_bonus`` part if a side is empty; a leaf's is intersection · n.

    Parameters
    ----------
    bounds : float64[:, 6]
        Bounds of primitives, lower then upper x, y, z; those from ``start`` to ``end`` are in the node.
    start, end : int
    box : float64[6]
        The node's box.
    costs : tuple
        traversal_cost, intersection_cost, empty_bonus, frac_width, min_normal.
    planes : float64[MAX_PLANES]
        Work space.
    events : int32[3, MAX_PLANES + 1]
        Work space.
    """
    traversal_cost, intersection_cost, empty_bonus, frac_width, min_normal = costs
    n = end - start
    best = (intersection_cost * n, LEAF, 0.0, False)
    width, depth, height = box[3] - box[0], box[4] - box[1], box[5] - box[2]
    area = width * depth + depth * height + height * width
    if not area > 0.0:
        return best
    for axis in range(3):
        num_planes = _candidates(planes, bounds, start, end, axis, frac_width, min_normal)
        # By first plane: primitives that reach below it, that no longer reach above it, that lie in it.
        for j in range(num_planes + 1):
            events[0, j], events[1, j], events[2, j] = 0, 0, 0
        for i in range(start, end):
            low, high = bounds[i, axis], bounds[i, 3 + axis]
            first, last = _first(planes, num_planes, low, True), _first(planes, num_planes, high, False)
            events[0, first] += 1
            events[1, last] += 1
            if first > last:
                events[2, last] += 1
        lowest, highest = box[axis], box[3 + axis]
        face = (depth * height, height * width, width * depth)[axis]
        girth = (depth + height, height + width, width + depth)[axis]
        num_lower, num_upper = 0, n
        for j in range(num_planes):
            num_lower += events[0, j]
            num_upper -= events[1, j]
            position = planes[j]
            if (j > 0 and position == planes[j - 1]) or not lowest < position < highest:
                continue
            area_lower, area_upper = face + (position - lowest) * girth, face + (highest - position) * girth
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
