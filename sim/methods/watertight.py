"""The watertight test of Woop, Benthin and Wald."""

from fpu import Datapath, Vector

from .method import Method
from .parts import each, has_one_sign, named, outputs

__all__ = ["WATERTIGHT", "shear", "watertight_test"]


def _turned(dp, along_x, along_y, a):
    """(k, and the other two in cyclic order) as x, y = others, z = k."""
    return Vector(dp.select(along_x, a.y, dp.select(along_y, a.z, a.x)),
                  dp.select(along_x, a.z, dp.select(along_y, a.x, a.y)),
                  dp.select(along_x, a.x, dp.select(along_y, a.y, a.z)))


def shear(fmt, *, latencies=None):
    """What is computed once for each ray: k, the axis of D's largest part, and (S_x, S_y, S_z) = (D_x, D_y, 1) / D_k.

    Datapath: 3 dividers, 3 comparators.
    """
    dp = Datapath(fmt, latencies=latencies)
    direction = dp.vector("direction")
    x, y, z = (dp.abs(part) for part in direction)
    along_x = dp.logical_and(dp.ge(x, y), dp.ge(x, z))
    along_y = dp.logical_and(dp.logical_not(along_x), dp.ge(y, z))
    turned = _turned(dp, along_x, along_y, direction)
    for name, value in (("shear_x", turned.x), ("shear_y", turned.y), ("shear_z", dp.const(1.0))):
        dp.output(name, dp.div(value, turned.z))
    dp.output("along_x", along_x)
    dp.output("along_y", along_y)
    return dp


def watertight_test(fmt, *, latencies=None):
    """A ray, sheared to run along +z from 0, against a triangle's three edge functions.

    ::

        (A, B, C) = v_i − O, turned;   x −= S_x·z,  y −= S_y·z,  z ·= S_z
        w₀ = C_x·B_y − C_y·B_x, and so on in cyclic order;   w = w₀ + w₁ + w₂
        u = w₁ / w,  v = w₂ / w,  t = (w₀·A_z + w₁·B_z + w₂·C_z) / w

    Two triangles compute the function of an edge that they share from the same numbers, exactly negated; a hit has all
    w_i of one sign, or zero. From Woop, Benthin, Wald: Watertight ray/triangle intersection, JCGT 2(1), 2013, without
    its second computation in double precision where a w_i is 0. ``hit`` and ``nearer`` as of
    :func:`~rtl.intersection.unit_triangle`.

    Datapath: 22 adders, 21 multipliers, 1 divider, 1 comparator; and :func:`shear`.
    """
    dp = Datapath(fmt, latencies=latencies)
    origin, slope = dp.vector("origin"), dp.vector("shear")
    along_x, along_y = dp.flag("along_x"), dp.flag("along_y")
    flat, depths = [], []
    for i in range(3):
        x, y, z = _turned(dp, along_x, along_y, each(dp.sub, dp.vector(f"corner{i}"), origin))
        flat.append((dp.sub(x, dp.mul(slope.x, z)), dp.sub(y, dp.mul(slope.y, z))))
        depths.append(dp.mul(slope.z, z))
    sides = []
    for i in range(3):
        (b_x, b_y), (c_x, c_y) = flat[(i + 1) % 3], flat[(i + 2) % 3]
        sides.append(dp.sub(dp.mul(c_x, b_y), dp.mul(c_y, b_x)))
    scale = dp.div(dp.const(1.0), dp.add(dp.add(sides[0], sides[1]), sides[2]))
    products = [dp.mul(side, depth) for side, depth in zip(sides, depths, strict=True)]
    t = dp.mul(dp.add(dp.add(products[0], products[1]), products[2]), scale)
    return outputs(dp, t, dp.mul(sides[1], scale), dp.mul(sides[2], scale), has_one_sign(dp, sides))


def _store(corners):
    return {name: column for i in range(3) for name, column in named(f"corner{i}", corners[:, i]).items()}


WATERTIGHT = Method("Woop 2013", _store, watertight_test, per_ray=shear)
