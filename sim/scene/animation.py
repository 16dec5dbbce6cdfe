"""Motion of a node hierarchy by key frames, as glTF 2.0 defines it (section 3.11, appendix C)."""

import math
from dataclasses import dataclass, field

import numpy as np

from .camera import Camera
from .light import Light

__all__ = ["Animation", "CameraNode", "Channel", "LightNode", "Node", "compose", "pose_nodes"]


@dataclass(frozen=True, eq=False)
class Node:
    """A node: its parent's index or −1, and its transform as 4×4 matrix or (where that is None) as its three parts."""

    parent: int
    translation: np.ndarray
    rotation: np.ndarray
    scale: np.ndarray
    matrix: np.ndarray | None = None


@dataclass(frozen=True, eq=False)
class Channel:
    """Key frames of one part of one node's transform.

    Parameters
    ----------
    node : int
    path : str
        ``translation``, ``rotation`` (unit quaternion x, y, z, w) or ``scale``.
    interpolation : str
        ``LINEAR`` (rotations: along the great circle), ``STEP`` or ``CUBICSPLINE``.
    times : float64[K]
        Strictly increasing, in seconds.
    values : float64[K, 3 or 4], or float64[K, 3, 3 or 4]
        Value at each time; for CUBICSPLINE in-tangent, value, out-tangent.
    """

    node: int
    path: str
    interpolation: str
    times: np.ndarray
    values: np.ndarray

    def value(self, t):
        """Value at time ``t``; before the first and after the last key frame, that frame's."""
        is_spline = self.interpolation == "CUBICSPLINE"
        points = self.values[:, 1] if is_spline else self.values
        last = len(self.times) - 1
        k = int(np.searchsorted(self.times, t, side="right")) - 1
        if k < 0 or k >= last:
            value = points[max(k, 0)]
        elif self.interpolation == "STEP":
            value = points[k]
        else:
            step = self.times[k + 1] - self.times[k]
            s = (t - self.times[k]) / step
            if is_spline:
                value = ((2 * s**3 - 3 * s**2 + 1) * points[k] + step * (s**3 - 2 * s**2 + s) * self.values[k, 2]
                         + (3 * s**2 - 2 * s**3) * points[k + 1] + step * (s**3 - s**2) * self.values[k + 1, 0])
            elif self.path == "rotation":
                return _slerp(points[k], points[k + 1], s)
            else:
                value = (1 - s) * points[k] + s * points[k + 1]
        if self.path == "rotation":
            length = np.linalg.norm(value)
            return value / length if length else value
        return value


def _slerp(a, b, s):
    """Spherical interpolation of unit quaternions, the shorter way round."""
    a, b = a / np.linalg.norm(a), b / np.linalg.norm(b)
    cosine = float(a @ b)
    if cosine < 0:
        b, cosine = -b, -cosine
    angle = math.acos(min(cosine, 1.0))
    # sin(angle) loses all its bits near 0, where the chord is the arc to float64.
    weights = (1 - s, s) if angle < 1e-6 else (math.sin((1 - s) * angle), math.sin(s * angle))
    value = weights[0] * a + weights[1] * b
    return value / np.linalg.norm(value)


def compose(translation, rotation, scale):
    """4×4 matrix T·R·S from a translation, a unit quaternion (x, y, z, w) and a scale."""
    x, y, z, w = rotation
    matrix = np.eye(4)
    matrix[:3, :3] = np.array([
        [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
        [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
        [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)]]) * scale
    matrix[:3, 3] = translation
    return matrix


def pose_nodes(nodes, order, channels=(), t=0.0):
    """World transforms float64[N, 4, 4] of all nodes at time ``t``; ``order`` lists parents before children."""
    parts = [dict(translation=node.translation, rotation=node.rotation, scale=node.scale) for node in nodes]
    for channel in channels:
        parts[channel.node][channel.path] = channel.value(t)
    world = np.empty((len(nodes), 4, 4))
    for i in order:
        local = compose(**parts[i]) if nodes[i].matrix is None else nodes[i].matrix
        world[i] = local if nodes[i].parent < 0 else world[nodes[i].parent] @ local
    return world


@dataclass(frozen=True, eq=False)
class CameraNode:
    """A camera carried by a node: in the node's space it looks along −z with +y up."""

    node: int
    hfov_deg: float
    name: str

    def camera(self, world):
        """The camera where the nodes' world transforms float64[N, 4, 4] put it."""
        matrix = world[self.node]
        eye = matrix[:3, 3]
        # Unit steps whatever the node's scale, so that a tiny scale does not drown in the eye's rounding.
        forward, up = -matrix[:3, 2], matrix[:3, 1]
        length = np.linalg.norm(forward)
        return Camera(eye, eye + (forward / length if length else forward), up, self.hfov_deg, self.name)


@dataclass(frozen=True, eq=False)
class LightNode:
    """A light carried by a node, given in the node's space."""

    node: int
    prototype: Light

    def light(self, world):
        """The light where the nodes' world transforms float64[N, 4, 4] put it; scale does not change its strength."""
        return self.prototype.placed(world[self.node])


@dataclass(frozen=True, eq=False)
class Animation:
    """Motion of a scene.

    Parameters
    ----------
    nodes : list of Node
    order : list of int
        Node numbers, parents before children.
    channels : list of Channel
    instance_nodes : list of int
        The node of each instance of the scene.
    camera_nodes : list of CameraNode
    light_nodes : list of LightNode
        All lights of the scene; empty if none of them moves.
    """

    nodes: list[Node]
    order: list[int]
    channels: list[Channel]
    instance_nodes: list[int]
    camera_nodes: list[CameraNode]
    light_nodes: list[LightNode] = field(default_factory=list)

    @property
    def duration(self):
        """Time of the last key frame, in seconds."""
        return max(float(channel.times[-1]) for channel in self.channels)

    def pose(self, t):
        """``(transforms float64[I, 3, 4], cameras, lights)`` of the scene at time ``t``."""
        world = pose_nodes(self.nodes, self.order, self.channels, t)
        return (world[self.instance_nodes][:, :3], [camera.camera(world) for camera in self.camera_nodes],
                [light.light(world) for light in self.light_nodes])
