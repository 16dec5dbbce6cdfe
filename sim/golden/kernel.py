"""Closest hits of rays in a two-level scene, in float64.

The triangle test is Woop, Benthin, Wald: Watertight ray/triangle intersection, JCGT 2013: the two triangles
at an edge compute its edge function from the same numbers, exactly negated, so no ray passes between them.
Boxes are widened as by Ize: Robust BVH ray traversal, JCGT 2013.
"""

import numba
import numpy as np

from .bvh import MAX_DEPTH

__all__ = ["enters", "hit_triangle", "next_node", "trace_ray", "trace_rays"]

_STACK_DEPTH = MAX_DEPTH + 1
# Bound on the relative error of the slab distances, on the far side: 1 + 2·gamma(3) and some.
_WIDEN = 1.0 + 8 * 2.0 ** -53


@numba.njit(cache=True, error_model="numpy")
def enters(lower, upper, origin, inverse, t_far):
    """Distance at which the ray enters the box, inf if it does not before ``t_far``."""
    t_near = 0.0
    for k in range(3):
        t0 = (lower[k] - origin[k]) * inverse[k]
        t1 = (upper[k] - origin[k]) * inverse[k]
        if t0 > t1:
            t0, t1 = t1, t0
        # 0 · inf, a ray in the plane of a face, is NaN: these comparisons let it pass.
        if t0 > t_near:
            t_near = t0
        if t1 * _WIDEN < t_far:
            t_far = t1 * _WIDEN
    return t_near if t_near <= t_far else np.inf


@numba.njit(cache=True, error_model="numpy")
def hit_triangle(corners, origin, kx, ky, kz, sx, sy, sz):
    """(t, u, v), or t = inf on a miss; the ray is sheared to run along +z from 0."""
    ax, ay = corners[0, kx] - origin[kx], corners[0, ky] - origin[ky]
    bx, by = corners[1, kx] - origin[kx], corners[1, ky] - origin[ky]
    cx, cy = corners[2, kx] - origin[kx], corners[2, ky] - origin[ky]
    az, bz, cz = corners[0, kz] - origin[kz], corners[1, kz] - origin[kz], corners[2, kz] - origin[kz]
    ax, ay = ax - sx * az, ay - sy * az
    bx, by = bx - sx * bz, by - sy * bz
    cx, cy = cx - sx * cz, cy - sy * cz
    e0, e1, e2 = cx * by - cy * bx, ax * cy - ay * cx, bx * ay - by * ax
    if (e0 < 0.0 or e1 < 0.0 or e2 < 0.0) and (e0 > 0.0 or e1 > 0.0 or e2 > 0.0):
        return np.inf, 0.0, 0.0
    det = e0 + e1 + e2
    if det == 0.0:
        return np.inf, 0.0, 0.0
    return sz * (e0 * az + e1 * bz + e2 * cz) / det, e1 / det, e2 / det


@numba.njit(cache=True, error_model="numpy")
def next_node(node, base, lower, upper, first, origin, inverse, t_far, stack, num_waiting):
    """Put those children of an inner node on the stack that the ray enters, the nearer one on top."""
    child = base + first[node]
    t0 = enters(lower[child], upper[child], origin, inverse, t_far)
    t1 = enters(lower[child + 1], upper[child + 1], origin, inverse, t_far)
    near = 0 if t0 <= t1 else 1
    if max(t0, t1) < np.inf:
        stack[num_waiting] = child + 1 - near
        num_waiting += 1
    if min(t0, t1) < np.inf:
        stack[num_waiting] = child + near
        num_waiting += 1
    return num_waiting


