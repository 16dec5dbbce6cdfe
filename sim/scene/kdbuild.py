"""The kd-tree builder's loop over nodes."""

import numba
import numpy as np

from .clip import MAX_CORNERS, clip_bounds
from .kdsplit import LEAF, MAX_PLANES, best_split

__all__ = ["build"]


# Loops over elements, here and below, where numpy has an expression: numba compiles them ten times as fast.


@numba.njit(cache=True)
def _grown(array, size):
    """``array`` with room for ``size`` entries."""
    if len(array) >= size:
        return array
    grown = np.empty(2 * size, dtype=array.dtype)
    for i in range(len(array)):
        grown[i] = array[i]
    return grown


@numba.njit(cache=True)
def _grown_rows(array, size):
    """The same for the rows of float64[n, 6]."""
    if len(array) >= size:
        return array
    grown = np.empty((2 * size, 6))
    for i in range(len(array)):
        for k in range(6):
            grown[i, k] = array[i, k]
    return grown


@numba.njit(cache=True)
def _area_within(box, bounds):
    """Half the area of the part of a box that lies within bounds, both float64[6]; 0 if none does."""
    x = min(box[3], bounds[3]) - max(box[0], bounds[0])
    y = min(box[4], bounds[4]) - max(box[1], bounds[1])
    z = min(box[5], bounds[5]) - max(box[2], bounds[2])
    return x * y + y * z + z * x if x >= 0.0 and y >= 0.0 and z >= 0.0 else 0.0


@numba.njit(cache=True)
def _widened(present, lower, upper, pad):
    """Bounds float64[n, 6] of the primitives listed, and float64[6] of all of them."""
    bounds, root = np.empty((len(present), 6)), np.zeros(6)
    for i in range(len(present)):
        for k in range(3):
            bounds[i, k] = lower[present[i], k] - pad
            bounds[i, 3 + k] = upper[present[i], k] + pad
            root[k] = min(root[k], bounds[i, k]) if i else bounds[i, k]
            root[3 + k] = max(root[3 + k], bounds[i, 3 + k]) if i else bounds[i, 3 + k]
    return bounds, root


@numba.njit(cache=True)
def build(present, lower, upper, triangles, pad, costs, min_gain, max_depth, surround):
    """Arrays of a kd-tree over the primitives listed in ``present``; see
    :func:`sim.scene.kdtree.build_kdtree`.

    Nodes wait on a stack, their primitives in an arena in the same order: the node on top of the stack owns
    the end of the arena from its start on, and is replaced there by its upper, then its lower child.
    """
    traversal_cost, intersection_cost = costs[:2]
    bounds, root = _widened(present, lower, upper, pad)
    root_area = _area_within(root, root)
    margin = surround * max(root[3] - root[0], root[4] - root[1], root[5] - root[2])

    split, axis = np.empty(1024), np.empty(1024, np.uint8)
    child, count = np.empty(1024, np.int32), np.empty(1024, np.int32)
    split[1], axis[1], child[1], count[1] = 0.0, LEAF, 0, 0
    items = np.empty(1024, np.int32)
    num_nodes, num_items, deepest, expected_cost = 2, 0, 0, 0.0

    stack = np.zeros((max_depth + 2, 3), np.int64)  # node, depth, start in the arena
    boxes, box = np.empty((max_depth + 2, 6)), np.empty(6)
    for k in range(3):
        boxes[0, k], boxes[0, 3 + k] = root[k] - margin, root[3 + k] + margin
    num_waiting, end = 1, len(present)

    planes, events = np.empty(MAX_PLANES), np.empty((3, MAX_PLANES + 1), np.int32)
    polygon, clipped = np.empty((MAX_CORNERS, 3)), np.empty((MAX_CORNERS, 3))
    ids, mine, my_bounds = _grown(present, end + 1), np.empty(end, np.int32), np.empty((end, 6))

    while num_waiting:
        num_waiting -= 1
        node, depth, start = stack[num_waiting, 0], stack[num_waiting, 1], stack[num_waiting, 2]
        for k in range(6):
            box[k] = boxes[num_waiting, k]
        num_mine = end - start
        weight = _area_within(box, root) / root_area if root_area > 0.0 else 1.0
        position, split_axis, flat_up = 0.0, LEAF, False
        if num_mine and depth < max_depth:
            cost, split_axis, position, flat_up = best_split(bounds, start, end, box, costs, planes, events)
            if weight * (intersection_cost * num_mine - cost) < min_gain:
                split_axis = LEAF
        if split_axis == LEAF:
            axis[node], split[node], child[node], count[node] = LEAF, 0.0, num_items, num_mine
            items = _grown(items, num_items + num_mine)
            for i in range(num_mine):
                items[num_items + i] = ids[start + i]
            num_items += num_mine
            deepest = max(deepest, depth)
            expected_cost += weight * intersection_cost * num_mine
            end = start
            continue

        expected_cost += weight * traversal_cost
        split, axis = _grown(split, num_nodes + 2), _grown(axis, num_nodes + 2)
        child, count = _grown(child, num_nodes + 2), _grown(count, num_nodes + 2)
        axis[node], split[node], child[node], count[node] = split_axis, position, num_nodes, 0
        mine, my_bounds = _grown(mine, num_mine), _grown_rows(my_bounds, num_mine)
        for i in range(num_mine):
            mine[i] = ids[start + i]
            for k in range(6):
                my_bounds[i, k] = bounds[start + i, k]
        ids, bounds = _grown(ids, start + 2 * num_mine), _grown_rows(bounds, start + 2 * num_mine)
        end = start
        for side in (1, 0):
            # The face of the child's box that lies in the plane: its lower one if the child is the upper.
            face = split_axis if side else 3 + split_axis
            for k in range(6):
                boxes[num_waiting, k] = box[k]
            boxes[num_waiting, face] = position
            stack[num_waiting, 0], stack[num_waiting, 1], stack[num_waiting, 2] = num_nodes + side, depth + 1, end
            for i in range(num_mine):
                low, high = my_bounds[i, split_axis], my_bounds[i, 3 + split_axis]
                is_flat = low == high == position
                below, above = low < position or (is_flat and not flat_up), high > position or (is_flat and flat_up)
                if not (above if side else below):
                    continue
                ids[end] = mine[i]
                for k in range(6):
                    bounds[end, k] = my_bounds[i, k]
                if below and above:
                    bounds[end, face] = position
                    if len(triangles) and not clip_bounds(triangles[mine[i]], boxes[num_waiting], pad,
                                                          bounds[end], polygon, clipped):
                        continue
                end += 1
            num_waiting += 1
        num_nodes += 2
    nodes = split[:num_nodes].copy(), axis[:num_nodes].copy(), child[:num_nodes].copy(), count[:num_nodes].copy()
    return nodes, items[:num_items].copy(), deepest, expected_cost
