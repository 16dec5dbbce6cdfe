"""From a hit to what is there: colour and opacity, point and normals (docs/shading.md, sections 3 and 4)."""

from .compiled import compiled
from .tables import ALPHA_BLEND, ALPHA_MASK
from .texture import sample
from .vector import along, dot, minus, scaled, unit

__all__ = ["look", "normals"]


@compiled()
def look(hit, triangle, surfaces, looks):
    """``(material, colour, opacity)`` at a hit (t, u, v, instance_id, prim_id), alpha mode applied.

    Parameters
    ----------
    hit : tuple
    triangle : int
        The triangle's number among those of all meshes.
    surfaces : Surfaces
    looks : Looks
    """
    u, v, instance, prim = hit[1], hit[2], hit[3], hit[4]
    material = surfaces.material[triangle]
    base = looks.base_color[material]
    color = base[0], base[1], base[2]
    opacity = looks.opacity[material]
    texture = looks.texture[material]
    start = surfaces.bases[instance, 1]
    if texture >= 0 and start >= 0:
        uvs = surfaces.uvs[start + prim]
        s = uvs[0, 0] + u * (uvs[1, 0] - uvs[0, 0]) + v * (uvs[2, 0] - uvs[0, 0])
        t = uvs[0, 1] + u * (uvs[1, 1] - uvs[0, 1]) + v * (uvs[2, 1] - uvs[0, 1])
        texel = sample(looks.texels, looks.layout[texture], looks.decoded, s, t)
        color = color[0] * texel[0], color[1] * texel[1], color[2] * texel[2]
        opacity *= texel[3]
    if looks.alpha[material] == ALPHA_MASK:
        opacity = 1.0 if opacity >= looks.cutoff[material] else 0.0
    elif looks.alpha[material] != ALPHA_BLEND:
        opacity = 1.0
    return material, color, opacity


@compiled()
def _to_world(inverse, normal):
    """Unit A⁻ᵀ·N with ``inverse`` = [A⁻¹ | …]."""
    return unit((inverse[0, 0] * normal[0] + inverse[1, 0] * normal[1] + inverse[2, 0] * normal[2],
                 inverse[0, 1] * normal[0] + inverse[1, 1] * normal[1] + inverse[2, 1] * normal[2],
                 inverse[0, 2] * normal[0] + inverse[1, 2] * normal[1] + inverse[2, 2] * normal[2]))


@compiled()
def normals(hit, direction, corners, inverse, surfaces):
    """``(front, flat, normal)``: is the front seen, and unit normals in the world, both turned to the seen side.

    Parameters
    ----------
    hit : tuple
        t, u, v, instance_id, prim_id.
    direction : tuple
        Of the ray, in the world.
    corners : float64[3, 3]
        Of the triangle, in object space.
    inverse : float64[3, 4]
        World to object space.
    surfaces : Surfaces
    """
    v0 = corners[0, 0], corners[0, 1], corners[0, 2]
    e1 = unit(minus((corners[1, 0], corners[1, 1], corners[1, 2]), v0))
    e2 = unit(minus((corners[2, 0], corners[2, 1], corners[2, 2]), v0))
    flat = _to_world(inverse, (e1[1] * e2[2] - e1[2] * e2[1], e1[2] * e2[0] - e1[0] * e2[2],
                               e1[0] * e2[1] - e1[1] * e2[0]))
    front = dot(direction, flat) < 0.0
    side = 1.0 if front else -1.0
    normal = flat
    start = surfaces.bases[hit[3], 0]
    if start >= 0:
        n = surfaces.normals[start + hit[4]]
        n0 = n[0, 0], n[0, 1], n[0, 2]
        mixed = along(along(n0, hit[1], minus((n[1, 0], n[1, 1], n[1, 2]), n0)),
                      hit[2], minus((n[2, 0], n[2, 1], n[2, 2]), n0))
        mixed = _to_world(inverse, mixed)
        # Opposite corner normals may cancel: then there is but the triangle's own.
        if dot(mixed, mixed) > 0.0:
            normal = mixed
    return front, scaled(flat, side), scaled(normal, side)
