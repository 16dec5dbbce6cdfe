"""Shading without a transformation unit, to be counted beside ours; no chip contains it."""

from fpu import Datapath, Vector

__all__ = ["ray_shader"]


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
