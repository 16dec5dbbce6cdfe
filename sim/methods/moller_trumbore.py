"""A ray against a triangle by Cramer's rule."""

from fpu import Datapath

from .method import Method
from .parts import cross, dot, each, named, outputs

__all__ = ["MOLLER_TRUMBORE", "moller_trumbore_test"]


def moller_trumbore_test(fmt, *, latencies=None):
    """A ray against a triangle of which one corner and two edges are stored.

    ::

        p = D × e2,  s = O − v0,  q = s × e1
        (t, u, v) = (e2·q, s·p, D·q) / (e1·p)

    From Möller, Trumbore: Fast, minimum storage ray/triangle intersection, Journal of Graphics Tools 2(1), 1997.
    ``hit`` and ``nearer`` as of :func:`~rtl.intersection.unit_triangle`.

    Datapath: 18 adders, 27 multipliers, 1 divider, 1 comparator.
    """
    dp = Datapath(fmt, latencies=latencies)
    origin, direction, corner, edge1, edge2 = (
        dp.vector(name) for name in ("origin", "direction", "corner", "edge1", "edge2"))
    p, s = cross(dp, direction, edge2), each(dp.sub, origin, corner)
    q = cross(dp, s, edge1)
    scale = dp.div(dp.const(1.0), dot(dp, edge1, p))
    t, u, v = (dp.mul(value, scale) for value in (dot(dp, edge2, q), dot(dp, s, p), dot(dp, direction, q)))
    inside = dp.logical_and(dp.logical_not(dp.is_negative(u)), dp.logical_not(dp.is_negative(v)),
                            dp.is_at_most_one(dp.add(u, v)))
    return outputs(dp, t, u, v, inside)


def _store(corners):
    return (named("corner", corners[:, 0]) | named("edge1", corners[:, 1] - corners[:, 0])
            | named("edge2", corners[:, 2] - corners[:, 0]))


MOLLER_TRUMBORE = Method("Möller-Trumbore", _store, moller_trumbore_test)
