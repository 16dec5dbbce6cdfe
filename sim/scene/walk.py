"""A built-in scene: eight seconds of a walk through halls with drones, a gate and shots, as a shooter shows them."""

import math
from itertools import pairwise

import numpy as np

from .animation import Animation, CameraNode, Channel, LightNode, Node, pose_nodes
from .arena import HEIGHT, LAMPS, bolt, drone, gate, halls, materials, weapon
from .light import Light
from .scene import Instance, Scene

__all__ = ["DURATION", "walk_scene"]

#: Seconds from the first key frame to the last.
DURATION = 8.0
_KEYS = 97
_PATH = ((17.5, 3.0), (13.0, 3.1), (8.5, 2.9), (5.4, 3.3), (5.0, 6.0), (5.2, 9.0), (6.2, 12.0), (9.0, 13.1),
         (14.0, 12.9), (18.0, 13.2), (20.5, 12.6))
# Where drones float: the middle and the two radii of each one's round, its height, seconds a round, and its start.
_ROUNDS = ((8.0, 3.0, 1.6, 0.3, 2.45, 5.0, 0.6), (6.5, 14.0, 1.8, 1.6, 1.9, 4.0, 2.2),
           (22.0, 13.6, 1.4, 1.4, 1.5, 5.0, 3.1), (23.0, 11.0, 0.9, 0.7, 2.2, 3.0, 0.0))
# Shots: when they leave, how long they fly, from where, to where.
_SHOTS = ((0.0, 2.4, (7.0, 3.0, 1.55), (25.0, 3.4, 1.4)), (5.2, 1.6, (10.0, 13.4, 1.45), (25.9, 12.0, 1.5)),
          (3.4, 1.8, (6.0, 15.5, 1.8), (4.2, 8.1, 0.9)))


def _spline(points, s):
    """Catmull and Rom's curve through points float64[N, 2 or 3], at s in 0…1."""
    points = np.asarray(points, np.float64)
    points = np.concatenate([[2 * points[0] - points[1]], points, [2 * points[-1] - points[-2]]])
    s = np.asarray(s) * (len(points) - 3)
    k = np.minimum(s.astype(int), len(points) - 4)
    f = (s - k)[:, None]
    a, b, c, d = (points[k + i] for i in range(4))
    return 0.5 * (2 * b + (c - a) * f + (2 * a - 5 * b + 4 * c - d) * f**2 + (3 * b - a - 3 * c + d) * f**3)


def _quaternion(matrix):
    """Unit quaternion (x, y, z, w) of a rotation matrix: the eigenvector of Bar-Itzhack's symmetric 4×4."""
    m = matrix
    symmetric = np.array([
        [m[0, 0] - m[1, 1] - m[2, 2], 0, 0, 0], [m[0, 1] + m[1, 0], m[1, 1] - m[0, 0] - m[2, 2], 0, 0],
        [m[0, 2] + m[2, 0], m[1, 2] + m[2, 1], m[2, 2] - m[0, 0] - m[1, 1], 0],
        [m[2, 1] - m[1, 2], m[0, 2] - m[2, 0], m[1, 0] - m[0, 1], m[0, 0] + m[1, 1] + m[2, 2]]])
    return np.linalg.eigh(symmetric, UPLO="L")[1][:, -1]


def _facing(directions):
    """Quaternions of cameras (looking along −z, +y up) that look in directions float64[N, 3], world z up."""
    result = []
    for direction in directions:
        forward = direction / np.linalg.norm(direction)
        right = np.cross(forward, (0, 0, 1.0))
        right /= np.linalg.norm(right)
        result.append(_quaternion(np.stack([right, np.cross(right, forward), -forward], axis=1)))
    for before, after in pairwise(result):
        after *= 1 if before @ after > 0 else -1
    return np.array(result)


def _about_z(angles):
    return np.stack([0 * angles, 0 * angles, np.sin(angles / 2), np.cos(angles / 2)], axis=1)


def _node(translation=(0.0, 0.0, 0.0), parent=-1, rotation=(0.0, 0.0, 0.0, 1.0), scale=1.0):
    return Node(parent, np.array(translation, np.float64), np.array(rotation, np.float64), np.full(3, float(scale)))


class _Stage:
    """Nodes, what they carry and how they move, as they are put up."""

    def __init__(self):
        self.nodes, self.channels, self.instances, self.cameras, self.lights = [], [], [], [], []

    def node(self, *args, **kwargs):
        self.nodes.append(_node(*args, **kwargs))
        return len(self.nodes) - 1

    def carry(self, mesh, node, name):
        self.instances.append((mesh, node, name))

    def move(self, node, path, times, values):
        self.channels.append(Channel(node, path, "LINEAR", np.asarray(times, np.float64),
                                     np.asarray(values, np.float64)))