@numba.njit(cache=True, error_model="numpy")
def _trace_mesh(origin, direction, t_min, best, nodes, corners, bases, instance_id, excluded, inverse, stack):
    """Improve ``best`` = (t, u, v, instance_id, prim_id) by the triangles of one instance, ray in object space."""
    lower, upper, first, count, items = nodes
    node_base, item_base, triangle_base = bases[0], bases[1], bases[2]
    kz = 0
    for k in (1, 2):
        if abs(direction[k]) > abs(direction[kz]):
            kz = k
    if direction[kz] == 0.0:
        return best
    kx, ky = (kz + 1) % 3, (kz + 2) % 3
    sx, sy, sz = direction[kx] / direction[kz], direction[ky] / direction[kz], 1.0 / direction[kz]
    for k in range(3):
        inverse[k] = 1.0 / direction[k]
    stack[0] = node_base
    num_waiting = 1
    while num_waiting:
        num_waiting -= 1
        node = stack[num_waiting]
        if enters(lower[node], upper[node], origin, inverse, best[0]) == np.inf:
            continue
        if not count[node]:
            num_waiting = next_node(node, node_base, lower, upper, first, origin, inverse, best[0], stack,
                                     num_waiting)
            continue
        for i in range(first[node], first[node] + count[node]):
            prim_id = items[item_base + i]
            if instance_id == excluded[0] and prim_id == excluded[1]:
                continue
            t, u, v = hit_triangle(corners[triangle_base + prim_id], origin, kx, ky, kz, sx, sy, sz)
            if t_min < t < np.inf and (t < best[0] or (t == best[0] and (
                    instance_id < best[3] or (instance_id == best[3] and prim_id < best[4])))):
                best = (t, u, v, instance_id, prim_id)
    return best


@numba.njit(cache=True, error_model="numpy")
def trace_ray(origin, direction, t_min, excluded, top, inverses, bases, nodes, corners):
    """Closest hit of one ray: (t, u, v, instance_id, prim_id)."""
    lower, upper, first, count, items = top
    best = (np.inf, 0.0, 0.0, np.int64(-1), np.int64(-1))
    stack, mesh_stack = np.empty(_STACK_DEPTH, np.int32), np.empty(_STACK_DEPTH, np.int32)
    inverse, mesh_inverse = np.empty(3), np.empty(3)
    mesh_origin, mesh_direction = np.empty(3), np.empty(3)
    for k in range(3):
        inverse[k] = 1.0 / direction[k]
    stack[0] = 0
    num_waiting = min(1, len(first))
    while num_waiting:
        num_waiting -= 1
        node = stack[num_waiting]
        if enters(lower[node], upper[node], origin, inverse, best[0]) == np.inf:
            continue
        if not count[node]:
            num_waiting = next_node(node, 0, lower, upper, first, origin, inverse, best[0], stack, num_waiting)
            continue
        for i in range(first[node], first[node] + count[node]):
            instance = items[i]
            m = inverses[instance]
            for k in range(3):
                mesh_direction[k] = m[k, 0] * direction[0] + m[k, 1] * direction[1] + m[k, 2] * direction[2]
                mesh_origin[k] = m[k, 0] * origin[0] + m[k, 1] * origin[1] + m[k, 2] * origin[2] + m[k, 3]
            best = _trace_mesh(mesh_origin, mesh_direction, t_min, best, nodes, corners, bases[instance],
                               np.int64(instance), excluded, mesh_inverse, mesh_stack)
    return best


@numba.njit(cache=True, parallel=True)
def trace_rays(origins, directions, t_min, excluded, top, inverses, bases, nodes, corners, ids, distances):
    """Closest hit of every ray; ties go to the lowest (instance_id, prim_id).

    Parameters
    ----------
    origins, directions : float64[N, 3]
    t_min : float
        Hits at t ≤ t_min do not count.
    excluded : int32[2, N]
        instance_id and prim_id of a triangle that the ray ignores, −1 for none.
    top : Bvh
        Over the instances' world boxes.
    inverses : float64[I, 3, 4]
        World to object space.
    bases : int64[I, 3]
        Where the nodes, items and triangles of an instance's mesh start in ``nodes`` and ``corners``.
    nodes : Bvh
        All meshes' hierarchies, one after the other.
    corners : float64[T, 3, 3]
    ids : int32[2, N]
        Receives instance_id and prim_id, −1 on a miss.
    distances : float64[3, N]
        Receives t, u, v; inf, 0, 0 on a miss.
    """
    for ray in numba.prange(len(origins)):
        hit = trace_ray(origins[ray], directions[ray], t_min, (excluded[0, ray], excluded[1, ray]), top, inverses,
                         bases, nodes, corners)
        distances[0, ray], distances[1, ray], distances[2, ray] = hit[0], hit[1], hit[2]
        ids[0, ray], ids[1, ray] = hit[3], hit[4]
