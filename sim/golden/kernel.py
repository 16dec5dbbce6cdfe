"""Closest hits of rays in a two-level scene, in float64.

The triangle test is Woop, Benthin, Wald: Watertight ray/triangle intersection, JCGT 2013: the two triangles
at an edge compute its edge function from the same numbers, exactly negated, so no ray passes between them.
Boxes are widened as by Ize: Robust BVH ray traversal, JCGT 2013.
"""

import math

import numba
import numpy as np

__all__ = ["trace_rays"]

_STACK_DEPTH = 128
# Bound on the relative error of the slab distances, on the far side: 1 + 2·gamma(3) and some.
_WIDEN = 1.0 + 8 * 2.0 ** -53


@numba.njit(cache=True, error_model="numpy")
def _enters(lower, upper, origin, inverse, t_far):
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
def _hit_triangle(corners, origin, kx, ky, kz, sx, sy, sz):
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
def _trace_mesh(origin, direction, t_min, best, nodes, corners, node_base, item_base, triangle_base, instance_id,
                excluded, stack):
    """Improve ``best`` = (t, u, v, instance_id, prim_id) by the triangles of one instance, ray in object space."""
    lower, upper, first, count, items = nodes
    kz = 0
    for k in (1, 2):
        if abs(direction[k]) > abs(direction[kz]):
            kz = k
    if direction[kz] == 0.0:
        return best
    kx, ky = (kz + 1) % 3, (kz + 2) % 3
    sx, sy, sz = direction[kx] / direction[kz], direction[ky] / direction[kz], 1.0 / direction[kz]
    inverse = 1.0 / direction
    stack[0] = 0
    num_waiting = 1
    while num_waiting:
        num_waiting -= 1
        node = node_base + stack[num_waiting]
        if _enters(lower[node], upper[node], origin, inverse, best[0]) == np.inf:
            continue
        if not count[node]:
            # The nearer child is taken next; ties in distance do not matter for the result.
            child = node_base + first[node]
            t0 = _enters(lower[child], upper[child], origin, inverse, best[0])
            t1 = _enters(lower[child + 1], upper[child + 1], origin, inverse, best[0])
            far = 1 if t0 <= t1 else 0
            for which, t in ((far, t1 if far else t0), (1 - far, t0 if far else t1)):
                if t < np.inf:
                    stack[num_waiting] = first[node] + which
                    num_waiting += 1
            continue
        for i in range(first[node], first[node] + count[node]):
            prim_id = items[item_base + i]
            if instance_id == excluded[0] and prim_id == excluded[1]:
                continue
            t, u, v = _hit_triangle(corners[triangle_base + prim_id], origin, kx, ky, kz, sx, sy, sz)
            if t_min < t < np.inf and (t < best[0] or t == best[0] and (
                    instance_id < best[3] or instance_id == best[3] and prim_id < best[4])):
                best = (t, u, v, instance_id, prim_id)
    return best


@numba.njit(cache=True, error_model="numpy")
def _unit_normal(corners):
    a, b = corners[1] - corners[0], corners[2] - corners[0]
    # Scaled first, so that tiny triangles' products do not underflow.
    a, b = a / np.abs(a).max(), b / np.abs(b).max()
    normal = np.array((a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]))
    return normal / math.sqrt(normal[0] ** 2 + normal[1] ** 2 + normal[2] ** 2)


@numba.njit(cache=True, parallel=True, error_model="numpy")
def trace_rays(origins, directions, t_min, excluded_instance, excluded_prim, top, inverses, mesh_of, bases, nodes, corners,
               instance_ids, prim_ids, ts, us, vs, dots):
    """Closest hit of every ray; ties go to the lowest (instance_id, prim_id).

    Parameters
    ----------
    origins, directions : float64[N, 3]
    t_min : float
        Hits at t ≤ t_min do not count.
    excluded_instance, excluded_prim : int32[N]
        A triangle that the ray ignores, −1 for none.
    top : Bvh
        Over the instances' world boxes.
    inverses : float64[I, 3, 4]
        World to object space.
    mesh_of : int32[I]
    bases : int64[M, 3]
        Where a mesh's nodes, items and triangles start in ``nodes`` and ``corners``.
    nodes : Bvh
        All meshes' hierarchies, one after the other.
    corners : float64[T, 3, 3]
    instance_ids, prim_ids, ts, us, vs, dots : arrays[N]
        Results; see :class:`sim.golden.tracer.Hits`.
    """
    top_lower, top_upper, top_first, top_count, top_items = top
    for ray in numba.prange(len(origins)):
        origin, direction = origins[ray], directions[ray]
        inverse = 1.0 / direction
        excluded = (excluded_instance[ray], excluded_prim[ray])
        best = (np.inf, 0.0, 0.0, np.int64(-1), np.int64(-1))
        top_stack, stack = np.empty(_STACK_DEPTH, np.int32), np.empty(_STACK_DEPTH, np.int32)
        object_origin, object_direction = np.empty(3), np.empty(3)
        top_stack[0] = 0
        num_waiting = 1 if len(top_first) else 0
        while num_waiting:
            num_waiting -= 1
            node = top_stack[num_waiting]
            if _enters(top_lower[node], top_upper[node], origin, inverse, best[0]) == np.inf:
                continue
            if not top_count[node]:
                child = top_first[node]
                t0 = _enters(top_lower[child], top_upper[child], origin, inverse, best[0])
                t1 = _enters(top_lower[child + 1], top_upper[child + 1], origin, inverse, best[0])
                nearer = 0 if t0 <= t1 else 1
                top_stack[num_waiting] = child + 1 - nearer
                top_stack[num_waiting + 1] = child + nearer
                num_waiting += 2
                continue
            for i in range(top_first[node], top_first[node] + top_count[node]):
                instance = top_items[i]
                m = inverses[instance]
                for k in range(3):
                    object_origin[k] = m[k, 0] * origin[0] + m[k, 1] * origin[1] + m[k, 2] * origin[2] + m[k, 3]
                    object_direction[k] = m[k, 0] * direction[0] + m[k, 1] * direction[1] + m[k, 2] * direction[2]
                node_base, item_base, triangle_base = bases[mesh_of[instance]]
                best = _trace_mesh(object_origin, object_direction, t_min, best, nodes, corners, node_base, item_base,
                                   triangle_base, np.int64(instance), excluded, stack)
        instance_ids[ray], prim_ids[ray] = best[3], best[4]
        ts[ray], us[ray], vs[ray] = best[0], best[1], best[2]
        dots[ray] = 0.0
        if best[3] >= 0:
            normal = _unit_normal(corners[bases[mesh_of[best[3]], 2] + best[4]])
            m = inverses[best[3]]
            for k in range(3):
                dots[ray] += normal[k] * (m[k, 0] * direction[0] + m[k, 1] * direction[1] + m[k, 2] * direction[2])
