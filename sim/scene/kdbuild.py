"""The kd-tree builder's inner loops."""

import math

import numba
import numpy as np

from .clip import clipped_bounds

__all__ = ["build", "round_down", "round_up"]

_LEAF = 3
# Nodes with more primitives take their candidate planes from a grid, smaller ones from the primitives'
# bounds.
_MAX_EXACT = 512
_NUM_GRID = 256
_MAX_PLANES = 2 * _MAX_EXACT


@numba.njit(cache=True)
def round_down(x, frac_width, min_normal):
    """Largest number with ``frac_width`` fraction bits, zero or at least ``min_normal`` in magnitude, that is ≤ x."""
    significand, exponent = math.frexp(x)
    y = math.ldexp(math.floor(math.ldexp(significand, frac_width + 1)), exponent - frac_width - 1)
    if 0.0 < y < min_normal:
        return 0.0
    if -min_normal < y < 0.0:
        return -min_normal
    return y


@numba.njit(cache=True)
def round_up(x, frac_width, min_normal):
    """Least such number that is ≥ x."""
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
def _first_at_least(planes, num_planes, x):
    low, high = 0, num_planes
    while low < high:
        middle = (low + high) >> 1
        if planes[middle] < x:
            low = middle + 1
        else:
            high = middle
    return low


@numba.njit(cache=True)
def _first_above(planes, num_planes, x):
    low, high = 0, num_planes
    while low < high:
        middle = (low + high) >> 1
        if planes[middle] <= x:
            low = middle + 1
        else:
            high = middle
    return low


@numba.njit(cache=True)
def _best_split(lower, upper, box_lower, box_upper, costs, planes, events):
    """Cheapest split of a node: (cost, axis, position, flat primitives go up); axis 3 if a leaf is cheapest.

    The cost of a split is traversal + intersection · (A_lower · n_lower + A_upper · n_upper) / A, with A the
    areas of the boxes.
    """
    traversal_cost, intersection_cost, empty_bonus, frac_width, min_normal = costs
    n = lower.shape[1]
    best = (intersection_cost * n, _LEAF, 0.0, False)
    extent = box_upper - box_lower
    area = extent[0] * extent[1] + extent[1] * extent[2] + extent[2] * extent[0]
    if not area > 0.0:
        return best
    for axis in range(3):
        num_planes = _candidates(planes, lower[axis], upper[axis], int(frac_width), min_normal)
        events[:, :num_planes + 1] = 0
        for i in range(n):
            low, high = lower[axis, i], upper[axis, i]
            start = _first_above(planes, num_planes, low)
            end = _first_at_least(planes, num_planes, high)
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
            for flat_up in range(1 + (events[2, j] > 0)):
                n_lower, n_upper = num_lower, num_upper
                if flat_up:
                    n_upper += events[2, j]
                else:
                    n_lower += events[2, j]
                cost = intersection_cost * (area_lower * n_lower + area_upper * n_upper) / area
                if n_lower == 0 or n_upper == 0:
                    cost *= 1.0 - empty_bonus
                cost += traversal_cost
                if cost < best[0]:
                    best = (cost, axis, position, flat_up == 1)
    return best


@numba.njit(cache=True)
def _grown(array, size):
    """``array`` with room for ``size`` entries along its last axis."""
    if array.shape[-1] >= size:
        return array
    grown = np.empty(array.shape[:-1] + (2 * size,), dtype=array.dtype)
    grown[..., :array.shape[-1]] = array
    return grown


@numba.njit(cache=True)
def _box_area(box_lower, box_upper, root_lower, root_upper):
    """Half the area of the part of a box that lies within the root's bounds."""
    x = min(box_upper[0], root_upper[0]) - max(box_lower[0], root_lower[0])
    y = min(box_upper[1], root_upper[1]) - max(box_lower[1], root_lower[1])
    z = min(box_upper[2], root_upper[2]) - max(box_lower[2], root_lower[2])
    return x * y + y * z + z * x if x >= 0.0 and y >= 0.0 and z >= 0.0 else 0.0


