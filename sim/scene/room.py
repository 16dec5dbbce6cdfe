"""The built-in scene: a room with a table, four chairs and a few things, 806 triangles like the paper's
Scene6.

Metres, z up, the floor at z = 0. Furniture keeps a millimetre from the floor and parts that join overlap, so
that no two surfaces coincide and every visible point belongs to one triangle.
"""

import math

import numpy as np

from .camera import Camera
from .scene import IDENTITY, Instance, Material, Mesh, Scene

__all__ = ["room_scene"]

_MATERIALS = (
    Material("plaster", (0.82, 0.78, 0.70)),
    Material("ceiling", (0.90, 0.90, 0.88)),
    Material("parquet", (0.48, 0.30, 0.16)),
    Material("sky", (0.55, 0.75, 0.95)),
    Material("white paint", (0.88, 0.88, 0.86)),
    Material("oak", (0.60, 0.40, 0.20)),
    Material("blue lacquer", (0.12, 0.25, 0.50)),
    Material("rug", (0.55, 0.12, 0.10)),
    Material("brass", (0.80, 0.60, 0.22)),
    Material("glaze", (0.10, 0.45, 0.42)),
    Material("canvas", (0.85, 0.50, 0.20)),
    Material("orange", (0.95, 0.45, 0.05)),
)
_MATERIAL_IDS = {material.name: number for number, material in enumerate(_MATERIALS)}

_WIDTH, _LENGTH, _HEIGHT = 5.0, 6.0, 2.7
_GAP = 0.001


class _Parts:
    """Collects indexed parts into one mesh."""

    def __init__(self):
        self.vertices, self.triangles, self.material_ids = [], [], []
        self.num_vertices = 0

    def add(self, vertices, triangles, material):
        self.vertices.append(np.asarray(vertices, dtype=np.float64))
        self.triangles.append(np.asarray(triangles, dtype=np.int32) + self.num_vertices)
        self.material_ids += [_MATERIAL_IDS[material]] * len(triangles)
        self.num_vertices += len(vertices)

    def quads(self, vertices, quads, material):
        """Each quad a, b, c, d becomes the triangles a, b, c and a, c, d."""
        self.add(vertices, [corners for a, b, c, d in quads for corners in ((a, b, c), (a, c, d))], material)

    def box(self, lower, upper, material, *, place=lambda points: points):
        """Axis-aligned closed box, then moved by ``place``."""
        bits = np.indices((2, 2, 2)).reshape(3, 8).T
        vertices = place(np.where(bits == 1, upper, lower).astype(np.float64))
        self.quads(vertices, [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)],
                   material)

    def revolve(self, center, profile, num_segments, material):
        """Closed surface of revolution about the vertical through ``center``; the profile's ends are the
        poles.

        ``profile`` lists (radius, height) upwards; it gives 2 · num_segments triangles per inner entry.
        """
        angle = 2 * np.pi * np.arange(num_segments) / num_segments
        inner = profile[1:-1]
        rings = [np.stack([r * np.cos(angle), r * np.sin(angle), np.full(num_segments, z)], axis=1)
                 for r, z in inner]
        poles = [(0.0, 0.0, profile[0][1]), (0.0, 0.0, profile[-1][1])]
        bottom, top = len(inner) * num_segments, len(inner) * num_segments + 1
        triangles = []
        for i in range(num_segments):
            j = (i + 1) % num_segments
            triangles.append((bottom, j, i))
            for base in range(0, bottom - num_segments, num_segments):
                above = base + num_segments
                triangles += [(base + i, base + j, above + j), (base + i, above + j, above + i)]
            triangles.append((top, bottom - num_segments + i, bottom - num_segments + j))
        self.add(np.concatenate([*rings, poles]) + center, triangles, material)


def _shell(parts):
    """Floor, ceiling and walls; the wall at y = LENGTH has a window in a reveal, closed by the sky."""
    w, d, h = _WIDTH, _LENGTH, _HEIGHT
    corners = [(0, 0, 0), (w, 0, 0), (w, d, 0), (0, d, 0), (0, 0, h), (w, 0, h), (w, d, h), (0, d, h)]
    parts.quads(corners, [(0, 1, 2, 3)], "parquet")
    parts.quads(corners, [(4, 7, 6, 5)], "ceiling")
    parts.quads(corners, [(0, 3, 7, 4), (1, 5, 6, 2), (0, 4, 5, 1)], "plaster")
    hole = [(1.5, d, 0.9), (3.5, d, 0.9), (3.5, d, 2.2), (1.5, d, 2.2)]
    ring = [corners[3], corners[2], corners[6], corners[7], *hole]
    parts.quads(ring, [(0, 1, 5, 4), (1, 2, 6, 5), (2, 3, 7, 6), (3, 0, 4, 7)], "plaster")
    outside = [(x, y + 0.2, z) for x, y, z in hole]
    reveal = [*hole, *outside]
    parts.quads(reveal, [(0, 1, 5, 4), (1, 2, 6, 5), (2, 3, 7, 6), (3, 0, 4, 7)], "white paint")
    parts.quads(reveal, [(4, 5, 6, 7)], "sky")
    parts.box((2.47, d + 0.08, 0.89), (2.53, d + 0.12, 2.21), "white paint")
    parts.box((1.49, d + 0.07, 1.52), (3.51, d + 0.13, 1.58), "white paint")


