"""Rays and triangles to try a method on, and what comes of it."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from fpu import FloatFormat
from rtl.affine_map import affine_map

from ..methods import Pairs, closest_hits, near_pairs
from ..methods.method import built
from ..methods.parts import named
from .truth import BLUR, Truth, judge, truth_of

__all__ = ["Probe", "rounded_rays"]


@dataclass(frozen=True, eq=False)
class Probe:
    """Rays and triangles.

    Parameters
    ----------
    fmt : FloatFormat
    corners : float64[T, 3, 3]
    origins, directions : float64[N, 3]
        All members of the format.
    excluded : int[N], optional
        A triangle that each ray does not hit.
    placement : float64[4, 3], optional
        Rows and center of the instance's map m·(X − C), members of the format: rays go through it first.
    must_miss : bool
        Whatever the rounded rays would meet, the rays that are meant meet nothing.
    everything : bool
        Rays are tested against all triangles, instead of those whose widened boxes they meet.
    """

    fmt: FloatFormat
    corners: np.ndarray
    origins: np.ndarray
    directions: np.ndarray
    excluded: np.ndarray | None = None
    placement: np.ndarray | None = None
    must_miss: bool = False
    everything: bool = False

    @property
    def num_rays(self):
        """Number of rays."""
        return len(self.origins)

    def _placed(self, origins, directions):
        if self.placement is None:
            return origins, directions
        rows, center = self.placement[:3], self.placement[3]
        return (origins - center) @ rows.T, directions @ rows.T

    @cached_property
    def truth(self):
        """The :class:`~sim.stability.truth.Truth` of the rays."""
        if self.must_miss:
            nothing = np.full(self.num_rays, np.inf)
            return Truth(nothing, nothing, np.full((9, self.num_rays), -1), 0.0)
        return truth_of(self.corners, self.origins, self.directions, fmt=self.fmt, excluded=self.excluded,
                        to_mesh=self._placed)

    @cached_property
    def rays(self):
        """Origins and directions in the mesh's space, as the chip maps them there."""
        if self.placement is None:
            return self.origins, self.directions
        mapped, matrix = built(affine_map, self.fmt), {}
        for row, name in enumerate(("row0", "row1", "row2", "center")):
            matrix |= named(name, self.placement[row])
        moved = []
        for is_point, vectors in ((True, self.origins), (False, self.directions)):
            results = mapped.model(is_point=is_point, **named("vector", vectors), **matrix)
            moved.append(np.stack([results[f"result_{axis}"] for axis in "xyz"], axis=1))
        return tuple(moved)

    @cached_property
    def pairs(self):
        """The :class:`~sim.methods.Pairs` that are tested."""
        count = len(self.corners)
        if self.everything:
            return Pairs(np.arange(self.num_rays + 1) * count, np.tile(np.arange(count), self.num_rays))
        origins, directions = self._placed(self.origins, self.directions)
        # About a traversal's own slack, and so much that a wrong hit has where to be found.
        extent = np.ptp(self.corners.reshape(-1, 3), axis=0).max()
        away = np.median(np.abs(origins - self.corners.mean(axis=(0, 1))).max(axis=1))
        pad = 0.02 * np.ptp(self.corners, axis=1).max(axis=1) + BLUR * 2.0**-self.fmt.frac_width * (extent + away)
        return near_pairs(self.corners, origins, directions, pad=pad)

    def verdict(self, method):
        """The :class:`~sim.stability.truth.Verdict` on a method."""
        return judge(closest_hits(method, self.fmt, self.corners, *self.rays, self.pairs, excluded=self.excluded),
                     self.truth)


def rounded_rays(fmt, origins, targets, rng, *, stretch=(0.5, 1.5)):
    """Rays in the format from origins through targets, float64[N, 3] each, their directions of any length.

    Those whose direction comes out as 0, or does not fit the format, are left out.

    Returns
    -------
    origins, directions : float64[M, 3]
    kept : bool[N]
    """
    origins = fmt.quantize(origins)
    directions = fmt.quantize((targets - origins) * rng.uniform(*stretch, (len(origins), 1)))
    kept = directions.any(axis=1) & np.isfinite(directions).all(axis=1) & np.isfinite(origins).all(axis=1)
    return origins[kept], directions[kept], kept
