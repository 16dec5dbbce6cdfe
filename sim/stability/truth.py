"""What a ray tracer may answer, from float64, and what is wrong about its answers.

**A method fails on a ray if no ray within** :data:`BLUR` **units in the last place of its direction would have got its
answer.** The rays that stand for them are the ray itself and eight round it, at that angle; all are traced in float64
through the vertices as the method had them, in the format. So

- *crack*: all of the nine hit, and the method does not, or it hits another triangle than any of them, farther away;
- *phantom*: none of the nine hits, and the method does, or it hits another triangle than any of them, nearer;
- *distance*: it hits a triangle that one of them hits, but t is not between the nearest and the farthest of theirs;
- *odd*: something that is not a number comes out.

Nearer and farther is what t is by more than ``BLUR`` units in the last place.

Nine do not see all that is near: past the tip of a spike that reaches in between them they go by. Where it matters, a
tenth stands for it, turned to the triangle that was answered if that is within the angle.

A miss counts as farthest of all: where some of the nine hit and some do not, at an outline, a miss is right, and so is
what lies behind the nearest.
"""

from dataclasses import dataclass

import numpy as np

from ..golden.tracer import trace
from ..scene.error import SceneError
from ..scene.material import DEFAULT_MATERIAL
from ..scene.scene import IDENTITY, Instance, Mesh, Scene

__all__ = ["BLUR", "Truth", "Verdict", "judge", "scene_of", "truth_of"]

#: Units in the last place of a direction, and of t.
BLUR = 16
_NUM_ROUND = 8


def scene_of(corners):
    """A scene of one mesh of triangles float64[T, 3, 3]."""
    mesh = Mesh("mesh", corners.reshape(-1, 3), np.arange(3 * len(corners), dtype=np.int32).reshape(-1, 3),
                np.zeros(len(corners), np.int32))
    return Scene([mesh], [Instance(0, IDENTITY, "mesh")], [DEFAULT_MATERIAL])


@dataclass(frozen=True, eq=False)
class Truth:
    """What the nine rays of each ray meet.

    Parameters
    ----------
    nearest, farthest : float64[N]
        t of the nearest and of the farthest; inf for a miss.
    triangles : int32[9 or 10, N]
        What each hits, −1 for none.
    slack : float
        Relative error that t may have besides.
    is_there : bool
        Whether any triangle has an area.
    """

    nearest: np.ndarray
    farthest: np.ndarray
    triangles: np.ndarray
    slack: float
    is_there: bool = True

    @property
    def is_decided(self):
        """bool[N]: all nine hit, or none does of a mesh that is there."""
        return (self.must_hit | self.must_miss) & self.is_there

    @property
    def must_hit(self):
        """bool[N]: all nine hit."""
        return (self.triangles >= 0).all(axis=0)

    @property
    def must_miss(self):
        """bool[N]: none hits."""
        return (self.triangles < 0).all(axis=0)


def _round(directions, angle):
    """float64[9, N, 3]: directions, and those round them."""
    least = np.abs(directions).argmin(axis=1)
    length = np.linalg.norm(directions, axis=1, keepdims=True)
    side = np.cross(directions, np.eye(3)[least])
    side /= np.linalg.norm(side, axis=1, keepdims=True)
    other = np.cross(directions / length, side)
    turn = 2 * np.pi * np.arange(_NUM_ROUND)[:, None, None] / _NUM_ROUND
    moved = directions + angle * length * (np.cos(turn) * side + np.sin(turn) * other)
    return np.concatenate([directions[None], moved])


