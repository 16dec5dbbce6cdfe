"""A picture as an engine makes it: what each pixel's ray has hit, and its colour."""

from dataclasses import dataclass, field

import numpy as np

__all__ = ["Frame"]


@dataclass(eq=False)
class Frame:
    """Hits and colours of a picture; all arrays are H×W.

    Parameters
    ----------
    instance_id, prim_id : int32
        What was hit, −1 for nothing.
    t, u, v : float64
        Where: in units of the ray's direction, and as weights of the triangle's second and third corner. Of a miss,
        ∞, 0 and 0.
    color : uint8[H, W, 3]
        Red, green, blue.
    report : dict
        What the engine says of its work.
    """

    instance_id: np.ndarray
    prim_id: np.ndarray
    t: np.ndarray
    u: np.ndarray
    v: np.ndarray
    color: np.ndarray
    report: dict = field(default_factory=dict)

    @classmethod
    def empty(cls, width, height, background=(0, 0, 0)):
        """A frame in which nothing is hit."""
        shape = height, width
        color = np.empty((*shape, 3), np.uint8)
        color[:] = background
        return cls(np.full(shape, -1, np.int32), np.full(shape, -1, np.int32), np.full(shape, np.inf),
                   np.zeros(shape), np.zeros(shape), color)

    @property
    def size(self):
        """Width and height in pixels."""
        return self.t.shape[1], self.t.shape[0]

    def differs(self, other):
        """bool[H, W]: where anything at all differs."""
        return ((self.instance_id != other.instance_id) | (self.prim_id != other.prim_id) | (self.t != other.t)
                | (self.u != other.u) | (self.v != other.v) | (self.color != other.color).any(axis=-1))

    def differs_in_surface(self, other):
        """bool[H, W]: where another triangle is hit."""
        return (self.instance_id != other.instance_id) | (self.prim_id != other.prim_id)
