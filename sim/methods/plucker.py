"""A ray against the three edges of a triangle, by their Plücker coordinates."""

import numpy as np

from fpu import Datapath

from .method import Method
from .parts import cross, dot, each, has_one_sign, named, outputs

__all__ = ["PLUCKER", "PLUCKER_RELATIVE", "plucker_test", "relative_test"]


def plucker_test(fmt, *, latencies=None, stored=True):
    """A ray against the three edges of a triangle, by their Plücker coordinates: I_p.

    ::

        w_i = D·(v_j × v_k) + (O × D)·(v_k − v_j)   for the edge from v_j to v_k across from v_i
        u = w₁ / w,  v = w₂ / w,  t = (N·v0 − N·O) / w,   w = w₀ + w₁ + w₂ = N·D

    where N = v0 × v1 + v1 × v2 + v2 × v0. A hit has all w_i of one sign. ``stored``: edges and plane are, 22 floats in
    all; else they are computed from the vertices. ``hit`` and ``nearer`` as of
    :func:`~rtl.intersection.unit_triangle`. From Erickson: Pluecker Coordinates, Ray Tracing News 10(3), 1997.

    Datapath: 23 adders, 30 multipliers, 1 divider, 1 comparator; 49, 51, 1, 1 if nothing is stored.
    """
    dp = Datapath(fmt, latencies=latencies)
    origin, direction = dp.vector("origin"), dp.vector("direction")
    if stored:
        moments = [dp.vector(f"moment{i}") for i in range(3)]
        edges = [dp.vector(f"edge{i}") for i in range(3)]
        normal, distance = dp.vector("normal"), dp.input("distance")
    else:
        corners = [dp.vector(f"corner{i}") for i in range(3)]
        pairs = [(corners[(i + 1) % 3], corners[(i + 2) % 3]) for i in range(3)]
        moments = [cross(dp, start, end) for start, end in pairs]
        edges = [each(dp.sub, end, start) for start, end in pairs]
        normal = each(dp.add, each(dp.add, moments[0], moments[1]), moments[2])
        distance = dot(dp, normal, corners[0])
    moment = cross(dp, origin, direction)
    sides = [dp.add(dot(dp, direction, moments[i]), dot(dp, moment, edges[i])) for i in range(3)]
    scale = dp.div(dp.const(1.0), dp.add(dp.add(sides[1], sides[2]), sides[0]))
    t = dp.mul(dp.sub(distance, dot(dp, normal, origin)), scale)
    return outputs(dp, t, dp.mul(sides[1], scale), dp.mul(sides[2], scale), has_one_sign(dp, sides))


def relative_test(fmt, *, latencies=None):
    """The Plücker test with the ray's origin as the origin.

    ::

        w_i = D·((v_j − O) × (v_k − O)),   t = N·(v0 − O) / N·D

    of stored vertices and N = (v1 − v0) × (v2 − v0); the rest as of :func:`plucker_test`.

    Datapath: 30 adders, 35 multipliers, 2 dividers, 1 comparator.
    """
    dp = Datapath(fmt, latencies=latencies)
    origin, direction, normal = dp.vector("origin"), dp.vector("direction"), dp.vector("normal")
    corners = [each(dp.sub, dp.vector(f"corner{i}"), origin) for i in range(3)]
    sides = [dot(dp, direction, cross(dp, corners[(i + 1) % 3], corners[(i + 2) % 3])) for i in range(3)]
    scale = dp.div(dp.const(1.0), dp.add(dp.add(sides[1], sides[2]), sides[0]))
    t = dp.div(dot(dp, normal, corners[0]), dot(dp, normal, direction))
    return outputs(dp, t, dp.mul(sides[1], scale), dp.mul(sides[2], scale), has_one_sign(dp, sides))


def _normal(corners):
    return np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])


def _store(corners):
    stored = {}
    for i in range(3):
        start, end = corners[:, (i + 1) % 3], corners[:, (i + 2) % 3]
        stored |= named(f"moment{i}", np.cross(start, end)) | named(f"edge{i}", end - start)
    normal = _normal(corners)
    return stored | named("normal", normal) | {"distance": (normal * corners[:, 0]).sum(axis=1)}


def _store_relative(corners):
    stored = named("normal", _normal(corners))
    for i in range(3):
        stored |= named(f"corner{i}", corners[:, i])
    return stored


PLUCKER = Method("Plücker", _store, plucker_test)
PLUCKER_RELATIVE = Method("Plücker, relative", _store_relative, relative_test)
