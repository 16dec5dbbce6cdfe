"""What the scene ``walk`` is built of: halls of brick, pillars, crates, drones, a gate, a weapon."""

import math

import numpy as np

from .material import Material
from .patterns import blend, bricks, cells, noise, planks, texture
from .shapes import ball, box, joined, lathe, sheet, tube

__all__ = ["CELL", "HEIGHT", "LAMPS", "MAP", "bolt", "drone", "gate", "halls", "materials", "weapon"]

#: The halls from above, north at the top, '#' solid; a cell is 2 m.
MAP = ("##############",
       "#.....##.....#",
       "#.....##.....#",
       "#............#",
       "#.....##.....#",
       "#.....##.....#",
       "##.########.##",
       "##.########.##",
       "##..........##",
       "##############")
CELL, HEIGHT = 2.0, 3.2
#: Where lamps hang, x and y.
LAMPS = ((6.0, 13.0), (22.0, 13.0), (14.0, 13.0), (5.0, 5.0), (9.0, 3.0), (17.0, 3.0), (23.0, 5.0))
_PILLARS = ((4.0, 10.5), (9.5, 10.5), (4.0, 15.5), (9.5, 15.5), (18.5, 10.5), (24.0, 10.5), (18.5, 15.5), (24.0, 15.5))
_CRATES = ((10.9, 9.0, 0.0, 1.2, 8), (9.6, 8.8, 0.0, 1.0, -14), (10.7, 9.1, 1.2, 0.8, 25), (17.0, 8.9, 0.0, 1.2, 3),
           (25.0, 16.9, 0.0, 1.3, 12), (23.6, 17.1, 0.0, 1.0, -7), (13.0, 3.6, 0.0, 0.8, 20))

_NAMES = ("brick", "floor", "ceiling", "stone", "wood", "lamp", "steel", "hull", "eye", "gate", "plasma", "trim",
          "mirror", "grip")


