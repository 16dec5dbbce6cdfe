"""Datapaths of ray tracers that are built otherwise, to be counted beside ours; no chip contains them."""

from fpu import Datapath, Vector

__all__ = ["plucker_test", "projection_test", "ray_shader"]


def _dot(dp, a, b):
    return dp.add(dp.add(dp.mul(a.x, b.x), dp.mul(a.y, b.y)), dp.mul(a.z, b.z))


def _cross(dp, a, b):
    return Vector(dp.sub(dp.mul(a.y, b.z), dp.mul(a.z, b.y)), dp.sub(dp.mul(a.z, b.x), dp.mul(a.x, b.z)),
                  dp.sub(dp.mul(a.x, b.y), dp.mul(a.y, b.x)))


def _each(operation, a, b):
    return Vector(*(operation(p, q) for p, q in zip(a, b, strict=True)))


def _outputs(dp, t, u, v, t_hit, inside):
    ahead = dp.logical_and(dp.is_finite(t), dp.logical_not(dp.sign(t)), dp.logical_not(dp.is_zero(t)))
    for name, value in (("t", t), ("u", u), ("v", v)):
        dp.output(name, value)
    dp.output("hit", dp.logical_and(ahead, inside))
    dp.output("nearer", dp.lt(t, t_hit))
    return dp


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
    return _outputs(dp, t, u, v, dp.input("t_hit"), inside)


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
        moments = [_cross(dp, start, end) for start, end in pairs]
        edges = [_each(dp.sub, end, start) for start, end in pairs]
        normal = _each(dp.add, _each(dp.add, moments[0], moments[1]), moments[2])
        distance = _dot(dp, normal, corners[0])
    moment = _cross(dp, origin, direction)
    sides = [dp.add(_dot(dp, direction, moments[i]), _dot(dp, moment, edges[i])) for i in range(3)]
    scale = dp.div(dp.const(1.0), dp.add(dp.add(sides[1], sides[2]), sides[0]))
    t = dp.mul(dp.sub(distance, _dot(dp, normal, origin)), scale)
    negative = [dp.is_negative(side) for side in sides]
    positive = [dp.logical_not(dp.logical_or(dp.is_negative(side), dp.is_zero(side))) for side in sides]
    inside = dp.logical_not(dp.logical_and(dp.logical_or(*negative), dp.logical_or(*positive)))
    return _outputs(dp, t, dp.mul(sides[1], scale), dp.mul(sides[2], scale), dp.input("t_hit"), inside)


def ray_shader(fmt, *, latencies=None, refraction=False):
    """The rays of paper §2.2.2 that begin or end where a ray hit, without a transformation unit, one a clock: S.

    ::

        shadow        (L, O + tD − L)
        reflection    (O + (t − e)D, D − 2cN)
        transparency  (O + (t + e)D, D)
        refraction    (O + (t + e)D, ηD − (ηc + κ)N),  κ = √(1 − η² + (ηc)²)

    of a unit direction D and a unit normal N against it. Refraction is that of docs/shading.md 7.2; the paper prints it
    for the reversed D. c = N·D is what either test divides by, up to a factor that can be stored with the normal; 2c is
    c with another exponent, so it comes in beside it. No table, colour or texture is computed here.

    Datapath: 7 adders, 6 multipliers; with refraction 9 adders, 11 multipliers, 1 square root.
    """
    dp = Datapath(fmt, latencies=latencies)
    origin, direction, normal, light = (dp.vector(name) for name in ("origin", "direction", "normal", "light"))
    t, epsilon, twice_cosine = dp.input("t"), dp.input("epsilon"), dp.input("twice_cosine")
    is_shadow, is_reflection = dp.flag("is_shadow"), dp.flag("is_reflection")
    zero = dp.const(0.0)
    shift = dp.select(is_shadow, zero, dp.select(is_reflection, dp.neg(epsilon), epsilon))
    way = dp.add(t, shift)
    point = Vector(*(dp.add(o, dp.mul(way, d)) for o, d in zip(origin, direction, strict=True)))
    bend, base = dp.select(is_reflection, twice_cosine, zero), direction
    if refraction:
        is_refraction = dp.flag("is_refraction")
        ior, flatness = dp.input("eta"), dp.input("one_minus_eta2")
        scaled = dp.mul(ior, dp.input("cosine"))
        bend = dp.select(is_refraction, dp.add(scaled, dp.sqrt(dp.add(flatness, dp.mul(scaled, scaled)))), bend)
        base = Vector(*(dp.select(is_refraction, dp.mul(ior, d), d) for d in direction))
    for axis in "xyz":
        whole = dp.select(is_shadow, getattr(point, axis), getattr(base, axis))
        off = dp.select(is_shadow, getattr(light, axis), dp.mul(bend, getattr(normal, axis)))
        dp.output(f"direction_{axis}_out", dp.sub(whole, off))
        dp.output(f"origin_{axis}_out", dp.select(is_shadow, getattr(light, axis), getattr(point, axis)))
    return dp