def _walker(stage, mesh):
    """The camera with weapon and torch."""
    times = np.linspace(0, DURATION, _KEYS)
    # Slower at both ends.
    s = times / DURATION
    s = s + 0.06 * np.sin(2 * np.pi * s - np.pi) * 0.5
    places = _spline(_PATH, np.clip(s, 0, 1))
    ahead = _spline(_PATH, np.clip(s + 0.09, 0, 1)) - places
    ahead[s > 0.91] = (_spline(_PATH, [1.0]) - _spline(_PATH, [0.91]))[0]
    step = np.cumsum(np.linalg.norm(np.diff(places, axis=0, prepend=places[:1]), axis=1))
    height = 1.62 + 0.035 * np.sin(2 * np.pi * step / 0.75)
    looks = np.column_stack([ahead / np.linalg.norm(ahead, axis=1, keepdims=True), np.full(_KEYS, -0.06)])
    eye = stage.node((*places[0], height[0]), rotation=_facing(looks[:1])[0])
    stage.move(eye, "translation", times, np.column_stack([places, height]))
    stage.move(eye, "rotation", times, _facing(looks))
    stage.cameras.append(CameraNode(eye, 78.0, "walker"))
    stage.carry(mesh, stage.node((0.17, -0.16, -0.36), parent=eye, rotation=_quaternion(np.array(
        [[math.cos(0.06), 0, math.sin(0.06)], [0, 1, 0], [-math.sin(0.06), 0, math.cos(0.06)]]))), "weapon")
    torch = Light.spot((0.1, -0.1, 0), (0, 0, -1), inner_angle=0.12, outer_angle=0.42, color=(0.85, 0.93, 1.0),
                       intensity=9.0, radius=1.0, reach=16.0, name="torch")
    stage.lights.append(LightNode(eye, torch))


def _drones(stage, mesh):
    for number, (x, y, rx, ry, z, seconds, start) in enumerate(_ROUNDS):
        times = np.linspace(0, DURATION, _KEYS)
        angle = start + 2 * np.pi * times / seconds
        node = stage.node()
        stage.move(node, "translation", times, np.column_stack([
            x + rx * np.cos(angle), y + ry * np.sin(angle), z + 0.12 * np.sin(2.3 * angle + number)]))
        # The first one watches the walker, the others look around.
        stage.move(node, "rotation", times, _about_z(0.4 * np.sin(angle) if not number else angle + np.pi / 2))
        stage.carry(mesh, node, f"drone {number}")
        glow = Light("point", color=(1.0, 0.12, 0.05), intensity=0.35, radius=0.3, reach=5.0, position=(0.55, 0, 0.05),
                     name=f"drone {number}")
        stage.lights.append(LightNode(node, glow))


def _shots(stage, mesh):
    for number, (begin, flight, start, end) in enumerate(_SHOTS):
        start, end = np.array(start), np.array(end)
        heading = math.atan2(*(end - start)[[1, 0]])
        node = stage.node(start, rotation=_about_z(np.array([heading]))[0])
        # Before and after its flight it is below the floor.
        hidden = np.array((0, 0, -4.0))
        times, places = [begin, begin + flight], [start, end]
        if begin > 0:
            times, places = [0.0, begin - 0.01, *times], [start + hidden, start + hidden, *places]
        times, places = [*times, begin + flight + 0.01], [*places, end + hidden]
        stage.move(node, "translation", times, places)
        stage.carry(mesh, node, f"shot {number}")
        glow = Light("point", color=(0.3, 1.0, 0.5), intensity=0.9, radius=0.3, reach=6.0, position=(-0.25, 0, 0),
                     name=f"shot {number}")
        stage.lights.append(LightNode(node, glow))


def walk_scene():
    """The scene ``walk``: 8 s with a moving camera, four drones, a gate and three shots, and 15 lights."""
    looks, numbers = materials()
    meshes = [halls(numbers), weapon(numbers), drone(numbers), gate(numbers), bolt(numbers)]
    stage = _Stage()
    stage.carry(0, stage.node(), "halls")
    _walker(stage, 1)
    _drones(stage, 2)
    slide = stage.node((5.0, 7.0, 0.0))
    stage.move(slide, "translation", [0.0, 2.0, 3.0], [(5.0, 7.0, 0), (5.0, 7.0, 0), (6.93, 7.0, 0)])
    stage.carry(3, slide, "gate")
    _shots(stage, 4)
    for number, (x, y) in enumerate(LAMPS):
        lamp = Light("point", color=(1.0, 0.86, 0.66), intensity=5.5 if y > 8 else 2.8, radius=0.5, reach=12.0,
                     name=f"lamp {number}")
        stage.lights.append(LightNode(stage.node((x, y, HEIGHT - 0.25)), lamp))
    gallery = stage.node((16.3, 12.7, 2.3), rotation=_facing(np.array([(6.0, 0.5, -0.9)]))[0])
    stage.cameras.append(CameraNode(gallery, 75.0, "gallery"))

    order = list(range(len(stage.nodes)))
    animation = Animation(stage.nodes, order, stage.channels, [node for _, node, _ in stage.instances], stage.cameras,
                          stage.lights)
    world = pose_nodes(stage.nodes, order, stage.channels, 0.0)
    instances = [Instance(mesh, world[node][:3], name) for mesh, node, name in stage.instances]
    return Scene(meshes, instances, looks, [camera.camera(world) for camera in stage.cameras], animation,
                 lights=[light.light(world) for light in stage.lights], ambient=(0.08, 0.085, 0.10))
