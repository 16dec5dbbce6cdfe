"""A built-in scene: the paper's SunCOR (Table 3), a field of 5,622 sunflowers of 33,288 triangles each.

Metres, z up. There is no ground: what is below the horizon is the sky's, so all 187,145,136 triangles are sunflowers.
"""

import math

import numpy as np

from .camera import Camera
from .light import Light
from .material import Material
from .patterns import blend, noise, texture
from .scene import Instance, Scene
from .shapes import Shape, grid, joined, lathe, tube
from .sky import Sky

__all__ = ["NUM_FLOWERS", "NUM_TRIANGLES", "sunflower", "sunflowers_scene"]

NUM_FLOWERS = 5622
#: Of one sunflower: stem 576, leaves 12 × 192, bracts 34 × 24, petals 55 × 72, head 2 × 360, florets 1,038 × 24.
NUM_TRIANGLES = 33_288

_STALK, _LEAF, _PETAL, _DISC, _BUD = range(5)
_GOLDEN_ANGLE = math.pi * (3 - math.sqrt(5))
_HEIGHT, _HEAD_RADIUS = 1.65, 0.125


def _turned(angle):
    """Rotation about z, [A | 0]."""
    c, s = math.cos(angle), math.sin(angle)
    return np.array([[c, -s, 0, 0], [s, c, 0, 0], [0, 0, 1.0, 0]])


def _times(outer, inner):
    """The affine map ``outer`` after ``inner``."""
    return np.column_stack([outer[:, :3] @ inner[:, :3], outer[:, :3] @ inner[:, 3] + outer[:, 3]])


def _blade(length, width, *, droop, fold, num_along, num_across, tip=1.0):
    """Leaf or petal from the origin along +x: width·(sin πu)^tip across, hanging by droop·u², folded in its middle."""
    def surface(u, v):
        half = width / 2 * np.sin(np.pi * np.clip(u, 0.02, 0.985)) ** tip * (1 - 0.25 * u)
        side = 2 * v - 1
        return np.stack([length * u, side * half, -droop * u**2 + fold * np.abs(side) * half], axis=-1)

    return grid(surface, num_along, num_across)


def _disc(radius, height, rows, *, upwards):
    """Cap of 24 segments about z, from its middle to the rim; 48·rows − 24 triangles."""
    s = np.linspace(0, 1, rows + 1)
    profile = np.stack([radius * s, height * (1 - s**2)], axis=1)
    return lathe(profile[::-1] if upwards else profile, 24)


def _head():
    """The flower's head facing +z, with its middle at the origin: (shape, material) pairs."""
    parts = [(_disc(_HEAD_RADIUS, 0.022, 8, upwards=True), _DISC),
             (_disc(_HEAD_RADIUS, -0.05, 8, upwards=False), _STALK)]
    floret = lathe([(1.0, 0.0), (0.95, 1.6), (0.12, 2.2)], 6)
    for k in range(1038):
        distance = math.sqrt((k + 0.5) / 1038)
        # Buds in the middle are small and closed, ripe ones outside stand higher.
        size = _HEAD_RADIUS * (0.020 + 0.010 * distance)
        place = _turned(k * _GOLDEN_ANGLE)
        r = _HEAD_RADIUS * 0.97 * distance
        shape = Shape(floret.vertices * size + (r, 0, 0.022 * (1 - distance**2) - 0.4 * size), floret.triangles,
                      floret.normals, floret.uvs)
        parts.append((shape.moved(place), _DISC if distance > 0.45 else _BUD))
    rng = np.random.default_rng(1)
    for k in range(55):
        length = 0.135 * rng.uniform(0.85, 1.15)
        petal = _blade(length, 0.050, droop=rng.uniform(-0.01, 0.05), fold=0.18, num_along=9, num_across=4, tip=0.7)
        lift = np.column_stack([np.eye(3), (_HEAD_RADIUS * (0.99 if k % 2 else 0.94), 0, -0.004 if k % 2 else 0.004)])
        parts.append((petal.moved(_times(_turned(2 * math.pi * k / 55 + rng.normal(0, 0.03)), lift)), _PETAL))
    for k in range(34):
        bract = _blade(0.09, 0.035, droop=0.02, fold=0.1, num_along=6, num_across=2)
        lift = np.column_stack([np.eye(3), (_HEAD_RADIUS * 0.86, 0, -0.018)])
        parts.append((bract.moved(_times(_turned(2 * math.pi * (k + 0.5) / 34), lift)), _STALK))
    return parts