def materials():
    """Materials of the arena, and their numbers by name."""
    concrete = noise(256, cells=8, octaves=5, seed=8)
    row, column, distance = cells(256, 4, 4)
    tile = np.random.default_rng(9).random((4, 4))[row, column]
    slabs = blend(0.5 * tile + 0.5 * concrete, (0.10, 0.11, 0.12), (0.26, 0.27, 0.29))
    slabs *= np.clip(distance / 0.04, 0.25, 1)[..., None]
    stripes = ((np.add.outer(np.arange(256), np.arange(256)) // 32) % 2 == 0) & (np.arange(256)[:, None] > 176)
    painted = np.where(stripes[..., None], (0.75, 0.48, 0.03), blend(concrete, (0.13, 0.15, 0.17), (0.22, 0.24, 0.27)))
    white = (1.0, 1.0, 1.0)
    looks = (
        Material("brick", white, bricks("brick", (0.20, 0.075, 0.045), (0.46, 0.20, 0.12), (0.30, 0.28, 0.25))),
        Material("floor", white, texture("floor", slabs), specular=0.3, shininess=64, reflection=0.07, fresnel=True),
        Material("ceiling", white, texture("ceiling", blend(concrete, (0.22, 0.22, 0.21), (0.36, 0.35, 0.33)))),
        Material("stone", white, texture("stone", blend(concrete, (0.34, 0.31, 0.26), (0.58, 0.55, 0.48))),
                 specular=0.1, shininess=16),
        Material("wood", white, planks("wood", (0.18, 0.10, 0.045), (0.44, 0.28, 0.13), rows=4, columns=1)),
        Material("lamp", white, emission=(1.0, 0.93, 0.80)),
        Material("steel", (0.62, 0.64, 0.68), specular=0.8, shininess=128, reflection=0.65, tinted=True),
        Material("hull", (0.09, 0.10, 0.13), specular=0.6, shininess=64, reflection=0.08, fresnel=True),
        Material("eye", (0.2, 0.0, 0.0), emission=(1.0, 0.10, 0.04)),
        Material("gate", white, texture("gate", painted), specular=0.4, shininess=32),
        Material("plasma", (0.0, 0.0, 0.0), emission=(0.35, 1.0, 0.55)),
        Material("trim", (0.15, 0.22, 0.30), specular=0.4, shininess=32),
        Material("mirror", (0.86, 0.90, 0.92), reflection=1.0, tinted=True),
        Material("grip", (0.035, 0.035, 0.04), specular=0.3, shininess=32))
    return list(looks), {name: number for number, name in enumerate(_NAMES)}


def _is_open(row, column):
    return 0 <= row < len(MAP) and 0 <= column < len(MAP[0]) and MAP[row][column] == "."


def halls(numbers):
    """The standing part: walls, floors, ceilings, pillars, crates, lamps and a mirror."""
    parts = []
    for row in range(len(MAP)):
        for column in range(len(MAP[0])):
            if not _is_open(row, column):
                continue
            x, y = column * CELL, (len(MAP) - 1 - row) * CELL
            parts.append((sheet((x, y, 0), (CELL, 0, 0), (0, CELL, 0)), numbers["floor"]))
            parts.append((sheet((x, y + CELL, HEIGHT), (CELL, 0, 0), (0, -CELL, 0)), numbers["ceiling"]))
            # Walls run so that the cell lies to their right.
            for step_row, step_column, corner, run in (
                    (-1, 0, (x, y + CELL), (CELL, 0)), (1, 0, (x + CELL, y), (-CELL, 0)),
                    (0, -1, (x, y), (0, CELL)), (0, 1, (x + CELL, y + CELL), (0, -CELL))):
                if not _is_open(row + step_row, column + step_column):
                    start, along = np.array((*corner, 0.0)), (*run, 0.0)
                    inwards = np.array((run[1], -run[0], 0.0)) / CELL
                    parts += [(sheet(start, along, (0, 0, HEIGHT), repeats=(1, HEIGHT / CELL)), numbers["brick"]),
                              (sheet(start + 0.02 * inwards, along, (0, 0, 0.25)), numbers["trim"])]
    for x, y in _PILLARS:
        place = np.column_stack([np.eye(3), (x, y, 0)])
        profile = [(0.42, 0.0), (0.42, 0.25), (0.34, 0.3), (0.29, 0.45), (0.27, 2.7), (0.33, 2.85), (0.42, 2.9),
                   (0.42, HEIGHT)]
        parts.append((lathe(profile, 20).moved(place), numbers["stone"]))
    for x, y, z, size, degrees in _CRATES:
        c, s = math.cos(math.radians(degrees)), math.sin(math.radians(degrees))
        crate = box((-size / 2, -size / 2, 0.001), (size / 2, size / 2, size), size=size)
        parts.append((crate.moved([[c, -s, 0, x], [s, c, 0, y], [0, 0, 1, z]]), numbers["wood"]))
    for x, y in LAMPS:
        parts.append((box((x - 0.5, y - 0.12, HEIGHT - 0.08), (x + 0.5, y + 0.12, HEIGHT - 0.001)), numbers["lamp"]))
    parts.append((sheet((25.96, 15.5, 0.4), (0, -5, 0), (0, 0, 2.4)), numbers["mirror"]))
    parts.append((box((25.97, 10.4, 0.3), (25.999, 15.6, 2.9)), numbers["steel"]))
    return joined("halls", parts)


def drone(numbers):
    """A machine that hovers, its eye towards +x."""
    ring = lathe([(0.52, -0.05), (0.60, 0.0), (0.52, 0.05), (0.47, 0.0), (0.52, -0.05)], 32)
    shapes = [(ball((0, 0, 0), 0.36, num_rings=20), numbers["hull"]), (ring, numbers["steel"]),
              (ball((0.30, 0, 0.05), 0.11, num_rings=12), numbers["eye"])]
    for side in (-1, 1):
        shapes.append((tube([(0.0, side * 0.40, 0), (0.1, side * 0.62, -0.05), (0.45, side * 0.66, -0.10)],
                            (0.05, 0.06, 0.035), 10), numbers["steel"]))
    return joined("drone", shapes)


def gate(numbers):
    """A sliding gate that fills a cell's width, its middle at the origin."""
    return joined("gate", [(box((-0.995, -0.07, 0.001), (0.995, 0.07, HEIGHT - 0.001), size=2.0), numbers["gate"])])


def bolt(numbers):
    """A shot of plasma."""
    shape = ball((0, 0, 0), 1.0, num_rings=10)
    return joined("bolt", [(shape.moved([[0.10, 0, 0, 0], [0, 0.05, 0, 0], [0, 0, 0.05, 0]]), numbers["plasma"])])


def weapon(numbers):
    """A weapon as seen by who holds it: in the camera's space, pointing along −z."""
    barrel = tube([(0, 0, 0), (0, 0, -0.1), (0, 0, -0.34), (0, 0, -0.36)], (0.020, 0.026, 0.020, 0.026), 16)
    return joined("weapon", [
        (barrel, numbers["steel"]), (box((-0.028, -0.045, -0.02), (0.028, 0.03, 0.24)), numbers["hull"]),
        (box((-0.018, -0.13, 0.10), (0.018, -0.04, 0.16)), numbers["grip"]),
        (box((-0.006, 0.03, -0.01), (0.006, 0.05, 0.06)), numbers["trim"]),
        (box((-0.03, -0.012, 0.02), (0.03, 0.004, 0.16)), numbers["plasma"])])
