"""Rays at the edges of a scene's own triangles, by the million, through the chip's model."""

from dataclasses import dataclass

import numpy as np

from ..golden.tracer import trace
from ..scene.compile import CompiledScene
from .chip import ChipProbe
from .probe import Probe, rounded_rays
from .probes import leaning, unit
from .truth import BLUR, judge, scene_of, truth_of

__all__ = ["KINDS", "Count", "SceneEdges"]

#: What rays are aimed at.
KINDS = "edges", "vertices", "silhouettes"
#: Cosines at the flatter of the triangles that meet in a silhouette.
_COSINES = 0.01, 0.1
#: Distances from which rays begin, in half extents of the scene.
_DISTANCES = 0.2, 2.0


@dataclass(frozen=True)
class Count:
    """What became of rays; see :mod:`sim.stability.truth`."""

    rays: int = 0
    cracks: int = 0
    phantoms: int = 0
    distances: int = 0
    odd: int = 0

    def __add__(self, other):
        return Count(*(getattr(self, name) + getattr(other, name) for name in self.__dataclass_fields__))


class SceneEdges:
    """A scene compiled to one space, and those of its edges in which two triangles meet, and no third.

    Vertices are the same where they have been rounded to the same. Triangles that this leaves without area are no part
    of it; of two that run along an edge in the same direction, one is taken to be turned over.

    Parameters
    ----------
    scene : Scene
    fmt : FloatFormat

    Raises
    ------
    ValueError
        If no edge is shared.
    SceneError
        If the scene cannot be compiled.
    """

    def __init__(self, scene, *, fmt):
        corners = np.concatenate([placed.to_world(mesh.vertices[mesh.triangles[mesh.usable]])
                                  for placed in scene.instances for mesh in [scene.meshes[placed.mesh]]])
        alone = scene_of(corners)
        compiled = CompiledScene(alone, fmt=fmt)
        self._fmt, self._image = fmt, compiled.image(alone)
        self._corners = fmt.quantize((corners - compiled.center) * compiled.scale)
        self._truth = scene_of(self._corners)
        self._half_extent = np.ptp(self._corners.reshape(-1, 3), axis=0).max() / 2
        self._find_edges()

    @property
    def num_triangles(self):
        """Triangles with an area, as the chip has them."""
        return len(self._normals)

    @property
    def num_edges(self):
        """Edges in which two triangles meet."""
        return len(self._edges)

    def _find_edges(self):
        places, vertices = np.unique(self._corners.reshape(-1, 3), axis=0, return_inverse=True)
        triangles = vertices.reshape(-1, 3)
        normals = np.cross(*(places[triangles[:, k]] - places[triangles[:, 0]] for k in (1, 2)))
        lengths = np.linalg.norm(normals, axis=1)
        keeps = lengths > 0
        triangles, self._normals = triangles[keeps], normals[keeps] / lengths[keeps, None]
        ways = np.concatenate([triangles[:, pair] for pair in ([0, 1], [1, 2], [2, 0])])
        owner = np.tile(np.arange(len(triangles)), 3)
        edges, edge_of, count = np.unique(np.sort(ways, axis=1), axis=0, return_inverse=True, return_counts=True)
        order = np.argsort(edge_of.ravel(), kind="stable")
        first = np.concatenate([[0], np.cumsum(count)])[:-1][count == 2]
        pair = np.stack([order[first], order[first + 1]], axis=1)
        if not len(pair):
            raise ValueError("no two triangles share an edge")
        self._places, self._edges, self._owners = places, edges[count == 2], owner[pair]
        is_turned = (ways[pair[:, 0]] == ways[pair[:, 1]]).all(axis=1)
        self._turn = np.where(is_turned, -1.0, 1.0)
        # A vertex with a loose edge is at a hole.
        whole = np.zeros(len(places), np.bool_)
        whole[triangles] = True
        whole[edges[count != 2]] = False
        is_inside = whole[triangles]
        self._fans = np.stack([triangles[is_inside], np.nonzero(is_inside)[0]], axis=1)

    def _folds(self, count, rng):
        """Points on edges, and the unit normals of the triangles on either side, float64[count, 3] each."""
        edge = rng.integers(len(self._edges), size=count)
        start, end = (self._places[self._edges[edge, k]] for k in (0, 1))
        one, other = (self._normals[self._owners[edge, k]] for k in (0, 1))
        return start + rng.uniform(size=(count, 1)) * (end - start), one, other * self._turn[edge, None]

    def _aimed(self, kind, count, rng):
        """Points, and where to they are seen from."""
        if kind == "vertices":
            if not len(self._fans):
                return np.empty((0, 3)), np.empty((0, 3))
            vertex, triangle = self._fans[rng.integers(len(self._fans), size=count)].T
            ways = unit(self._normals[triangle] + 0.5 * rng.normal(size=(count, 3)))
            return self._places[vertex], ways * rng.choice((-1.0, 1.0), (count, 1))
        points, one, other = self._folds(count, rng)
        if kind == "edges":
            ways = unit(one + other + 0.5 * rng.normal(size=(count, 3)))
            seen = np.sign((ways * one).sum(axis=1)) == np.sign((ways * other).sum(axis=1))
        else:
            cosine = rng.uniform(*_COSINES, (count, 1))
            ways = leaning(one, cosine, rng)
            seen = (ways * other).sum(axis=1) >= cosine[:, 0]
        return points[seen], ways[seen] * rng.choice((-1.0, 1.0), (np.count_nonzero(seen), 1))

    def measure(self, kind, count, rng):
        """The :class:`Count` of up to ``count`` rays at what ``kind``, one of :data:`KINDS`, says.

        A ray whose answer is not golden's within the slack is judged by ten, see :mod:`sim.stability.truth`.
        No failure is that of one that begins on a surface, as far as its origin is known.
        """
        points, ways = self._aimed(kind, count, rng)
        origins = points + ways * rng.uniform(*_DISTANCES, (len(points), 1)) * self._half_extent
        origins, directions, _ = rounded_rays(self._fmt, origins, points, rng)
        whole = len(origins) // 4 * 4
        origins, directions = origins[:whole], directions[:whole]
        probe = ChipProbe(Probe(self._fmt, self._corners, origins, directions), self._image)
        answers, known = probe.answers, trace(self._truth, origins, directions)
        slack = BLUR * 2.0**-self._fmt.frac_width
        with np.errstate(invalid="ignore"):
            is_near = np.abs(answers.t - known.t) <= slack * known.t
        doubtful = np.flatnonzero(~(is_near | (np.isinf(answers.t) & np.isinf(known.t))) | answers.is_odd)
        if not len(doubtful):
            return Count(rays=whole)
        truth = truth_of(self._corners, origins[doubtful], directions[doubtful], fmt=self._fmt,
                         answered=answers.triangle[doubtful])
        # What begins within half a unit in the last place of a surface may begin on either side of it.
        begins = truth.farthest * np.linalg.norm(directions[doubtful], axis=1) <= (
            2.0 ** -(self._fmt.frac_width + 1) * np.abs(origins[doubtful]).max(axis=1))
        verdict = judge(answers.of(doubtful), truth)
        return Count(whole, *(int(np.count_nonzero(getattr(verdict, f"is_{kind}") & ~begins))
                              for kind in ("crack", "phantom", "distance", "odd")))
