"""Ray/triangle tests as datapaths: what they store of a triangle, what they compute once for a ray, and the test."""

from collections import Counter, namedtuple
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from .parts import named

__all__ = ["Method", "Tested", "built"]

#: Results of a test, of which not all have the last three: else the key is t, and nothing soft.
Tested = namedtuple("Tested", ["t", "u", "v", "hit", "key", "is_soft", "is_back", "is_loose"])


@lru_cache(maxsize=64)
def built(datapath, fmt):
    """The datapath that ``datapath(fmt)`` makes, the same each time."""
    return datapath(fmt)


@dataclass(frozen=True, eq=False)
class Method:
    """A ray/triangle test.

    Parameters
    ----------
    name : str
    stored : callable
        ``stored(corners)``: what is kept of triangles float64[T, 3, 3], as the test's inputs by name.
    datapath : callable
        ``datapath(fmt)``: the test, with the outputs t, u, v and ``hit``, and ``key`` if it is not t that counts.
    per_ray : callable or None
        ``per_ray(fmt)``: what of a direction is computed once, in place of which the test takes it.
    point_map : callable or None
        ``point_map(fmt)``: an affine map of origins (``is_point``) and directions before the test, which has
        ``result_x`` … as its ``origin`` and ``direction``, and what else it gives under ``origin_…``, ``direction_…``.
    constants : callable
        ``constants(fmt)``: inputs of the test by name that are always the same.
    reach : float
        Part of t within which two soft hits make one, see :func:`~rtl.unit_triangle.unit_triangle`.
    needs_area : bool
        Triangles without area cannot be stored, and are left out.
    """

    name: str
    stored: object
    datapath: object
    per_ray: object = None
    point_map: object = None
    constants: object = lambda fmt: {}
    reach: float = 0.0
    needs_area: bool = False

    def store(self, fmt, corners):
        """What is kept of triangles, rounded to the format, and which can be kept.

        Parameters
        ----------
        fmt : FloatFormat
        corners : float64[T, 3, 3]
            v0, v1, v2 of each, members of the format.

        Returns
        -------
        stored : dict from str to array[T]
        usable : bool[T]
        """
        values = self.stored(corners)
        usable = np.ones(len(corners), np.bool_)
        for value in values.values():
            if self.needs_area and value.dtype != np.bool_:
                usable &= np.isfinite(value)
        return {name: value if value.dtype == np.bool_ else fmt.quantize(np.where(usable, value, 0.0))
                for name, value in values.items()}, usable

    def begin(self, fmt, origins, directions):
        """What the test takes of rays float64[N, 3], as arrays by name."""
        rays = named("origin", origins)
        if self.per_ray is None:
            return rays | named("direction", directions)
        return rays | built(self.per_ray, fmt).model(**named("direction", directions))

    def test(self, fmt, triangles, rays):
        """:data:`Tested` of a ray and a triangle in each place of the arrays of :meth:`begin` and :meth:`store`."""
        if self.point_map is not None:
            mapped = built(self.point_map, fmt)
            moved = {}
            for name, is_point in (("origin", True), ("direction", False)):
                vector = {f"vector_{axis}": rays[f"{name}_{axis}"] for axis in "xyz"}
                results = mapped.model(is_point=is_point, **vector, **triangles)
                moved |= {f"{name}_{output.removeprefix('result_')}": value for output, value in results.items()}
            triangles, rays = {}, moved
        test = built(self.datapath, fmt)
        given = {"t_hit": np.inf, **self.constants(fmt), **triangles, **rays}
        results = test.model(**{name: given[name] for name in test.input_names})
        nothing = np.zeros(np.shape(results["hit"]), np.bool_)
        return Tested(*(results[name] for name in ("t", "u", "v", "hit")), results.get("key", results["t"]),
                      results.get("is_soft", nothing), np.signbit(given["direction_z"]) if self.reach else nothing,
                      results.get("is_loose", nothing))

    def cost(self, fmt):
        """Operators for a test a clock, as :meth:`~fpu.Datapath.cost`; those that a ray takes once are apart."""
        total = Counter()
        for part in (self.point_map, self.datapath):
            if part is not None:
                total.update(built(part, fmt).cost())
        return dict(total), dict(built(self.per_ray, fmt).cost()) if self.per_ray else {}
