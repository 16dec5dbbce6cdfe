"""The light that reaches a point, light by light (docs/shading.md, section 5)."""

from ..microcode import NO_TRIANGLE, Condition, Op, Store, X, Y, Z
from .layers import write_layers
from .records import MAX_CONE_SQUARINGS, FadeFlag, LightFlag, MaterialFlag
from .writer import MX, MY, MYZ, MZ, ONE, ZERO, Reg

__all__ = ["write_lights"]

ANY_HIT, HAS_LIMIT, SAME_ORIGIN = 1, 2, 4
_MAX_SQUARINGS = 10


def write_lights(w):
    """DIFFUSE, FILTERED (with ambient light), SPECULAR of the hit."""
    f, light = w.features, Reg.LIGHT
    w.load(Reg.FILTERED, (Reg.FILTERED, ZERO))
    w.move(Reg.OWNER, (Reg.RANGE, X), mask=MZ)
    if f.highlights:
        dull = w.fresh("dull")
        w.on_flag(MaterialFlag.GLOSSY, dull, clear=True)
        w.columns(Reg.MIRRORED, (Reg.COSINE, (ONE, "-", X, "-", X)), Reg.DIRECTION, Reg.NORMAL, Reg.NORMAL)
        w.scaled(Reg.MIRRORED, (Reg.LENGTH, Y), Reg.MIRRORED)
        w.label(dull)
    w.label("light")
    w.load(light, (Reg.OWNER, Z))
    if f.directional_lights:
        if f.near_lights:
            w.on_bit((light + 3, X), LightFlag.DIRECTIONAL, "near", clear=True)
        _directional(w)
        if f.near_lights:
            w.goto("light.traced")
            w.label("near")
    if f.near_lights:
        _near(w)
    w.label("light.traced")
    if f.shadows:
        _shadowed(w)
    w.columns(Reg.DIFFUSE, (light + 2, (Z, ONE, ZERO)), light + 1, Reg.DIFFUSE)
    if f.highlights:
        w.label("light.shines")
        _highlight(w)
    w.label("light.next")
    w.add(Reg.OWNER, Reg.OWNER, w.literal(1), mask=MZ)
    w.less((Reg.OWNER, Z), (Reg.RANGE, Y), "light")
    if f.shadows and f.clear:
        w.goto("unlit")
        _through(w)


def _near(w):
    """A point or spot light: TRAVEL; strength of diffuse light in the last lane of LIGHT + 2, −strength in LIMITS."""
    f, light = w.features, Reg.LIGHT
    next_one = "light.next"
    w.columns(Reg.TRAVEL, (Reg.TRAVEL, ("-", ONE, ONE, ZERO)), light, Reg.POINT, store=Store.DIRECTION)
    # |S|², N·S, and in a spot light scale · axis·S.
    w.rows(Reg.T0, Reg.TRAVEL, Reg.TRAVEL, Reg.NORMAL, light + 2)
    w.branch(Condition.NOT_NEGATIVE, (Reg.T0, Y), next_one)
    point = w.fresh("point")
    if f.spot_lights:
        if f.point_lights:
            w.on_bit((light + 3, X), LightFlag.SPOT, point, clear=True)
        w.root(Reg.T1, (Reg.T0, X), mask=MX)
        # The cone's factor, in the last lane of T2.
        w.columns(Reg.T2, (Reg.T1, (X, ONE, ZERO)), Reg.T0, light + 3, mask=MZ)
        w.branch(Condition.NEGATIVE, (Reg.T2, Z), next_one)
        within = w.fresh("within")
        w.on_bit((light + 3, Y), FadeFlag.CLAMPED, within, clear=True)
        w.columns(Reg.T0, (Reg.T0, ("-", ONE, ONE, ZERO)), Reg.T2, w.literal(1.0), mask=MZ)
        w.branch(Condition.NOT_NEGATIVE, (Reg.T0, Z), within)
        w.move(Reg.T2, (Reg.T2, ONE), mask=MZ)
        w.label(within)
        squared = w.fresh("squared")
        for k in range(MAX_CONE_SQUARINGS):
            w.on_bit((light + 3, Y), FadeFlag.SQUARINGS + k, squared, clear=True)
            w.scaled(Reg.T2, (Reg.T2, Z), Reg.T2, mask=MZ)
        w.label(squared)
        w.move(light + 3, (Reg.T1, X), mask=MZ)
        if f.point_lights:
            w.goto(point + " too")
    if f.point_lights:
        w.label(point)
        w.root(light + 3, (Reg.T0, X), mask=MZ)
        if f.spot_lights:
            w.move(Reg.T2, (Reg.T2, ONE), mask=MZ)
            w.label(point + " too")
    # |S|²/radius², |S|²/reach², N·S/|S|.
    w.diagonal(Reg.T0, (Reg.T0, (X, X, Y)), light + 3)
    w.cut(Reg.T1, (Reg.T0, X), mask=MX)
    nearest = w.fresh("in the light")
    if f.shadows:
        w.emit(Op.OFFSET, dst=light + 3, a=light, x=Reg.POINT, mask=MY)
    # t_far = 1 − ε/|S|, and −1/|S|².
    w.columns(Reg.LIMITS, (light + 3, ("-", Z, ONE, ZERO)), light + 3, w.literal(0.0, 1.0, 0.0), mask=MYZ)
    w.less((Reg.T1, X), (w.one, X), nearest + " not", negated=True)
    w.move(Reg.LIMITS, (light + 3, ("-", X)), mask=MZ)
    w.label(nearest + " not")
    if f.fading_lights:
        steady = w.fresh("steady")
        w.on_bit((light + 3, X), LightFlag.FADES, steady, clear=True)
        w.columns(Reg.T1, (Reg.T0, ("-", Y, ONE, ZERO)), Reg.T0, w.literal(0.0, 1.0, 0.0), mask=MY)
        w.branch(Condition.NEGATIVE, (Reg.T1, Y), next_one)
        w.scaled(Reg.LIMITS, (Reg.T1, Y), Reg.LIMITS, mask=MZ)
        w.label(steady)
    if f.spot_lights:
        w.scaled(Reg.LIMITS, (Reg.T2, Z), Reg.LIMITS, mask=MZ)
    w.scaled(light + 2, (Reg.T0, Z), Reg.LIMITS, mask=MZ)
    if f.shadows:
        w.columns(light, (light, (ONE, ZERO, ZERO)), light, store=Store.ORIGIN, mask=0)
        w.label("shadow.near")
        w.trace(Reg.LIMITS, Reg.OWNER, ANY_HIT | HAS_LIMIT | SAME_ORIGIN)