def _turned_to(corners, origins, directions, angle):
    """float64[N, 3]: directions turned to the nearest points of triangles float64[N, 3, 3] if within ``angle``."""
    length = np.linalg.norm(directions, axis=1, keepdims=True)
    ahead = directions / length
    side = np.cross(ahead, np.eye(3)[np.abs(ahead).argmin(axis=1)])
    side /= np.linalg.norm(side, axis=1, keepdims=True)
    places = corners - origins[:, None]
    depth = np.einsum("nij,nj->ni", places, ahead)
    with np.errstate(all="ignore"):
        # As the ray sees them, itself at 0.
        seen = np.stack([np.einsum("nij,nj->ni", places, axis) for axis in (side, np.cross(ahead, side))], axis=2)
        seen /= depth[:, :, None]
        edges = np.roll(seen, -1, axis=1) - seen
        along = np.clip(-(seen * edges).sum(axis=2) / (edges**2).sum(axis=2), 0, 1)
        feet = seen + along[:, :, None] * edges
        nearest = feet[np.arange(len(feet)), (feet**2).sum(axis=2).argmin(axis=1)]
        # A little further, to be inside in float64.
        nearest += 2.0**-30 * (seen.mean(axis=1) - nearest)
        turns = (depth > 0).all(axis=1) & (np.hypot(*nearest.T) <= angle)
    nearest = np.where(turns[:, None], nearest, 0.0)
    return directions + length * (nearest[:, :1] * side + nearest[:, 1:] * np.cross(ahead, side))


def truth_of(corners, origins, directions, *, fmt, excluded=None, to_mesh=None, answered=None):
    """The :class:`Truth` of rays.

    Parameters
    ----------
    corners : float64[T, 3, 3]
        As the method has them.
    origins, directions : float64[N, 3]
        As the method has them.
    fmt : FloatFormat
        The unit in the last place.
    excluded : int[N], optional
        A triangle that each ray does not hit.
    to_mesh : callable, optional
        Maps (origins, directions) to where the triangles are.
    answered : int[N], optional
        Triangles to which a tenth ray is turned, −1 for none; not with ``to_mesh``.
    """
    blur = BLUR * 2.0 ** -fmt.frac_width
    tenth = () if answered is None else (np.where(
        (answered >= 0)[:, None], _turned_to(corners[answered], origins, directions, blur), directions)[None],)
    directions = np.concatenate([_round(directions, blur), *tenth])
    origins = np.broadcast_to(origins, directions.shape)
    if to_mesh is not None:
        origins, directions = to_mesh(origins, directions)
    exclude = None if excluded is None else (np.where(excluded < 0, -1, 0), excluded)
    if exclude is not None:
        exclude = tuple(np.broadcast_to(number, directions.shape[:-1]) for number in exclude)
    try:
        scene = scene_of(corners)
    except SceneError:
        # Nothing has an area once it is rounded.
        nothing = np.full(directions.shape[1], np.inf)
        return Truth(nothing, nothing, np.full(directions.shape[:2], -1), blur, is_there=False)
    hits = trace(scene, origins, directions, exclude=exclude)
    return Truth(hits.t.min(axis=0), hits.t.max(axis=0), hits.prim_id, blur)


@dataclass(frozen=True, eq=False)
class Verdict:
    """What is wrong about answers; see the module's text.

    Parameters
    ----------
    is_crack, is_phantom, is_distance, is_odd : bool[N]
    """

    is_crack: np.ndarray
    is_phantom: np.ndarray
    is_distance: np.ndarray
    is_odd: np.ndarray

    @property
    def is_failure(self):
        """bool[N]"""
        return self.is_crack | self.is_phantom | self.is_distance | self.is_odd


def judge(answers, truth):
    """The :class:`Verdict` on :class:`~sim.methods.Answers`."""
    is_hit = answers.triangle >= 0
    may_hit = is_hit & ~truth.must_miss
    is_known = (truth.triangles == answers.triangle).any(axis=0)
    farther = may_hit & (answers.t > truth.farthest * (1 + truth.slack))
    nearer = may_hit & (answers.t < truth.nearest * (1 - truth.slack))
    return Verdict(is_crack=truth.must_hit & ~is_hit | farther & ~is_known,
                   is_phantom=truth.must_miss & is_hit | nearer & ~is_known,
                   is_distance=(farther | nearer) & is_known, is_odd=answers.is_odd)
