"""A built-in scene: the room lit indirectly by 200 virtual point lights (paper, section 5.2).

Keller: Instant radiosity, SIGGRAPH 1997: light is followed from its sources, and each place that it meets becomes a
small lamp that shines by Lambert's law. The sources are the sun through the window and the sky in it.
"""

import math

import numpy as np

from .camera import Camera
from .light import Light
from .mirror_room import SUN, furnished_room
from .normals import flat_normals
from .scene import IDENTITY, Instance, Scene
from .sky import Sky
from .srgb import decode

__all__ = ["NUM_LIGHTS", "vpl_scene"]

NUM_LIGHTS = 200
# The window's opening, in the plane y = 6.2 outside of the wall: lower corner and size.
_CORNER, _SIZE = np.array((1.5, 6.19, 0.9)), np.array((2.0, 1.3))
_SUNLIGHT, _SKYLIGHT = np.array((1.0, 0.86, 0.64)) * 9.0, np.array((0.62, 0.80, 1.0)) * 5.0
# Of 200: patches of the window itself, and paths of sunlight and skylight, which give a lamp where they end first; the
# rest are second bounces.
_NUM_PATCHES, _NUM_SUN, _NUM_SKY = 32, 72, 40


def _halton(count, base, start=20):
    """Numbers of Halton's sequence to one base, float64[count]."""
    values = np.zeros(count)
    for k in range(count):
        index, digit = k + start, 1.0
        while index:
            digit /= base
            values[k] += digit * (index % base)
            index //= base
    return values


def _meets(corners, origins, directions):
    """``(triangle, t)`` that each ray meets first, −1 and ∞ for none: Möller and Trumbore's test of all with all."""
    edge1, edge2 = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    across = np.cross(directions[:, None], edge2)
    with np.errstate(divide="ignore", invalid="ignore"):
        scale = 1 / (across * edge1).sum(axis=-1)
        away = origins[:, None] - corners[:, 0]
        u = (across * away).sum(axis=-1) * scale
        up = np.cross(away, edge1)
        v = (up * directions[:, None]).sum(axis=-1) * scale
        t = (up * edge2).sum(axis=-1) * scale
        t = np.where((u >= 0) & (v >= 0) & (u + v <= 1) & (t > 1e-6), t, math.inf)
    first = t.argmin(axis=1)
    nearest = t[np.arange(len(t)), first]
    return np.where(nearest < math.inf, first, -1), nearest


def _lambert(normals, r1, r2):
    """Directions about unit normals float64[N, 3], as many as the cosine to it."""
    side = np.cross(normals, np.where(np.abs(normals[:, :1]) > 0.5, (0.0, 1, 0), (1.0, 0, 0)))
    side /= np.linalg.norm(side, axis=1, keepdims=True)
    radius, angle = np.sqrt(r1)[:, None], (2 * math.pi * r2)[:, None]
    return (radius * np.cos(angle) * side + radius * np.sin(angle) * np.cross(normals, side)
            + np.sqrt(1 - r1)[:, None] * normals)


def _window(count, bases):
    """Points in the window's opening."""
    s, t = (_halton(count, base) for base in bases)
    return _CORNER + np.stack([s * _SIZE[0], np.zeros(count), t * _SIZE[1]], axis=1)


def _bounce(mesh, albedo, origins, directions, strength):
    """Where rays end: ``(points, normals, strength)`` of the lamps there, only of rays that meet something."""
    corners = mesh.vertices[mesh.triangles]
    triangle, t = _meets(corners, origins, directions)
    hit = triangle >= 0
    triangle, directions = triangle[hit], directions[hit]
    normals = flat_normals(corners[triangle])
    normals *= -np.sign((normals * directions).sum(axis=1, keepdims=True))
    points = origins[hit] + t[hit, None] * directions + 0.02 * normals
    return points, normals, strength[hit] * albedo[mesh.material_ids[triangle]]


def _albedo(materials):
    """Mean colour of each material, textures included, float64[M, 3]."""
    return np.array([np.array(material.base_color) * (
        decode(material.texture.pixels[..., :3]).mean(axis=(0, 1)) if material.texture else 1.0)
        for material in materials])


def vpl_lights(mesh, materials):
    """The 200 lights.

    A white surface shows 1/π of the light that falls on it, so a piece of window with radiance L and area A becomes
    intensity L·A/π, and the end of one of n paths ρ/n times what came in by all of them.
    """
    albedo, area = _albedo(materials), float(np.prod(_SIZE))
    inwards = np.tile((0.0, -1, 0), (_NUM_SKY, 1))
    through = -SUN[1] / np.linalg.norm(SUN)
    sun = _bounce(mesh, albedo, _window(_NUM_SUN, (2, 3)), np.tile(SUN, (_NUM_SUN, 1)),
                  np.tile(_SUNLIGHT * through * area / math.pi / _NUM_SUN, (_NUM_SUN, 1)))
    sky = _bounce(mesh, albedo, _window(_NUM_SKY, (2, 3)),
                  _lambert(inwards, _halton(_NUM_SKY, 5), _halton(_NUM_SKY, 7)),
                  np.tile(_SKYLIGHT * area / math.pi / _NUM_SKY, (_NUM_SKY, 1)))
    once = [np.concatenate(pair) for pair in zip(sun, sky, strict=True)]
    count = len(once[0])
    twice = _bounce(mesh, albedo, once[0], _lambert(once[1], _halton(count, 11), _halton(count, 13)), once[2])
    patches = _window(_NUM_PATCHES, (2, 3))
    lamps = [(patches, np.tile((0.0, -1, 0), (_NUM_PATCHES, 1)),
              np.tile(_SKYLIGHT * area / math.pi / _NUM_PATCHES, (_NUM_PATCHES, 1))), once]
    room = NUM_LIGHTS - _NUM_PATCHES - count
    # As many second bounces as there is room for, made stronger for those that are left out.
    chosen = np.linspace(0, len(twice[0]) - 1, room).astype(int)
    lamps.append([twice[0][chosen], twice[1][chosen], twice[2][chosen] * len(twice[0]) / room])
    return [Light.patch(point, normal, color=tuple(strength.tolist()), radius=0.5, name=f"lamp {number}")
            for number, (point, normal, strength) in enumerate(
                zip(*(np.concatenate(parts) for parts in zip(*lamps, strict=True)), strict=True))]


def vpl_scene():
    """The scene ``vpl``: the room, its sun, and 200 virtual point lights in place of ambient light."""
    mesh, materials = furnished_room()
    sky = Sky.gradient(zenith=(0.30, 0.50, 0.85), horizon=(0.85, 0.95, 1.0), ground=(0.35, 0.42, 0.25), sun=-SUN)
    sun = Light("directional", color=tuple((_SUNLIGHT / math.pi).tolist()), direction=SUN, name="sun")
    camera = Camera((4.55, 0.55, 1.70), (1.45, 3.75, 0.95), (0.0, 0.0, 1.0), 68.0, "corner")
    lights = [sun, *vpl_lights(mesh, materials)]
    return Scene([mesh], [Instance(0, IDENTITY, "room")], materials, [camera], lights=lights, sky=sky)
