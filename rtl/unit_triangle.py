"""The ray/triangle test that the intersection unit is made of."""

from fpu import Datapath, Vector

from .arithmetic import ARITHMETICS

__all__ = ["GRAZING", "MARGIN", "MAX_MARGIN", "MAX_TOLERANCE", "REACH", "edge_errors", "edge_scales",
           "inside_edges", "unit_triangle"]

#: No edge gives by more, in u and v: seen so exactly from its edge that t is lost, a triangle would reach out.
MAX_TOLERANCE = 2.0**-3
#: Part of t within which two soft hits are at one edge: where a ray grazes, that is how far apart rounding puts them.
REACH = 2.0**-6
#: What t may have lost, s(D′z)/|D′z|, before a triangle counts as one that the ray grazes.
GRAZING = 2.0
#: Tolerances by which a hit that is inside by tolerance alone counts as farther than it is, times what t has lost.
MARGIN = 1
#: No soft hit counts as farther by a greater part of t.
MAX_MARGIN = REACH / 2


def unit_triangle(fmt, *, latencies=None, arithmetic=ARITHMETICS[0], near=False, tolerant=False):
    """t = −O′z / D′z, u = O′x + t·D′x, v = O′y + t·D′y; ``hit`` if 0 < t < ∞, u ≥ 0, v ≥ 0 and u + v ≤ 1.

    ``nearer`` if t < t_hit, which comes in just in time, as late as t is known (paper §2.1.2). With ``near``
    it is t_near < t instead of 0 < t.

    With ``tolerant`` it is u > −ε_u, v > −ε_v, u + v < 1 + max(ε_u, ε_v), where ε_u = ``tolerance`` times

        max(s(O′x), |t·D′x|·s(D′z)/|D′z|), at most :data:`MAX_TOLERANCE`

    in powers of two; s, the ``scale`` of :func:`~rtl.affine_map.affine_map`, is the largest of the products that were
    added up. What rounding them does to O′x is the first term; the second is what t does, which divides by D′z = D·N
    and loses what that has lost, where a ray grazes. What is 0 or more is inside whatever ε is. Where s(D′z)/|D′z| is
    at most :data:`GRAZING`, twice the ``tolerance`` holds, and what is not inside without that is loose.

    A hit by tolerance alone is soft, others are firm. Where a ray slips between two triangles, it is soft on both;
    where it passes an outline, on one, or on two of which one is seen from behind. So a soft hit is a ``hit`` if it is
    within :data:`REACH` of the last soft one that was none, of a triangle seen from the same side (``soft_front``:
    against its normal, ``soft_back``), and not both are loose (``front_is_loose``, ``back_is_loose``): rounding is
    seldom far off twice. Else ``is_soft`` says that it is to be that one, ``is_loose`` how. And where triangles overlap
    by their tolerance, the one that is hit firmly is the one that is there: what counts is not t but ``key``, t and of
    a soft hit as much more as its t may be wrong, ``margin``·s(D′z)/|D′z|, twice that where twice the tolerance holds,
    and at most :data:`MAX_MARGIN`, see :meth:`~fpu.graph.Graph.raised`. ``nearer`` is key < t_hit then, the nearest so
    far; what is not is no ``is_soft``.

    Datapath: 3 adders, 2 multipliers, 1 divider, 1 comparator; with ``near`` another comparator; if tolerant, two more,
    a few additions and comparisons of exponents, and additions of a constant to bits.
    """
    dp = Datapath(fmt, latencies=latencies, **arithmetic.parameters)
    origin, direction = dp.vector("origin"), dp.vector("direction")
    t = dp.neg(dp.div(origin.z, direction.z))
    key, soft = t, None
    u = dp.add(origin.x, dp.mul(t, direction.x))
    v = dp.add(origin.y, dp.mul(t, direction.y))
    if tolerant:
        scales = edge_scales(dp)
        loss = dp.power_div(scales["direction_scale"].z, dp.power(direction.z))
        errors = edge_errors(dp, t, direction, **scales)
        grazes = dp.logical_not(dp.is_within(loss, dp.const(2 * GRAZING)))
        # Constants that need no registers
        tolerance = dp.input("tolerance", delay=max(map(dp.arrival, errors)))
        inside, close = (
            inside_edges(dp, u, v, [dp.power_mul(error, units) for error in errors])
            for units in (_twice_unless(dp, grazes, tolerance), tolerance))
        is_loose = dp.logical_not(close)
        margin = dp.power_mul(loss, _twice_unless(dp, grazes, dp.input("margin", delay=dp.arrival(t))))
        most = dp.const(MAX_MARGIN)
        firm, later = _is_inside(dp, u, v), dp.raised(t, dp.select(dp.is_within(margin, most), margin, most))
        key = dp.register(dp.select(firm, t, later))
        reach = dp.const(REACH)
        front, back = (dp.input(name, delay=dp.arrival(key)) for name in ("soft_front", "soft_back"))
        is_back = dp.sign(direction.z)
        t_soft = dp.select(is_back, back, front)
        front_is_loose, back_is_loose = (
            dp.flag(name, delay=dp.arrival(key)) for name in ("front_is_loose", "back_is_loose"))
        both = dp.logical_and(is_loose, dp.select(is_back, back_is_loose, front_is_loose))
        is_pair = dp.logical_and(dp.le(t_soft, dp.raised(t, reach)), dp.le(t, dp.raised(t_soft, reach)),
                                 dp.logical_not(both))
        soft = dp.logical_and(inside, dp.logical_not(firm), dp.logical_not(is_pair))
        inside = dp.logical_and(inside, dp.logical_or(firm, is_pair))
    else:
        inside = _is_inside(dp, u, v)
    t_hit = dp.input("t_hit", delay=dp.arrival(key))
    if near:
        ahead = dp.logical_and(dp.is_finite(t), dp.lt(dp.input("t_near", delay=dp.arrival(key)), t))
    else:
        ahead = dp.logical_and(dp.is_finite(t), dp.logical_not(dp.sign(t)), dp.logical_not(dp.is_zero(t)))
    dp.output("t", t)
    dp.output("u", u)
    dp.output("v", v)
    dp.output("hit", dp.logical_and(ahead, inside))
    nearer = dp.lt(key, t_hit)
    dp.output("nearer", nearer)
    if tolerant:
        dp.output("key", key)
        dp.output("is_soft", dp.logical_and(ahead, soft, nearer))
        dp.output("is_loose", is_loose)
    return dp


