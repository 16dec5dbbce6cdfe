"""One packet's way through the chip."""

import math

import numpy as np

from rtl.unit_triangle import MARGIN

from ..scene.image import INDEX_MASK, INSTANCE_ENTRY, LAST_ENTRY, LOWER_EMPTY, SOLID_ENTRY, UPPER_EMPTY
from .compiled import compiled
from .datapaths import affine_map, kd_step, scaled_map, tolerant_triangle, unit_triangle

__all__ = ["ANY_HIT", "COUNTS", "HAS_LIMIT", "SAME_ORIGIN", "VECTORS", "trace_packet", "transform"]

#: Flags of a ray: the first solid triangle ends it; it has a t_far; rays with the same number share their origin.
ANY_HIT, HAS_LIMIT, SAME_ORIGIN = 1, 2, 4

_VISIT, _LIST, _POP = range(3)

#: What a packet's work is counted in.
COUNTS = ("steps", "leaves", "entries", "transformed_vectors", "triangle_tests", "instances", "pops", "stack_depth")
_STEPS, _LEAVES, _ENTRIES, VECTORS, _TESTS, _INSTANCES, _POPS, _DEPTH = range(8)


@compiled()
def _operands(matrix, vector):
    """A vector and a matrix as the maps take them."""
    return (vector[0], vector[1], vector[2], matrix[3, 0], matrix[3, 1], matrix[3, 2], matrix[0, 0], matrix[0, 1],
            matrix[0, 2], matrix[1, 0], matrix[1, 1], matrix[1, 2], matrix[2, 0], matrix[2, 1], matrix[2, 2])


@compiled()
def transform(arithmetic, params, matrix, vector, is_point):
    """A vector by a matrix float64[4, 3] of three rows and C, see :func:`rtl.transformation.affine_map`."""
    return affine_map(arithmetic, params, is_point, *_operands(matrix, vector))


@compiled()
def _transform_scaled(arithmetic, params, matrix, vector, is_point):
    """As :func:`transform`, and behind it the scale of each row."""
    return scaled_map(arithmetic, params, is_point, *_operands(matrix, vector))


