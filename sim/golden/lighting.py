"""The light that reaches a point from all lights (docs/shading.md, section 5)."""

import math

from .compiled import compiled
from .optics import offset, slack
from .shadow import visibility
from .vector import dot, largest, minus, scaled

__all__ = ["lit"]

_SPOT, _DIRECTIONAL = 1, 2


@compiled()
def _squared(x, times):
    for _ in range(times):
        x *= x
    return x


@compiled()
def _vector(rows, k):
    return rows[k, 0], rows[k, 1], rows[k, 2]


@compiled()
def lit(point, origin, normal, mirrored, length, squarings, excluded, lamps, geometry, surfaces, looks, memory):
    """``(diffuse, specular, num_shadow_rays)``: ΣVE·max(0, −N·S y) and ΣVE·max(0, −R·S y/d)^n.

    Parameters
    ----------
    point : tuple
        P.
    origin : tuple
        O of the ray that found it.
    normal : tuple
        N, unit, on the viewer's side.
    mirrored : tuple
        R = D − 2(D·N)N.
    length : float
        d = |D| = |R|.
    squarings : int
        log₂ n.
    excluded : (int, int)
        instance_id and prim_id of the triangle.
    lamps, geometry, surfaces, looks, memory
        As for :func:`sim.golden.shadow.visibility`.
    """
    diffuse, specular = (0.0, 0.0, 0.0), (0.0, 0.0, 0.0)
    num_rays = 0
    for k in range(len(lamps.kind)):
        is_directional = lamps.kind[k] == _DIRECTIONAL
        place = _vector(lamps.position, k)
        travel = _vector(lamps.direction, k) if is_directional else minus(point, place)
        distance2 = dot(travel, travel)
        if distance2 == 0.0:
            continue
        y = 1.0 / math.sqrt(distance2)
        cosine = -dot(normal, travel) * y
        if not cosine > 0.0:
            continue
        strength = 1.0
        if not is_directional:
            fade = distance2 * lamps.fading[k]
            strength = min(1.0 / distance2, lamps.nearest[k]) * max(0.0, 1.0 - fade * fade)
            if lamps.kind[k] == _SPOT:
                inside = dot(travel, _vector(lamps.direction, k)) * y * lamps.cone[k, 0] + lamps.cone[k, 1]
                strength *= _squared(min(max(inside, 0.0), 1.0), lamps.squarings[k])
        light = scaled(_vector(lamps.color, k), strength)
        if not largest(light) > 0.0:
            continue
        num_rays += 1
        if is_directional:
            seen = visibility(offset(point, normal, origin, 1.0), scaled(travel, -1.0), math.inf, excluded, geometry,
                              surfaces, looks, memory)
        else:
            seen = visibility(place, travel, 1.0 - slack(place, point) * y, excluded, geometry, surfaces, looks, memory)
        shine = _squared(min(max(-dot(mirrored, travel) * y / length, 0.0), 1.0), squarings)
        light = light[0] * seen[0], light[1] * seen[1], light[2] * seen[2]
        diffuse = diffuse[0] + light[0] * cosine, diffuse[1] + light[1] * cosine, diffuse[2] + light[2] * cosine
        specular = specular[0] + light[0] * shine, specular[1] + light[1] * shine, specular[2] + light[2] * shine
    return diffuse, specular, num_rays
