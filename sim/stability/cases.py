"""The cases: what is swept, and the rays and triangles for each value of it."""

import math
from dataclasses import dataclass
from functools import partial

import numpy as np

from . import chip, probes

__all__ = ["CASES", "DECIDED", "Case", "bounds_of", "limits_of"]

#: The least part of the rays of a value that must be decided for it to say anything.
DECIDED = 0.25
#: Of the decided rays, how many more may fail than at the easiest value.
_MORE = 0.05


@dataclass(frozen=True)
class Case:
    """A way in which tests fail.

    Parameters
    ----------
    name, parameter : str
        What it is, and what is swept.
    values : tuple of float
        In ascending order.
    easiest : float
        The value of them with which a test has least trouble.
    probe : callable
        ``probe(value, count, fmt=, rng=)``: the :class:`~sim.stability.probe.Probe` of ``count`` rays.
    is_of_chip : bool
        It goes through the chip's model, and there is no other method than its own.
    """

    name: str
    parameter: str
    values: tuple
    easiest: float
    probe: object
    is_of_chip: bool = False

    def rng(self, value):
        """The random numbers of a value, the same each time."""
        return np.random.default_rng([sum(self.name.encode()), self.values.index(value)])


def limits_of(case, failures):
    """The values round the easiest up to which nothing fails, (lowest, highest); None if the easiest fails.

    Parameters
    ----------
    case : Case
    failures : dict from float to int
        Of each of the case's values.
    """
    easiest = case.values.index(case.easiest)
    if failures[case.easiest]:
        return None
    low = high = easiest
    while low > 0 and not failures[case.values[low - 1]]:
        low -= 1
    while high + 1 < len(case.values) and not failures[case.values[high + 1]]:
        high += 1
    return case.values[low], case.values[high]


def bounds_of(case, rows):
    """The values round the easiest up to which hardly more rays fail, (lowest, highest).

    Edges leak everywhere. Hardly more: of those that are decided, which must be a quarter, at most 5 in 100 more than
    at the easiest value.

    Parameters
    ----------
    case : Case
    rows : list of dict
        A method's at each of the case's values: ``parameter``, ``rays``, ``failures``, ``decided``.

    Returns
    -------
    (float, float) or None
        None if too few are decided at the easiest.
    """
    shares = {row["parameter"]: row["failures"] / row["decided"] if row["decided"] >= DECIDED * row["rays"]
              else math.inf for row in rows}
    return limits_of(case, {value: share > min(shares[case.easiest], 1) + _MORE for value, share in shares.items()})


_TRIANGLES = 32, 288, 2592, 23328, 83232
_COSINES = 0.001, 0.003, 0.01, 0.03, 0.1, 0.3
_ANGLES = 1e-4, 3e-4, 1e-3, 3e-3, 1e-2, 3e-2, 1e-1
_FRACTIONS = 1e-6, 1e-5, 1e-4, 1e-3, 1e-2, 1e-1
_SCALES = 1e-3, 1e-2, 1e-1, 1.0, 1e1, 1e2, 1e3

#: All of them by name.
CASES = {case.name: case for case in (
    Case("edges", "triangles of the closed mesh", _TRIANGLES, 32, probes.edges),
    Case("vertices", "triangles of the closed mesh", _TRIANGLES, 32, probes.vertices),
    Case("silhouettes", "cosine at the flatter of two triangles", _COSINES, 0.3, probes.silhouettes),
    Case("grazing", "angle to the surface, rad", _ANGLES, 1e-1, probes.grazing),
    Case("slivers", "length over width", (1e1, 1e2, 1e3, 1e4, 1e5, 1e6), 1e1, probes.slivers),
    Case("size", "radius of the mesh over distance", (1e-5, 1e-4, 1e-3, 1e-2, 1e-1, 1.0, 1e1, 1e2, 1e3, 1e4, 1e5), 1.0,
         probes.size),
    Case("far", "distance from the origin over radius", (1.0, 1e1, 1e2, 1e3, 1e4, 1e5, 1e6), 1.0, probes.far),
    Case("far, recentred", "distance from the origin over radius", (1.0, 1e1, 1e2, 1e3, 1e4, 1e5, 1e6), 1.0,
         probes.far_recentred),
    Case("scaled instance", "scale along one axis", _SCALES, 1.0, probes.scaled_instance),
    Case("sheared instance", "shear", (0.0, 1e-1, 1.0, 1e1, 1e2, 1e3), 0.0, probes.sheared_instance),
    Case("axis-parallel", "squares along a cube's edge", (2, 3, 4, 5, 8, 16), 2, probes.axis_parallel),
    Case("nested", "gap over radius", (0.0, *_FRACTIONS), 1e-1, probes.nested),
    Case("degenerate", "height over length", (0.0, *_FRACTIONS), 1e-1, probes.degenerate),
    Case("leaving", "cosine to the normal", (*_COSINES, 1.0), 1.0, probes.leaving),
    Case("leaving, own excluded", "cosine to the normal", (*_COSINES, 1.0), 1.0, probes.leaving_excluded),
    Case("entering, own excluded", "cosine to the normal", (*_COSINES, 1.0), 1.0, probes.entering_excluded),
    Case("scale", "power of ten of everything", (-18, -15, -12, -9, -6, -3, 0, 3, 6, 9, 12, 15, 18), 0, probes.scale),
    Case("direction", "power of ten of the direction", (-15, -12, -9, -6, -3, 0, 3, 6, 9, 12, 15), 0,
         probes.direction),
    Case("edges, chip", "triangles of the closed mesh", _TRIANGLES, 32, partial(chip.traversed, probes.edges), True),
    Case("grazing, chip", "angle to the surface, rad", _ANGLES, 1e-1, partial(chip.traversed, probes.grazing), True),
    Case("splitting planes, chip", "units in the last place off the plane, at most", (0, 1, 2, 4, 16), 0,
         chip.in_splitting_planes, True),
    Case("deep tree, chip", "squares one behind the other", (2, 4, 8, 16, 24), 2, chip.deep_tree, True),
)}