@compiled()
def trace_packet(arithmetic, params, root, nodes, splits, lists, matrices, mailbox_entries, stack_depth, tolerance,
                 origins, directions, mask, limits, excluded, flags, is_shared, hits, owners, counts):
    """Traces four rays; see :func:`~sim.model.model.render_model` for what the arrays hold.

    Parameters
    ----------
    arithmetic : int
        Index into :data:`~rtl.arithmetic.ARITHMETICS`.
    params : tuple
        ``fmt.params``.
    root, nodes, splits, lists, matrices
        The memory image, floats decoded.
    tolerance : float
        Of triangles' edges, 0 for none: units in the last place, as a part of 1.
    origins, directions : float64[4, 3]
        The rays.
    mask : int
        Rays that take part.
    limits : float64[4, 2]
        t_near and t_far of each ray.
    excluded : int64[4, 2]
        Triangle and instance that each ray does not hit; instance −1 for triangles outside of any.
    flags : int64[4]
        :data:`ANY_HIT` and :data:`HAS_LIMIT` of each ray.
    is_shared : bool
        All origins are the same, and are transformed once.
    hits : float64[4, 4]
        Receives t, u, v, D′z of each ray. Of a ray with a limit that hits nothing, t is the limit.
    owners : int64[4, 2]
        Receives the triangle and the instance of each ray, −1 for none.
    counts : int64[8]
        See :data:`COUNTS`; sums, of stack_depth the maximum.

    Returns
    -------
    bool
        False if the stack is too small.
    """
    origin = np.empty((2, 4, 3))
    mapped, mapped_scale = np.empty((4, 3)), np.empty((4, 3))
    direction = np.empty((2, 4, 3))
    interval = np.empty((2, 4, 2))
    stack_node = np.empty((2, stack_depth), np.int64)
    stack_mask = np.empty((2, stack_depth), np.int64)
    stack_interval = np.empty((2, stack_depth, 4, 2))
    sp = np.zeros(2, np.int64)
    position = np.zeros(2, np.int64)
    is_last = np.zeros(2, np.bool_)
    leaf_mask = np.zeros(2, np.int64)
    letter_index = np.zeros((2, max(mailbox_entries, 1)), np.int64)
    letter_rays = np.zeros((2, max(mailbox_entries, 1)), np.int64)
    next_letter = np.zeros(2, np.int64)
    child_interval = np.empty((2, 4, 2))

    # Of each ray what the next hit has to be nearer than, and the soft hits on fronts and backs that wait for another.
    nearest, waiting = np.full(4, np.inf), np.full((4, 2), np.inf)
    waiting_is_loose = np.zeros((4, 2), np.bool_)
    has_distance = 0
    for ray in range(4):
        owners[ray, 0] = owners[ray, 1] = -1
        if mask >> ray & 1:
            origin[0, ray] = origins[ray]
            direction[0, ray] = directions[ray]
            interval[0, ray, 0], interval[0, ray, 1] = 0.0, np.inf
            if flags[ray] & HAS_LIMIT:
                hits[ray, 0] = nearest[ray] = limits[ray, 1]
                has_distance |= 1 << ray

    level, node, instance, action = 0, root, -1, _VISIT
    while True:
        if action == _VISIT:
            word = nodes[node]
            axis = word >> 24 & 3
            child = word & INDEX_MASK
            if axis == 3:
                counts[_LEAVES] += 1
                position[level] = child
                leaf_mask[level] = mask
                action = _LIST
                continue
            counts[_STEPS] += 1
            lower_mask = upper_mask = 0
            upper_first = -1
            for ray in range(4):
                if not mask >> ray & 1:
                    continue
                lower, upper, lower_near, lower_far, upper_near, upper_far, backward = kd_step(
                    arithmetic, params, splits[node], origin[level, ray, axis], direction[level, ray, axis],
                    interval[level, ray, 0], interval[level, ray, 1])
                if upper_first < 0:
                    upper_first = 1 if backward else 0
                if lower and not word & LOWER_EMPTY:
                    lower_mask |= 1 << ray
                if upper and not word & UPPER_EMPTY:
                    upper_mask |= 1 << ray
                child_interval[0, ray, 0], child_interval[0, ray, 1] = lower_near, lower_far
                child_interval[1, ray, 0], child_interval[1, ray, 1] = upper_near, upper_far
            if not lower_mask and not upper_mask:
                action = _POP
                continue
            to_upper = 1 if upper_mask and (upper_first == 1 or not lower_mask) else 0
            if lower_mask and upper_mask:
                if sp[level] == stack_depth:
                    return False
                entry = sp[level]
                stack_node[level, entry] = child + 1 - to_upper
                stack_mask[level, entry] = lower_mask if to_upper else upper_mask
                stack_interval[level, entry] = child_interval[1 - to_upper]
                sp[level] += 1
                counts[_DEPTH] = max(counts[_DEPTH], sp[level])
            node = child + to_upper
            mask = upper_mask if to_upper else lower_mask
            interval[level] = child_interval[to_upper]

        elif action == _POP:
            if sp[level] == 0:
                if level == 0:
                    return True
                level = 0
                action = _POP if is_last[0] else _LIST
                continue
            counts[_POPS] += 1
            sp[level] -= 1
            entry = sp[level]
            mask = 0
            for ray in range(4):
                if stack_mask[level, entry] >> ray & 1:
                    if not has_distance >> ray & 1 or stack_interval[level, entry, ray, 0] <= nearest[ray]:
                        mask |= 1 << ray
            if mask:
                interval[level] = stack_interval[level, entry]
                node = stack_node[level, entry]
                action = _VISIT

        else:
            counts[_ENTRIES] += 1
            word = lists[position[level]]
            position[level] += 1
            is_last[level] = word & LAST_ENTRY != 0
            index = word & INDEX_MASK
            matrix = matrices[index]
            wanted = leaf_mask[level]
            if mailbox_entries:
                place = -1
                for number in range(mailbox_entries):
                    if letter_index[level, number] == index and letter_rays[level, number]:
                        place = number
                if place < 0:
                    place = next_letter[level]
                    next_letter[level] = (place + 1) % mailbox_entries
                    letter_index[level, place] = index
                    letter_rays[level, place] = 0
                tested = letter_rays[level, place]
                letter_rays[level, place] = tested | wanted
                wanted &= ~tested
            if wanted and word & INSTANCE_ENTRY:
                counts[_INSTANCES] += 1
                mask = wanted
                letter_rays[1] = 0
                next_letter[1] = 0
                is_first = True
                for ray in range(4):
                    if mask >> ray & 1:
                        counts[VECTORS] += 2 if is_first or not is_shared else 1
                        is_first = False
                        origin[1, ray] = transform(arithmetic, params, matrix, origin[0, ray], True)
                        direction[1, ray] = transform(arithmetic, params, matrix, direction[0, ray], False)
                        interval[1, ray, 0], interval[1, ray, 1] = 0.0, np.inf
                level, sp[1], instance, node, action = 1, 0, index, index, _VISIT
                continue
            owner = instance if level else -1
            is_first = True
            for ray in range(4):
                if not wanted >> ray & 1:
                    continue
                counts[VECTORS] += 2 if is_first or not is_shared else 1
                counts[_TESTS] += 1
                # A shared origin's map is that of the first ray.
                if is_first or not is_shared:
                    if tolerance:
                        (mapped[ray, 0], mapped[ray, 1], mapped[ray, 2], mapped_scale[ray, 0], mapped_scale[ray, 1],
                         mapped_scale[ray, 2]) = _transform_scaled(arithmetic, params, matrix, origin[level, ray], True)
                    else:
                        mapped[ray] = transform(arithmetic, params, matrix, origin[level, ray], True)
                    first = ray
                is_first = False
                here = mapped[first]
                if tolerance:
                    scale = mapped_scale[first]
                    dx, dy, dz, scale_x, scale_y, scale_z = _transform_scaled(
                        arithmetic, params, matrix, direction[level, ray], False)
                    t, u, v, hit, nearer, key, is_soft, is_loose = tolerant_triangle(
                        arithmetic, params, here[0], here[1], here[2], dx, dy, dz, scale[0], scale[1], scale[2],
                        scale_x, scale_y, scale_z, tolerance, MARGIN * tolerance, waiting[ray, 0],
                        waiting[ray, 1], waiting_is_loose[ray, 0], waiting_is_loose[ray, 1], nearest[ray],
                        limits[ray, 0])
                else:
                    dx, dy, dz = transform(arithmetic, params, matrix, direction[level, ray], False)
                    t, u, v, hit, nearer = unit_triangle(arithmetic, params, here[0], here[1], here[2], dx, dy, dz,
                                                         nearest[ray], limits[ray, 0])
                    key, is_soft, is_loose = t, False, False
                if index == excluded[ray, 0] and owner == excluded[ray, 1]:
                    continue
                if is_soft:
                    side = 1 if math.copysign(1.0, dz) < 0 else 0
                    waiting[ray, side], waiting_is_loose[ray, side] = t, is_loose
                    has_distance |= 1 << ray
                if hit and (nearer or not has_distance >> ray & 1):
                    hits[ray, 0], hits[ray, 1], hits[ray, 2], hits[ray, 3] = t, u, v, dz
                    nearest[ray] = key
                    if word & SOLID_ENTRY and flags[ray] & ANY_HIT:
                        hits[ray, 0] = nearest[ray] = 0.0
                    has_distance |= 1 << ray
                    owners[ray, 0], owners[ray, 1] = index, owner
            action = _POP if is_last[level] else _LIST