def sunflower():
    """One sunflower, its foot at the origin and its head facing +x, as a mesh of 33,288 triangles."""
    s = np.linspace(0, 1, 25)
    path = np.stack([0.10 * np.maximum(s - 0.72, 0) ** 1.2 / 0.28**1.2, 0.02 * np.sin(3 * s), _HEIGHT * s], axis=1)
    parts = [(tube(path, 0.017 - 0.007 * s, 12), _STALK)]
    rng = np.random.default_rng(2)
    for k in range(12):
        height = 0.18 + 0.105 * k
        leaf = _blade(0.34 - 0.013 * k, 0.24 - 0.011 * k, droop=rng.uniform(0.08, 0.16), fold=0.25, num_along=12,
                      num_across=8, tip=0.75)
        up = rng.uniform(0.35, 0.7)
        tilt = np.array([[math.cos(up), 0, -math.sin(up), 0], [0, 1, 0, 0], [math.sin(up), 0, math.cos(up), height]])
        parts.append((leaf.moved(_times(_turned(k * _GOLDEN_ANGLE), tilt)), _LEAF))
    # From facing +z to facing +x and a little up.
    lean = math.radians(68)
    face = np.array([[math.cos(lean), 0, math.sin(lean), path[-1, 0] + 0.045], [0, 1, 0, path[-1, 1]],
                     [-math.sin(lean), 0, math.cos(lean), _HEIGHT + 0.01]])
    parts += [(shape.moved(face), material) for shape, material in _head()]
    return joined("sunflower", parts)


def _materials():
    veins = np.abs(np.sin(np.linspace(0, 14 * np.pi, 256)))[None, :] * np.ones((256, 1))
    leaf = noise(256, cells=8, octaves=4, seed=1)
    petal = noise(256, cells=4, octaves=4, seed=2, stretch=(1, 8))
    along = np.linspace(0, 1, 256)[:, None] * np.ones((1, 256))
    gold = blend(along**0.7, (0.82, 0.30, 0.004), (0.95, 0.60, 0.015)) * (0.75 + 0.25 * petal[..., None])
    return [Material("stalk", (0.20, 0.36, 0.08), specular=0.05, shininess=8),
            Material("leaf", (1.0, 1.0, 1.0), specular=0.12, shininess=16,
                     texture=texture("leaf", blend(0.7 * leaf + 0.3 * veins**8, (0.05, 0.17, 0.025),
                                                   (0.19, 0.40, 0.08)))),
            Material("petal", (1.0, 1.0, 1.0), texture=texture("petal", gold)),
            Material("disc", (0.17, 0.075, 0.02), specular=0.1, shininess=16),
            Material("bud", (0.24, 0.20, 0.04), specular=0.1, shininess=16)]


def _hill(x, y):
    """Height of the ground that is not there."""
    return 1.6 * np.sin(x / 37) * np.cos(y / 29) + 2.2 * np.exp(-((x - 45) ** 2 + (y + 10) ** 2) / 900)


def sunflowers_scene():
    """The scene ``sunflowers``: 5,622 instances in rows over gentle hills, all facing the morning sun."""
    rng = np.random.default_rng(3)
    rows = np.arange(-37, 38)
    columns = math.ceil(NUM_FLOWERS / len(rows))
    x, y = np.meshgrid(np.arange(columns) * 1.05, rows * 0.95, indexing="ij")
    x, y = (x.ravel()[:NUM_FLOWERS] + rng.uniform(-0.32, 0.32, NUM_FLOWERS),
            y.ravel()[:NUM_FLOWERS] + rng.uniform(-0.32, 0.32, NUM_FLOWERS))
    # They face −x, where the eye and the sun are.
    heading = math.pi + rng.normal(0, 0.28, NUM_FLOWERS)
    scale, lean = rng.uniform(0.82, 1.16, NUM_FLOWERS), rng.normal(0, 0.05, (NUM_FLOWERS, 2))
    instances = []
    for k in range(NUM_FLOWERS):
        tilt = np.array([[1, 0, lean[k, 0]], [0, 1, lean[k, 1]], [-lean[k, 0], -lean[k, 1], 1]])
        linear = scale[k] * tilt @ _turned(heading[k])[:, :3]
        instances.append(Instance(0, np.column_stack([linear, (x[k], y[k], _hill(x[k], y[k]))]), f"sunflower {k}"))
    sun = np.array((0.55, 0.42, -0.48))
    sky = Sky.gradient(zenith=(0.10, 0.26, 0.66), horizon=(0.60, 0.76, 0.92), ground=(0.10, 0.075, 0.04), sun=-sun)
    camera = Camera((-2.6, -1.2, _hill(-2.6, -1.2) + 2.25), (9.0, 1.0, _hill(9.0, 1.0) + 1.35), (0, 0, 1), 60.0, "edge")
    above = Camera((-16.0, -22.0, 13.0), (22.0, 3.0, 0.0), (0, 0, 1), 55.0, "above")
    lights = [Light("directional", color=(1.0, 0.92, 0.76), intensity=1.15, direction=sun, name="sun")]
    return Scene([sunflower()], instances, _materials(), [camera, above], lights=lights, sky=sky,
                 ambient=(0.34, 0.38, 0.44))
