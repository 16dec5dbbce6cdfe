"""The tree of rays behind each pixel (docs/shading.md, section 2)."""

import math

import numba
import numpy as np

from .compiled import compiled
from .kernel import trace_ray
from .lighting import lit
from .optics import offset, reflect, refract, schlick
from .shadow import MAX_LAYERS, scratch
from .surface import look, normals
from .texture import sky_color
from .tracer import Geometry
from .vector import along, dot

__all__ = ["COUNTS", "MIN_WEIGHT", "shade_pixels"]

#: What is counted at each depth: rays = hits + misses + rays that ended in holes; those of the next depth are
#: reflection + refraction + transparency.
COUNTS = ("rays", "hits", "misses", "spent", "reflection", "refraction", "transparency", "shadow")
_RAYS, _HITS, _MISSES, _SPENT, _REFLECTION, _REFRACTION, _TRANSPARENCY, _SHADOW = range(8)

#: A ray is started only if one of its weights reaches this.
MIN_WEIGHT = 2.0**-12


@compiled()
def _weighted(weight, factor, color):
    return weight[0] * factor * color[0], weight[1] * factor * color[1], weight[2] * factor * color[2]


@compiled()
def _is_worth_it(weight):
    return max(weight[0], weight[1], weight[2]) >= MIN_WEIGHT


@compiled()
def _strengths(material, eta, c, length, kappa, is_total, looks):
    """``(reflection, refraction, local)`` that share the light: r, (1 − r)q, (1 − r)(1 − q)."""
    mirror = looks.reflection[material]
    if looks.fresnel[material]:
        # Into the thinner medium it is the refracted ray's cosine that reaches 0 where total reflection begins.
        cosine = (kappa if eta > 1.0 else -c) / length
        mirror = schlick(mirror, 0.0 if is_total else cosine)
    through = (1.0 - mirror) * looks.transmission[material]
    local = (1.0 - mirror) * (1.0 - looks.transmission[material])
    if is_total:
        return mirror + through, 0.0, local
    return mirror, through, local


@compiled()
def _shade_hit(ray, hit, triangle, seen, weight, is_last, lamps, geometry, surfaces, looks, ambient, memory, sum_,
               counts):
    """Adds what the surface sends itself to ``sum_``, and gives its children's rays.

    Returns
    -------
    ((origin, direction, weight) of the reflection ray, the same of the refraction ray); a weight of 0 is no ray.
    """
    origin, direction, length = ray
    material, color, opacity = seen
    excluded = hit[3], hit[4]
    front, flat, normal = normals(hit, direction, geometry.corners[triangle], geometry.inverses[hit[3]], surfaces)
    point = along(origin, hit[0], direction)
    c = dot(direction, normal)
    mirrored = reflect(direction, normal, c)
    steady, steady_c = (normal, c) if c < 0.0 else (flat, dot(direction, flat))

    eta, kappa, bent, is_total = 1.0, -steady_c, direction, False
    if looks.transmission[material] > 0.0 and not looks.thin[material]:
        eta = 1.0 / looks.ior[material] if front else looks.ior[material]
        kappa, bent = refract(direction, steady, steady_c, length * length, eta)
        is_total = kappa < 0.0
    reflection, refraction, local = _strengths(material, eta, steady_c, length, kappa, is_total, looks)

    tint = color if looks.tinted[material] else (1.0, 1.0, 1.0)
    gloss = looks.specular[material]
    diffuse, specular = (0.0, 0.0, 0.0), (0.0, 0.0, 0.0)
    if local > 0.0 or gloss > 0.0:
        diffuse, specular, num_rays = lit(point, origin, normal, mirrored, length, looks.squarings[material], excluded,
                                          lamps, geometry, surfaces, looks, memory)
        counts[_SHADOW] += num_rays
    for k in range(3):
        sum_[k] += weight[k] * opacity * (looks.emission[material, k] + local * color[k] * (ambient[k] + diffuse[k])
                                          + gloss * tint[k] * specular[k])
    nothing = (0.0, 0.0, 0.0)
    if is_last:
        return (point, direction, nothing), (point, direction, nothing)
    return ((offset(point, steady, origin, 1.0), reflect(direction, steady, steady_c),
             _weighted(weight, opacity * reflection, tint)),
            (offset(point, steady, origin, -1.0), bent, _weighted(weight, opacity * refraction, color)))


