"""The kd-tree builder's loop over nodes."""

import numba
import numpy as np

from .clip import clipped_bounds
from .kdsplit import LEAF, MAX_PLANES, best_split

__all__ = ["build"]


@numba.njit(cache=True)
def _grown(array, size):
    """``array`` with room for ``size`` entries along its last axis."""
    if array.shape[-1] >= size:
        return array
    grown = np.empty((*array.shape[:-1], 2 * size), dtype=array.dtype)
    grown[..., :array.shape[-1]] = array
    return grown


@numba.njit(cache=True)
def _area_within(box, bounds):
    """Half the area of the part of a box float64[2, 3] that lies within bounds, 0 if none does."""
    x = min(box[1, 0], bounds[1, 0]) - max(box[0, 0], bounds[0, 0])
    y = min(box[1, 1], bounds[1, 1]) - max(box[0, 1], bounds[0, 1])
    z = min(box[1, 2], bounds[1, 2]) - max(box[0, 2], bounds[0, 2])
    return x * y + y * z + z * x if x >= 0.0 and y >= 0.0 and z >= 0.0 else 0.0


@numba.njit(cache=True)
def _widened(present, lower, upper, pad):
    """Bounds float64[2, 3, n] of the primitives listed, and float64[2, 3] of all of them."""
    n = len(present)
    bounds, root = np.empty((2, 3, n)), np.zeros((2, 3))
    for k in range(3):
        for i in range(n):
            bounds[0, k, i] = lower[present[i], k] - pad
            bounds[1, k, i] = upper[present[i], k] + pad
        if n:
            root[0, k], root[1, k] = bounds[0, k].min(), bounds[1, k].max()
    return bounds, root


@numba.njit(cache=True)
def build(present, lower, upper, triangles, pad, costs, min_gain, max_depth, surround):
    """Arrays of a kd-tree over the primitives listed in ``present``; see :func:`sim.scene.kdtree.build_kdtree`.

    Nodes wait on a stack, their primitives in an arena in the same order: the node on top of the stack owns the end
    of the arena from its start on, and is replaced there by its upper, then its lower child.
    """
    traversal_cost, intersection_cost = costs[:2]
    ids = present.copy()
    bounds, root = _widened(present, lower, upper, pad)
    root_area = _area_within(root, root)
    margin = surround * (root[1] - root[0]).max()

    split, axis = np.zeros(1024), np.full(1024, LEAF, np.uint8)
    child, count = np.zeros(1024, np.int32), np.zeros(1024, np.int32)
    items = np.empty(1024, np.int32)
    num_nodes, num_items, deepest, expected_cost = 2, 0, 0, 0.0

    stack = np.zeros((max_depth + 2, 3), np.int64)  # node, depth, start in the arena
    boxes = np.empty((max_depth + 2, 2, 3))
    boxes[0, 0], boxes[0, 1] = root[0] - margin, root[1] + margin
    num_waiting, end = 1, len(present)

    planes, events = np.empty(MAX_PLANES), np.empty((3, MAX_PLANES + 1), np.int32)
    polygon, clipped = np.empty((9, 3)), np.empty((9, 3))
    mine, my_bounds = np.empty(end, np.int32), np.empty((2, 3, end))

    while num_waiting:
        num_waiting -= 1
        node, depth, start = stack[num_waiting]
        box = boxes[num_waiting].copy()
        num_mine = end - start
        weight = _area_within(box, root) / root_area if root_area > 0.0 else 1.0
        position, split_axis, flat_up = 0.0, LEAF, False
        if num_mine and depth < max_depth:
            cost, split_axis, position, flat_up = best_split(bounds[0, :, start:end], bounds[1, :, start:end],
                                                             box[0], box[1], costs, planes, events)
            if weight * (intersection_cost * num_mine - cost) < min_gain:
                split_axis = LEAF
        if split_axis == LEAF:
            axis[node], split[node], child[node], count[node] = LEAF, 0.0, num_items, num_mine
            items = _grown(items, num_items + num_mine)
            items[num_items:num_items + num_mine] = ids[start:end]
            num_items += num_mine
            deepest = max(deepest, depth)
            expected_cost += weight * intersection_cost * num_mine
            end = start
            continue

        expected_cost += weight * traversal_cost
        split, axis = _grown(split, num_nodes + 2), _grown(axis, num_nodes + 2)
        child, count = _grown(child, num_nodes + 2), _grown(count, num_nodes + 2)
        axis[node], split[node], child[node], count[node] = split_axis, position, num_nodes, 0
        mine, my_bounds = _grown(mine, num_mine), _grown(my_bounds, num_mine)
        mine[:num_mine] = ids[start:end]
        my_bounds[:, :, :num_mine] = bounds[:, :, start:end]
        ids, bounds = _grown(ids, start + 2 * num_mine), _grown(bounds, start + 2 * num_mine)
        end = start
        for side in (1, 0):
            part = boxes[num_waiting]
            part[:] = box
            part[1 - side, split_axis] = position
            stack[num_waiting, 0] = num_nodes + side
            stack[num_waiting, 1] = depth + 1
            stack[num_waiting, 2] = end
            num_waiting += 1
            for i in range(num_mine):
                low, high = my_bounds[0, split_axis, i], my_bounds[1, split_axis, i]
                is_flat = low == high == position
                below, above = low < position or is_flat and not flat_up, high > position or is_flat and flat_up
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
    nodes = split[:num_nodes].copy(), axis[:num_nodes].copy(), child[:num_nodes].copy(), count[:num_nodes].copy()
    return nodes, items[:num_items].copy(), deepest, expected_cost
