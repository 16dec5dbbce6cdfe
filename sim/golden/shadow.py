"""How much of a light gets through to a point (docs/shading.md, 5.7)."""

import numpy as np

from .bvh import MAX_DEPTH
from .compiled import compiled
from .kernel import enters, hit_triangle, next_node, trace_ray
from .surface import look

__all__ = ["MAX_LAYERS", "scratch", "visibility"]

#: Holes or clear surfaces in a row that a ray passes.
MAX_LAYERS = 64

_OPEN, _CLEAR, _SOLID = range(3)


@compiled()
def scratch():
    """Memory that :func:`visibility` works in, one for each thread."""
    return (np.empty(MAX_DEPTH + 1, np.int32), np.empty(MAX_DEPTH + 1, np.int32), np.empty(3), np.empty(3), np.empty(3),
            np.empty(3))


@compiled()
def _mesh_stops(origin, direction, t_far, instance, excluded, geometry, surfaces, looks, inverse, stack):
    """What the triangles of one instance do to the light: _OPEN, _CLEAR or _SOLID; ray in object space."""
    lower, upper, first, count, items = geometry.nodes
    node_base, item_base, triangle_base = geometry.bases[instance]
    kz = 0
    for k in (1, 2):
        if abs(direction[k]) > abs(direction[kz]):
            kz = k
    found = _OPEN
    if direction[kz] == 0.0:
        return found
    kx, ky = (kz + 1) % 3, (kz + 2) % 3
    sx, sy, sz = direction[kx] / direction[kz], direction[ky] / direction[kz], 1.0 / direction[kz]
    for k in range(3):
        inverse[k] = 1.0 / direction[k]
    stack[0] = node_base
    num_waiting = 1
    while num_waiting:
        num_waiting -= 1
        node = stack[num_waiting]
        if enters(lower[node], upper[node], origin, inverse, t_far) == np.inf:
            continue
        if not count[node]:
            num_waiting = next_node(node, node_base, lower, upper, first, origin, inverse, t_far, stack, num_waiting)
            continue
        for i in range(first[node], first[node] + count[node]):
            prim = items[item_base + i]
            if instance == excluded[0] and prim == excluded[1]:
                continue
            t, _, _ = hit_triangle(geometry.corners[triangle_base + prim], origin, kx, ky, kz, sx, sy, sz)
            if not 0.0 < t < t_far:
                continue
            if looks.solid[surfaces.material[triangle_base + prim]]:
                return _SOLID
            found = _CLEAR
    return found


@compiled()
def _stops(origin, direction, t_far, excluded, geometry, surfaces, looks, memory):
    """_SOLID if something solid is in the way, _CLEAR if only things that the shader must look at are, or _OPEN."""
    stack, mesh_stack, inverse, mesh_inverse, mesh_origin, mesh_direction = memory
    lower, upper, first, count, items = geometry.top
    for k in range(3):
        inverse[k] = 1.0 / direction[k]
    found = _OPEN
    stack[0] = 0
    num_waiting = min(1, len(first))
    while num_waiting:
        num_waiting -= 1
        node = stack[num_waiting]
        if enters(lower[node], upper[node], origin, inverse, t_far) == np.inf:
            continue
        if not count[node]:
            num_waiting = next_node(node, 0, lower, upper, first, origin, inverse, t_far, stack, num_waiting)
            continue
        for i in range(first[node], first[node] + count[node]):
            instance = items[i]
            m = geometry.inverses[instance]
            for k in range(3):
                mesh_direction[k] = m[k, 0] * direction[0] + m[k, 1] * direction[1] + m[k, 2] * direction[2]
                mesh_origin[k] = m[k, 0] * origin[0] + m[k, 1] * origin[1] + m[k, 2] * origin[2] + m[k, 3]
            found = max(found, _mesh_stops(mesh_origin, mesh_direction, t_far, instance, excluded, geometry, surfaces,
                                           looks, mesh_inverse, mesh_stack))
            if found == _SOLID:
                return found
    return found


@compiled()
def visibility(origin, direction, t_far, excluded, geometry, surfaces, looks, memory):
    """(red, green, blue) of the light that runs along a ray from 0 to ``t_far``: 1 if nothing is in the way.

    Parameters
    ----------
    origin, direction : tuple
    t_far : float
    excluded : (int, int)
        instance_id and prim_id of the lit triangle.
    geometry : Geometry
    surfaces : Surfaces
    looks : Looks
    memory : tuple
        See :func:`scratch`.
    """
    found = _stops(origin, direction, t_far, excluded, geometry, surfaces, looks, memory)
    if found != _CLEAR:
        return (1.0, 1.0, 1.0) if found == _OPEN else (0.0, 0.0, 0.0)
    # One after the other, strictly onwards: a ray through the edge of two panes passes one of them.
    passed, t_near, skipped = (1.0, 1.0, 1.0), 0.0, excluded
    for _ in range(MAX_LAYERS + 1):
        hit = trace_ray(origin, direction, t_near, skipped, geometry.top, geometry.inverses, geometry.bases,
                        geometry.nodes, geometry.corners)
        if not hit[0] < t_far or (hit[3] == excluded[0] and hit[4] == excluded[1]):
            return passed
        material, color, opacity = look(hit, geometry.bases[hit[3], 2] + hit[4], surfaces, looks)
        clear = 1.0 - opacity
        through = opacity * looks.transmission[material] * (1.0 - looks.reflection[material])
        passed = (passed[0] * (clear + through * color[0]), passed[1] * (clear + through * color[1]),
                  passed[2] * (clear + through * color[2]))
        if max(passed[0], passed[1], passed[2]) == 0.0:
            break
        t_near, skipped = hit[0], (hit[3], hit[4])
    return 0.0, 0.0, 0.0