def _table(parts, center, *, length, width, height):
    x, y = center
    parts.box((x - width / 2, y - length / 2, height - 0.04), (x + width / 2, y + length / 2, height), "oak")
    for side_x in (-1, 1):
        for side_y in (-1, 1):
            leg = np.array([x + side_x * (width / 2 - 0.08), y + side_y * (length / 2 - 0.08)])
            parts.box((*(leg - 0.035), _GAP), (*(leg + 0.035), height - 0.02), "oak")


def _chair(parts, center, heading_deg):
    """Chair that faces +y at heading 0, turned counter-clockwise."""
    angle = math.radians(heading_deg)
    turn = np.array([[math.cos(angle), -math.sin(angle), 0], [math.sin(angle), math.cos(angle), 0], [0, 0, 1]])

    def place(points):
        return points @ turn.T + (*center, 0.0)

    parts.box((-0.22, -0.22, 0.43), (0.22, 0.22, 0.47), "blue lacquer", place=place)
    for x in (-0.19, 0.19):
        parts.box((x - 0.02, 0.17, _GAP), (x + 0.02, 0.21, 0.45), "blue lacquer", place=place)
        parts.box((x - 0.02, -0.21, _GAP), (x + 0.02, -0.17, 0.92), "blue lacquer", place=place)
    for z in (0.62, 0.8):
        parts.box((-0.18, -0.205, z), (0.18, -0.175, z + 0.1), "blue lacquer", place=place)


def _things(parts):
    parts.box((1.3, 1.8, _GAP), (3.7, 4.2, 0.012), "rug")
    parts.revolve((2.5, 3.0, 1.75), [(0.0, 0.16), (0.26, 0.0), (0.27, 0.01), (0.22, 0.13), (0.12, 0.23), (0.03, 0.27),
                                     (0.0, 0.28)], 12, "brass")
    parts.box((2.495, 2.995, 2.0), (2.505, 3.005, _HEIGHT - _GAP), "white paint")
    parts.revolve((2.38, 3.2, 0.74 + _GAP), [(0.0, 0.0), (0.06, 0.0), (0.11, 0.08), (0.10, 0.17), (0.04, 0.25),
                                             (0.06, 0.30), (0.045, 0.29), (0.0, 0.20)], 10, "glaze")
    parts.box((0.05, 1.9, 0.1), (0.5, 4.1, 0.85), "oak")
    parts.box((0.49, 1.95, 0.15), (0.515, 2.98, 0.8), "white paint")
    parts.box((0.49, 3.02, 0.15), (0.515, 4.05, 0.8), "white paint")
    parts.box((0.0 + _GAP, 2.4, 1.25), (0.03, 3.6, 2.05), "white paint")
    parts.quads([(0.031, 2.46, 1.31), (0.031, 3.54, 1.31), (0.031, 3.54, 1.99), (0.031, 2.46, 1.99)],
                [(0, 1, 2, 3)], "canvas")
    parts.box((0.15, 2.2, 0.851), (0.4, 2.5, 0.89), "rug")
    parts.box((0.16, 2.22, 0.891), (0.36, 2.47, 0.925), "glaze")
    _icosahedron(parts, (2.68, 2.75, 0.74 + 0.05), 0.05, "orange")


def _icosahedron(parts, center, radius, material):
    """Regular icosahedron with a vertex at either pole."""
    ring_z, ring_r = 1 / math.sqrt(5), 2 / math.sqrt(5)
    angle = 2 * np.pi * np.arange(5) / 5
    upper = np.stack([ring_r * np.cos(angle), ring_r * np.sin(angle), np.full(5, ring_z)], axis=1)
    vertices = np.concatenate([[(0, 0, 1)], upper, -upper, [(0, 0, -1)]])
    triangles = []
    for i in range(5):
        j = (i + 1) % 5
        # The lower ring is the upper one mirrored through the centre: below edge i, j lies vertex i + 3.
        below_i, below_j = 6 + (i + 2) % 5, 6 + (i + 3) % 5
        triangles += [(0, 1 + i, 1 + j), (1 + i, below_j, 1 + j), (1 + i, below_i, below_j), (11, below_j, below_i)]
    parts.add(np.asarray(center) + radius * vertices, triangles, material)


def room_scene():
    """The built-in room: 806 triangles in one mesh with one instance, 12 materials, one camera inside."""
    parts = _Parts()
    _shell(parts)
    _table(parts, (2.5, 3.0), length=1.6, width=0.9, height=0.74)
    for center, heading_deg in (((1.85, 2.7), -90), ((3.2, 3.4), 97), ((2.45, 1.95), 8), ((2.6, 4.15), 185)):
        _chair(parts, center, heading_deg)
    _things(parts)
    mesh = Mesh("room", np.concatenate(parts.vertices), np.concatenate(parts.triangles),
                np.array(parts.material_ids, dtype=np.int32))
    camera = Camera((4.7, 0.35, 1.75), (1.9, 3.4, 0.85), (0.0, 0.0, 1.0), 65.0, "corner")
    return Scene([mesh], [Instance(0, IDENTITY, "room")], list(_MATERIALS), [camera])
