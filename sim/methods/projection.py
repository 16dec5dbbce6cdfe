"""A ray against a triangle that is projected along an axis."""

import numpy as np

from fpu import Datapath

from .method import Method
from .parts import outputs

__all__ = ["PROJECTION", "projection_test"]


def projection_test(fmt, *, latencies=None):
    """A ray against a triangle that is projected along the axis k of its normal's largest part: I_w.

    ::

        t = (n_d − (O_k + n_u·O_u + n_v·O_v)) / (D_k + n_u·D_u + n_v·D_v)
        p = (O_u, O_v) + t·(D_u, D_v)
        u = b_u·p_u + b_v·p_v + b_d,  v = c_u·p_u + c_v·p_v + c_d

    with (n_u, n_v, n_d) = (N_u, N_v, N·v0) / N_k, and b and c the lines on which u and v are 0: nine stored floats, and
    k, which is two flags. ``hit`` and ``nearer`` as of :func:`~rtl.intersection.unit_triangle`. From Wald: Realtime Ray
    Tracing and Interactive Global Illumination, 2004.

    Datapath: 12 adders, 10 multipliers, 1 divider, 1 comparator.
    """
    dp = Datapath(fmt, latencies=latencies)
    origin, direction = dp.vector("origin"), dp.vector("direction")
    along_x, along_y = dp.flag("along_x"), dp.flag("along_y")

    def turned(a):
        # k, then the other two in cyclic order.
        return (dp.select(along_x, a.x, dp.select(along_y, a.y, a.z)),
                dp.select(along_x, a.y, dp.select(along_y, a.z, a.x)),
                dp.select(along_x, a.z, dp.select(along_y, a.x, a.y)))

    def line(name, p, q):
        return dp.add(dp.add(dp.mul(dp.input(f"{name}_u"), p), dp.mul(dp.input(f"{name}_v"), q)),
                      dp.input(f"{name}_d"))

    n_u, n_v, n_d = (dp.input(f"n_{axis}") for axis in "uvd")
    (o_k, o_u, o_v), (d_k, d_u, d_v) = turned(origin), turned(direction)
    above = dp.sub(n_d, dp.add(dp.add(o_k, dp.mul(n_u, o_u)), dp.mul(n_v, o_v)))
    slope = dp.add(dp.add(d_k, dp.mul(n_u, d_u)), dp.mul(n_v, d_v))
    t = dp.div(above, slope)
    p, q = dp.add(o_u, dp.mul(t, d_u)), dp.add(o_v, dp.mul(t, d_v))
    u, v = line("b", p, q), line("c", p, q)
    inside = dp.logical_and(dp.logical_not(dp.is_negative(u)), dp.logical_not(dp.is_negative(v)),
                            dp.is_at_most_one(dp.add(u, v)))
    return outputs(dp, t, u, v, inside)


def _store(corners):
    edge1, edge2 = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    normal = np.cross(edge1, edge2)
    k = np.abs(normal).argmax(axis=1)
    rows, axes = np.arange(len(corners)), np.stack([k, (k + 1) % 3, (k + 2) % 3])
    n_k, n_u, n_v = normal[rows, axes]
    (_, p_u, p_v), (_, e_u, e_v), (_, f_u, f_v) = (vectors[rows, axes] for vectors in (corners[:, 0], edge1, edge2))
    distance = (normal * corners[:, 0]).sum(axis=1)
    with np.errstate(divide="ignore", invalid="ignore"):
        stored = {"n_u": n_u / n_k, "n_v": n_v / n_k, "n_d": distance / n_k,
                  "b_u": f_v / n_k, "b_v": -f_u / n_k, "b_d": (p_v * f_u - p_u * f_v) / n_k,
                  "c_u": -e_v / n_k, "c_v": e_u / n_k, "c_d": (p_u * e_v - p_v * e_u) / n_k}
    return stored | {"along_x": k == 0, "along_y": k == 1}


PROJECTION = Method("Wald's projection", _store, projection_test, needs_area=True)