def _twice_unless(dp, flag, power):
    return dp.select(flag, power, dp.power_mul(power, dp.const(2.0)))


def _is_inside(dp, u, v):
    return dp.logical_and(dp.logical_not(dp.is_negative(u)), dp.logical_not(dp.is_negative(v)),
                          dp.is_at_most_one(dp.add(u, v)))


def edge_scales(dp):
    """The inputs ``origin_scale`` and ``direction_scale``, as :func:`edge_errors` takes them."""
    # Powers they are already; to say so again keeps their fractions out of the delays.
    return {name: Vector(*map(dp.power, dp.vector(name))) for name in ("origin_scale", "direction_scale")}


def edge_errors(dp, t, direction, *, origin_scale, direction_scale):
    """Of u and of v, in powers of two, what a unit in the last place is a part of: see :func:`unit_triangle`."""
    loss = dp.power_div(direction_scale.z, dp.power(direction.z))
    return [dp.power_max(start, dp.power_mul(dp.power(dp.mul(t, way)), loss))
            for start, way in ((origin_scale.x, direction.x), (origin_scale.y, direction.y))]


def inside_edges(dp, u, v, errors, *, most=MAX_TOLERANCE):
    """Whether u > −ε_u, v > −ε_v and u + v < 1 + max(ε_u, ε_v), each ε of ``errors`` and at most ``most``."""
    most = dp.const(most)
    inside = [dp.logical_or(dp.logical_not(dp.is_negative(value)),
                            dp.logical_and(dp.is_within(value, error), dp.is_within(value, most)))
              for value, error in zip((u, v), errors, strict=True)]
    total = dp.add(u, v)
    return dp.logical_and(*inside, dp.is_at_most_one_plus(total, dp.power_max(*errors)),
                          dp.is_at_most_one_plus(total, most))
