"""The unit-triangle test with edges that are as wide as what was computed may be wrong."""

import math

from fpu import Datapath, Vector

from .method import Method
from .parts import outputs
from .unit_triangle import stored_matrix

__all__ = ["BOUNDS", "CAP", "TOLERANCES", "scaled_map", "tolerant", "tolerant_test"]

#: k of the methods.
TOLERANCES = (2, 4, 8, 16)
#: What bounds the error of u, see :func:`tolerant_test`.
BOUNDS = ("lean", "full", "products", "terms")
#: No edge is wider, in u and v.
CAP = 2.0**-6


def scaled_map(fmt, *, latencies=None):
    """The chip's m·(X − C), and for each row ``result_scale_x`` …: the power of two of the largest of its products.

    Datapath: 9 adders, 9 multipliers; and six comparisons of exponents.
    """
    dp = Datapath(fmt, latencies=latencies)
    is_point, vector, center = dp.flag("is_point"), dp.vector("vector"), dp.vector("center")
    moved = [dp.sub(getattr(vector, axis), dp.select(is_point, getattr(center, axis), dp.const(0.0))) for axis in "xyz"]
    for number, axis in enumerate("xyz"):
        products = [dp.mul(a, b) for a, b in zip(dp.vector(f"row{number}"), moved, strict=True)]
        dp.output(f"result_{axis}", dp.add(dp.add(products[0], products[1]), products[2]))
        first, second, third = (dp.power(product) for product in products)
        dp.output(f"result_scale_{axis}", dp.power_max(dp.power_max(first, second), third))
    return dp


def tolerant_test(fmt, *, ulp, bound=BOUNDS[0], cap=CAP, latencies=None):
    """The chip's test with u > −ε_u, v > −ε_v and u + v < 1 + max(ε_u, ε_v).

    ::

        t = −O′z / D′z,   u = O′x + w,  w = t·D′x,   ε_u = min(ulp·2^−frac_width·E, cap)

    where E, of powers of two alone, is by ``bound``

    ==========  =====================================================================================================
    lean        max(s(O′x), |w|·s(D′z)/|D′z|): s is the largest of the products that were added up, so s(a)/|a| is
                what a has lost to cancellation. D′z = D·N loses where the ray grazes, and t with it, and O′z alike
    full        max(s(O′x), t·s(D′x), |w|·max(s(O′z)/|O′z|, s(D′z)/|D′z|))
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
    # Powers they are already; to say so again keeps their fractions out of the delays.
    scale = {} if bound == "terms" else {
        name: Vector(*map(dp.power, dp.vector(f"{name}_scale"))) for name in ("origin", "direction")}
    t = dp.neg(dp.div(origin.z, direction.z))
    if bound in ("lean", "full"):
        loss = dp.power_div(scale["direction"].z, dp.power(direction.z))
    if bound == "full":
        loss = dp.power_max(loss, dp.power_div(scale["origin"].z, dp.power(origin.z)))
    values, errors = [], []
    for axis in "xy":
        start, way = getattr(origin, axis), dp.mul(t, getattr(direction, axis))
        values.append(dp.add(start, way))
        error = dp.power(start) if bound == "terms" else getattr(scale["origin"], axis)
        if bound in ("full", "products"):
            error = dp.power_max(error, dp.power_mul(dp.power(t), getattr(scale["direction"], axis)))
        if bound == "terms":
            error = dp.power_max(error, dp.power(way))
        elif bound != "products":
            error = dp.power_max(error, dp.power_mul(dp.power(way), loss))
        errors.append(dp.power_mul(error, dp.const(ulp * 2.0**-fmt.frac_width)))
    cap, sum_of = dp.const(cap), dp.add(*values)
    inside = [dp.logical_or(dp.logical_not(dp.is_negative(value)),
                            dp.logical_and(dp.is_within(value, error), dp.is_within(value, cap)))
              for value, error in zip(values, errors, strict=True)]
    inside += [dp.is_at_most_one_plus(sum_of, dp.power_max(*errors)), dp.is_at_most_one_plus(sum_of, cap)]
    return outputs(dp, t, *values, dp.logical_and(*inside))


def tolerant(ulp, *, bound=BOUNDS[0], cap=CAP):
    """The method with a tolerance of ``ulp`` units in the last place.

    Raises
    ------
    ValueError
        If ``ulp`` or ``cap`` is not a power of two, or there is no such bound.
    """
    if ulp <= 0 or math.log2(ulp) % 1 or math.log2(cap) % 1:
        raise ValueError(f"Tolerance and cap must be powers of two, not {ulp!r} and {cap!r}")
    if bound not in BOUNDS:
        raise ValueError(f"Bound must be one of {', '.join(BOUNDS)}, not {bound!r}")

    def test(fmt):
        return tolerant_test(fmt, ulp=ulp, bound=bound, cap=cap)

    return Method(f"tolerant {ulp}" if bound == BOUNDS[0] else f"{bound} {ulp}", stored_matrix, test,
                  point_map=scaled_map, needs_area=True)
