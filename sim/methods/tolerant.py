"""The unit-triangle test with edges that are as wide as what was computed may be wrong."""

import math

import numpy as np

from fpu import Datapath
from rtl.affine_map import affine_map
from rtl.config import ChipConfig
from rtl.unit_triangle import MARGIN, MAX_TOLERANCE, REACH, edge_scales, inside_edges, unit_triangle

from .method import Method
from .parts import outputs
from .unit_triangle import stored_matrix

__all__ = ["BOUNDS", "DEFAULT", "TOLERANCES", "scaled_map", "tolerant", "tolerant_test"]

#: k of the methods, besides the chip's.
TOLERANCES = (2, 4, 16)
#: What else than the chip's may bound the error of u, see :func:`tolerant_test`.
BOUNDS = ("full", "products", "terms")


def scaled_map(fmt):
    """The chip's m·(X − C) with the scale of each row, see :func:`~rtl.affine_map.affine_map`."""
    return affine_map(fmt, scaled=True)


def tolerant_test(fmt, *, ulp, bound, cap=MAX_TOLERANCE, latencies=None):
    """As the chip's test u > −ε_u, v > −ε_v and u + v < 1 + max(ε_u, ε_v).

    ::

        t = −O′z / D′z,   u = O′x + w,  w = t·D′x,   ε_u = min(ulp·2^−frac_width·E, cap)

    where E, of powers of two alone, is by ``bound``

    ==========  =====================================================================================================
    full        max(s(O′x), t·s(D′x), |w|·max(s(O′z)/|O′z|, s(D′z)/|D′z|)): s is the largest of the products that were
                added up, so s(a)/|a| is what a has lost to cancellation
    products    max(s(O′x), t·s(D′x))
    terms       max(|O′x|, |w|)
    ==========  =====================================================================================================

    The ``cap`` keeps triangles from reaching out that are seen so exactly from their edge that nothing is left of t.
    What is 0 or more, and u + v ≤ 1, is inside whatever ε is; ``hit`` and ``nearer`` as of
    :func:`~rtl.intersection.unit_triangle`.

    Datapath: 3 adders, 2 multipliers, 1 divider, 1 comparator; and a few additions and comparisons of exponents.
    """
    dp = Datapath(fmt, latencies=latencies)
    origin, direction = dp.vector("origin"), dp.vector("direction")
    scales = {} if bound == "terms" else edge_scales(dp)
    t = dp.neg(dp.div(origin.z, direction.z))
    ways = [dp.mul(t, direction.x), dp.mul(t, direction.y)]
    if bound == "terms":
        errors = [dp.power_max(dp.power(start), dp.power(way)) for start, way in zip(origin, ways, strict=False)]
    else:
        errors = _errors_of_products(dp, t, origin, direction, ways, full=bound == "full", **scales)
    errors = [dp.power_mul(error, dp.const(ulp * 2.0**-fmt.frac_width)) for error in errors]
    u, v = (dp.add(start, way) for start, way in zip(origin, ways, strict=False))
    return outputs(dp, t, u, v, inside_edges(dp, u, v, errors, most=cap))


def _errors_of_products(dp, t, origin, direction, ways, *, origin_scale, direction_scale, full):
    errors = [dp.power_max(start, dp.power_mul(dp.power(t), way))
              for start, way in ((origin_scale.x, direction_scale.x), (origin_scale.y, direction_scale.y))]
    if full:
        loss = dp.power_max(dp.power_div(direction_scale.z, dp.power(direction.z)),
                            dp.power_div(origin_scale.z, dp.power(origin.z)))
        errors = [dp.power_max(error, dp.power_mul(dp.power(way), loss))
                  for error, way in zip(errors, ways, strict=True)]
    return errors


def tolerant(ulp, *, bound=None, cap=MAX_TOLERANCE, name=None):
    """The method with a tolerance of ``ulp`` units in the last place, by the chip's own bound unless one is named.

    Raises
    ------
    ValueError
        If ``ulp`` or ``cap`` is not a power of two, or there is no such bound.
    """
    if ulp <= 0 or math.log2(ulp) % 1 or math.log2(cap) % 1:
        raise ValueError(f"Tolerance and cap must be powers of two, not {ulp!r} and {cap!r}")
    if bound not in (None, *BOUNDS):
        raise ValueError(f"Bound must be one of {', '.join(BOUNDS)}, not {bound!r}")
    if bound is None:
        def constants(fmt):
            unit = 2.0**-fmt.frac_width
            return {"tolerance": ulp * unit, "margin": MARGIN * ulp * unit,
                    **dict.fromkeys(("soft_front", "soft_back"), np.inf),
                    **dict.fromkeys(("front_is_loose", "back_is_loose"), False)}

        return Method(name or f"tolerant {ulp}", stored_matrix, _chip_test, point_map=scaled_map, needs_area=True,
                      reach=REACH, constants=constants)

    def test(fmt):
        return tolerant_test(fmt, ulp=ulp, bound=bound, cap=cap)

    return Method(f"{bound} {ulp}", stored_matrix, test, point_map=scaled_map, needs_area=True)


def _chip_test(fmt):
    return unit_triangle(fmt, tolerant=True)


DEFAULT = tolerant(ChipConfig().edge_tolerance, name="default")