@numba.njit(cache=True)
def build(present, lower, upper, triangles, frac_width, min_normal, pad, traversal_cost, intersection_cost, empty_bonus,
          max_depth, surround, min_gain):
    """Arrays of a kd-tree over the primitives listed in ``present``; see
    :func:`sim.scene.kdtree.build_kdtree`.

    Nodes wait on a stack, their primitives in an arena in the same order: the node on top of the stack owns
    the end of the arena from its start on, and is replaced there by its upper, then its lower child.
    """
    n = len(present)
    ids = present.copy()
    bounds = np.empty((2, 3, n))
    for i in range(n):
        for k in range(3):
            bounds[0, k, i] = lower[ids[i], k] - pad
            bounds[1, k, i] = upper[ids[i], k] + pad
    root = np.zeros((2, 3))
    for k in range(3):
        if n:
            root[0, k] = bounds[0, k].min()
            root[1, k] = bounds[1, k].max()
    margin = surround * (root[1] - root[0]).max()
    root_area = _box_area(root[0], root[1], root[0], root[1])

    split = np.zeros(1024)
    axis = np.full(1024, _LEAF, np.uint8)
    child = np.zeros(1024, np.int32)
    count = np.zeros(1024, np.int32)
    num_nodes = 2
    items = np.empty(max(4 * n, 16), np.int32)
    num_items, deepest, expected_cost = 0, 0, 0.0

    stack = np.empty((max_depth + 2, 3), np.int64)  # node, depth, start in the arena
    boxes = np.empty((max_depth + 2, 2, 3))
    stack[0] = 0
    boxes[0, 0] = root[0] - margin
    boxes[0, 1] = root[1] + margin
    num_waiting, end = 1, n

    costs = (traversal_cost, intersection_cost, empty_bonus, float(frac_width), min_normal)
    planes = np.empty(_MAX_PLANES)
    events = np.empty((3, _MAX_PLANES + 1), np.int32)
    polygon, clipped = np.empty((9, 3)), np.empty((9, 3))
    mine, my_bounds = np.empty(n, np.int32), np.empty((2, 3, n))

    while num_waiting:
        num_waiting -= 1
        node, depth, start = stack[num_waiting]
        box = boxes[num_waiting].copy()
        num_mine = end - start
        area = _box_area(box[0], box[1], root[0], root[1])
        weight = area / root_area if root_area > 0.0 else 1.0
        position, split_axis, flat_up = 0.0, _LEAF, False
        if num_mine and depth < max_depth:
            cost, split_axis, position, flat_up = _best_split(bounds[0, :, start:end], bounds[1, :, start:end], box[0],
                                                              box[1], costs, planes, events)
            if weight * (intersection_cost * num_mine - cost) < min_gain:
                split_axis = _LEAF
        if split_axis == _LEAF:
            axis[node], child[node], count[node] = _LEAF, num_items, num_mine
            items = _grown(items, num_items + num_mine)
            items[num_items:num_items + num_mine] = ids[start:end]
            num_items += num_mine
            deepest = max(deepest, depth)
            expected_cost += weight * intersection_cost * num_mine
            end = start
            continue

        expected_cost += weight * traversal_cost
        if num_nodes + 2 > len(split):
            split, axis = _grown(split, num_nodes + 2), _grown(axis, num_nodes + 2)
            child, count = _grown(child, num_nodes + 2), _grown(count, num_nodes + 2)
        axis[node], split[node], child[node], count[node] = split_axis, position, num_nodes, 0
        if num_mine > len(mine):
            mine, my_bounds = _grown(mine, num_mine), _grown(my_bounds, num_mine)
        mine[:num_mine] = ids[start:end]
        my_bounds[:, :, :num_mine] = bounds[:, :, start:end]
        ids, bounds = _grown(ids, start + 2 * num_mine), _grown(bounds, start + 2 * num_mine)
        end = start
        for side in (1, 0):
            stack[num_waiting, 0] = num_nodes + side
            stack[num_waiting, 1] = depth + 1
            stack[num_waiting, 2] = end
            boxes[num_waiting] = box
            boxes[num_waiting, 1 - side, split_axis] = position
            part = boxes[num_waiting]
            num_waiting += 1
            for i in range(num_mine):
                low, high = my_bounds[0, split_axis, i], my_bounds[1, split_axis, i]
                below = low < position or (low == high == position and not flat_up)
                above = high > position or (low == high == position and flat_up)
                if not (above if side else below):
                    continue
                ids[end] = mine[i]
                bounds[:, :, end] = my_bounds[:, :, i]
                if below and above:
                    bounds[1 - side, split_axis, end] = position
                    if len(triangles) and not clipped_bounds(triangles[mine[i]], part[0], part[1], pad, polygon,
                                                             clipped, bounds[0, :, end], bounds[1, :, end]):
                        continue
                end += 1
        num_nodes += 2
    return (split[:num_nodes].copy(), axis[:num_nodes].copy(), child[:num_nodes].copy(), count[:num_nodes].copy(),
            items[:num_items].copy(), deepest, expected_cost)
