"""The unit-triangle test with edges that are as wide as what was computed may be wrong."""

import math

from fpu import Datapath

from .method import Method
from .parts import outputs
from .unit_triangle import stored_matrix

__all__ = ["TOLERANCES", "scaled_map", "tolerant", "tolerant_test"]

#: k of the methods.
TOLERANCES = (2, 4, 8, 16)


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


def tolerant_test(fmt, *, ulp, variant="conditioned", cap=None, lcap=None, latencies=None):
    """The chip's test, with u ≥ −ε, v ≥ −ε and u + v ≤ 1 + ε, where ε is k units in the last place.

    ::

        t = −O′z / D′z,  u = O′x + t·D′x,  v = O′y + t·D′y
    """
    dp = Datapath(fmt, latencies=latencies)
    origin, direction = dp.vector("origin"), dp.vector("direction")
    t = dp.neg(dp.div(origin.z, direction.z))
    scales = {}
    if variant != "result":
        scales = {name: dp.vector(f"{name}_scale") for name in ("origin", "direction")}
    if variant == "conditioned":
        # Digits that O′z and D′z have lost, and t with them.
        loss = dp.power_max(*(dp.power_div(scales[name].z, dp.power(vector.z))
                              for name, vector in (("origin", origin), ("direction", direction))))
        if lcap is not None:
            loss = dp.select(dp.is_within(loss, dp.const(lcap)), loss, dp.const(1.0 if lcap<0 else lcap))
    unit = dp.const(2.0 ** -fmt.frac_width * ulp)
    values, errors = [], []
    for axis in "xy":
        start, way = getattr(origin, axis), dp.mul(t, getattr(direction, axis))
        values.append(dp.add(start, way))
        if variant == "result":
            error = dp.power_max(dp.power(start), dp.power(way))
        else:
            error = dp.power_max(getattr(scales["origin"], axis),
                                 dp.power_mul(dp.power(t), getattr(scales["direction"], axis)))
        if variant == "conditioned":
            error = dp.power_max(error, dp.power_mul(dp.power(way), loss))
        error = dp.power_mul(error, unit)
        if cap is not None:
            error = dp.select(dp.is_within(error, dp.const(cap)), error, dp.const(cap))
        errors.append(error)
    u, v = values
    inside = [dp.logical_or(dp.logical_not(dp.is_negative(value)), dp.is_within(value, error))
              for value, error in zip(values, errors, strict=True)]
    inside.append(dp.is_at_most_one_plus(dp.add(u, v), dp.power_max(*errors)))
    return outputs(dp, t, u, v, dp.logical_and(*inside))


def tolerant(ulp, variant="conditioned", cap=None, lcap=None):
    """The method with a tolerance of ``ulp``, a power of two."""
    if ulp < 1 or math.log2(ulp) % 1:
        raise ValueError(f"Tolerance must be a power of two of units in the last place, not {ulp!r}")
    suffix = f" {variant[:1]} {cap} {lcap}"
    return Method(f"tolerant {ulp}{suffix}", stored_matrix, lambda fmt: tolerant_test(fmt, ulp=ulp, variant=variant, cap=cap, lcap=lcap),
                  point_map=scaled_map, needs_area=True)