@compiled()
def _push(pending, number, ray, depth, excluded, t_near):
    origins, directions, weights, limits, owners = pending
    for k in range(3):
        origins[number, k], directions[number, k], weights[number, k] = ray[0][k], ray[1][k], ray[2][k]
    limits[number] = t_near
    owners[number, 0], owners[number, 1], owners[number, 2] = excluded[0], excluded[1], depth
    return number + 1


@compiled()
def _shade_pixel(pending, length, max_depth, geometry, surfaces, looks, lamps, ambient, sky, sky_size, background,
                 memory, sum_, counts):
    """Adds up one pixel's colour; its primary ray is the first pending one."""
    origins, directions, weights, limits, owners = pending
    num_pending = 1
    while num_pending:
        n = num_pending - 1
        origin = origins[n, 0], origins[n, 1], origins[n, 2]
        direction = directions[n, 0], directions[n, 1], directions[n, 2]
        weight = weights[n, 0], weights[n, 1], weights[n, 2]
        t_near, excluded, depth = limits[n], (owners[n, 0], owners[n, 1]), owners[n, 2]
        num_pending = n
        here = counts[depth]
        here[_RAYS] += 1
        layers = 0
        while True:
            hit = trace_ray(origin, direction, t_near, excluded, geometry.top, geometry.inverses, geometry.bases,
                            geometry.nodes, geometry.corners)
            if hit[4] < 0:
                color = background
                if sky_size:
                    color = sky_color(sky, sky_size, looks.decoded, direction)
                for k in range(3):
                    sum_[k] += weight[k] * color[k]
                here[_MISSES] += 1
                break
            triangle = geometry.bases[hit[3], 2] + hit[4]
            seen = look(hit, triangle, surfaces, looks)
            if seen[2] == 0.0:
                layers += 1
                if layers > MAX_LAYERS:
                    here[_SPENT] += 1
                    break
                t_near, excluded = hit[0], (hit[3], hit[4])
                continue
            here[_HITS] += 1
            is_last = depth >= max_depth
            mirrored, bent = _shade_hit((origin, direction, length), hit, triangle, seen, weight, is_last, lamps,
                                        geometry, surfaces, looks, ambient, memory, sum_, here)
            if is_last:
                break
            owner = hit[3], hit[4]
            if _is_worth_it(mirrored[2]):
                num_pending = _push(pending, num_pending, mirrored, depth + 1, owner, 0.0)
                here[_REFLECTION] += 1
            if _is_worth_it(bent[2]):
                num_pending = _push(pending, num_pending, bent, depth + 1, owner, 0.0)
                here[_REFRACTION] += 1
            behind = (origin, direction, _weighted(weight, 1.0 - seen[2], (1.0, 1.0, 1.0)))
            if _is_worth_it(behind[2]):
                num_pending = _push(pending, num_pending, behind, depth + 1, owner, hit[0])
                here[_TRANSPARENCY] += 1
            break


@compiled(parallel=True)
def shade_pixels(eye, directions, max_depth, top, inverses, bases, nodes, corners, surfaces, looks, lamps, ambient, sky,
                 sky_size, background, colors, counts):
    """Linear colours of pixels.

    Parameters
    ----------
    eye : float64[3]
        Origin of all primary rays.
    directions : float64[H, W, 3]
    max_depth : int
    top, inverses, bases, nodes, corners
        The scene's Geometry, taken apart because numba's loops do not take tuples of tuples.
    surfaces, looks, lamps
        The rest of the scene.
    ambient, background : tuple
        Linear colours.
    sky : uint8[N², 4]
    sky_size : int
        N, 0 for none.
    colors : float64[H, W, 3]
        Receives the sums.
    counts : int64[H, max_depth + 1, 8]
        Receives :data:`COUNTS` of each row and depth.
    """
    height, width = directions.shape[:2]
    for row in numba.prange(height):
        memory = scratch()
        geometry = Geometry(top, inverses, bases, nodes, corners)
        size = 2 * max_depth + 3
        pending = (np.empty((size, 3)), np.empty((size, 3)), np.empty((size, 3)), np.empty(size),
                   np.empty((size, 3), np.int64))
        for column in range(width):
            d = directions[row, column]
            direction = d[0], d[1], d[2]
            _push(pending, 0, ((eye[0], eye[1], eye[2]), direction, (1.0, 1.0, 1.0)), 0, (-1, -1), 0.0)
            _shade_pixel(pending, math.sqrt(dot(direction, direction)), max_depth, geometry, surfaces, looks, lamps,
                         ambient, sky, sky_size, background, memory, colors[row, column], counts[row])