def _directional(w):
    """A directional light: as :func:`_near`."""
    f, light = w.features, Reg.LIGHT
    w.rows(Reg.T0, light, None, Reg.NORMAL, mask=MY)
    w.branch(Condition.NOT_NEGATIVE, (Reg.T0, Y), "light.next")
    w.move(light + 2, (Reg.T0, ("-", Y)), mask=MZ)
    w.move(Reg.LIMITS, (Reg.LIMITS, ("-", ONE)), mask=MZ)
    if f.highlights:
        w.move(Reg.TRAVEL, light)
        w.move(light + 3, (light, ONE), mask=MZ)
    if f.shadows:
        w.emit(Op.OFFSET, dst=Reg.T1, a=Reg.ORIGIN, x=Reg.POINT)
        w.columns(Reg.T1, (Reg.T1, (ONE, X, ZERO)), Reg.POINT, Reg.NORMAL, store=Store.ORIGIN, mask=0)
        w.columns(Reg.T1, (light, ("-", ONE, ZERO, ZERO)), light, store=Store.DIRECTION, mask=0)
        if f.clear:
            w.move(Reg.LIMITS, (w.literal(float("inf")), X), mask=MY)
        w.label("shadow.directional")
        w.trace(Reg.LIMITS, Reg.OWNER, ANY_HIT)


def _shadowed(w):
    """Goes on at the next light, or with what glass leaves, if something was hit."""
    w.hit(Reg.T0, 1, mask=MX)
    w.less((Reg.T0, X), (w.literal(NO_TRIANGLE), X), "shadow" if w.features.clear else "light.next")
    if w.features.clear and w.features.highlights:
        w.move(Reg.VISIBLE, w.one)


def _through(w):
    """What glass leaves of a light, to FILTERED."""
    w.label("shadow")
    w.hit(Reg.T0, 0, mask=MX)
    w.branch(Condition.ZERO, (Reg.T0, X), "light.next")
    write_layers(w)
    w.scaled(Reg.T0, (Reg.LIGHT + 2, Z), Reg.LIGHT + 1)
    w.cut(Reg.T0, Reg.T0)
    w.multiply(Reg.T0, Reg.T0, Reg.VISIBLE)
    w.add(Reg.FILTERED, Reg.FILTERED, Reg.T0)
    w.goto("light.shines" if w.features.highlights else "light.next")


def _highlight(w):
    """Adds the light's highlight to SPECULAR."""
    f, light = w.features, Reg.LIGHT
    w.on_flag(MaterialFlag.GLOSSY, "light.next", clear=True)
    w.rows(Reg.T0, Reg.TRAVEL, Reg.MIRRORED, mask=MX)
    w.branch(Condition.NOT_NEGATIVE, (Reg.T0, X), "light.next")
    w.scaled(Reg.T0, (light + 3, "-", Z), Reg.T0, mask=MX)
    w.cut(Reg.T0, (Reg.T0, X), mask=MX)
    # Rounding may have made more than 1 of it, which a factor must not be.
    w.less((Reg.T0, X), (w.one, X), "light.glint")
    w.move(Reg.T0, w.one, mask=MX)
    w.label("light.glint")
    shining = w.fresh("shining")
    for k in range(_MAX_SQUARINGS):
        w.on_flag(MaterialFlag.SQUARINGS + k, shining, clear=True)
        w.multiply(Reg.T0, Reg.T0, Reg.T0, mask=MX)
    w.label(shining)
    w.branch(Condition.NONE, (Reg.T0, X), "light.next")
    w.scaled(Reg.T1, (Reg.LIMITS, "-", Z), light + 1)
    w.cut(Reg.T1, Reg.T1)
    w.multiply(Reg.T1, Reg.T1, (Reg.T0, X))
    if f.clear and f.shadows:
        w.multiply(Reg.T1, Reg.T1, Reg.VISIBLE)
    w.add(Reg.SPECULAR, Reg.SPECULAR, Reg.T1)
