"""How the light is shared, and the rays that follow (docs/shading.md, sections 6 and 7)."""

from ..microcode import Condition, Op, Store, X, Y, Z
from .layers import MAX_LAYERS
from .records import MaterialFlag
from .surface import write_flat_normal
from .writer import MX, MY, MYZ, MZ, ONE, ZERO, Reg

__all__ = ["write_children", "write_next", "write_strengths"]


def write_strengths(w):
    """STRENGTH and LOCAL of the surface, BEND of what goes through; only of surfaces that share their light."""
    f = w.features
    total = Reg.U0, Z
    write_flat_normal(w)
    w.move(Reg.U0, (Reg.COSINE, ("-", X, ZERO, ZERO)))
    if f.refraction:
        straight, bent = w.fresh("straight"), w.fresh("bent")
        w.move(Reg.BEND, (Reg.BEND, (ONE, ZERO, ZERO)))
        w.on_flag(MaterialFlag.BENDS, straight, clear=True)
        front = w.fresh("front")
        w.move(Reg.BEND, (Reg.MATERIAL + 3, X), mask=MX)
        w.branch(Condition.NEGATIVE, (Reg.HIT, Y), front)
        w.move(Reg.BEND, (Reg.MATERIAL + 3, Y), mask=MX)
        w.label(front)
        # (c, c, d² − c²), (η, ηc, η(d² − c²)), κ².
        w.columns(Reg.COSINE, (Reg.COSINE, ("-", X, ONE, ZERO)), Reg.COSINE, Reg.LENGTH, mask=MZ)
        w.scaled(Reg.BEND, (Reg.BEND, X), Reg.COSINE, mask=MYZ)
        w.columns(Reg.BEND, (Reg.BEND, ("-", X, ONE, ZERO)), Reg.BEND, Reg.LENGTH, mask=MZ)
        w.branch(Condition.NOT_NEGATIVE, (Reg.BEND, Z), bent)
        # Total reflection: cos = 0, and nothing goes through.
        w.move(Reg.U0, (w.one, (ZERO, ZERO, X)))
        w.goto(straight)
        w.label(bent)
        w.root(Reg.U1, (Reg.BEND, Z), mask=MX)
        w.scaled(Reg.BEND, (Reg.U1, X), Reg.BEND, mask=MZ)
        if f.fresnel:
            # Into the thinner medium cos is that of the refracted ray; positive floats compare as integers.
            unit = w.literal(1.0)
            w.less((unit, X), (Reg.BEND, X), straight, negated=True)
            w.move(Reg.U0, (Reg.BEND, Z), mask=MX)
        w.label(straight)
    w.bytes(Reg.STRENGTH, (Reg.MATERIAL + 3, Z))
    w.subtract(Reg.LOCAL, w.one, (Reg.STRENGTH, X))
    if f.fresnel:
        even = w.fresh("even")
        w.on_flag(MaterialFlag.FRESNEL, even, clear=True)
        w.scaled(Reg.U0, (Reg.U0, X), Reg.LENGTH, mask=MY)
        w.cut(Reg.U1, (Reg.U0, Y), mask=MX)
        w.subtract(Reg.U1, w.one, Reg.U1, mask=MX)
        w.multiply(Reg.U2, Reg.U1, Reg.U1, mask=MX)
        w.multiply(Reg.U2, Reg.U2, Reg.U2, mask=MX)
        w.multiply(Reg.U2, Reg.U2, Reg.U1, mask=MX)
        w.multiply(Reg.U2, Reg.U2, Reg.LOCAL, mask=MX)
        w.add(Reg.STRENGTH, Reg.STRENGTH, Reg.U2, mask=MX)
        w.subtract(Reg.LOCAL, w.one, (Reg.STRENGTH, X))
        w.label(even)
    if f.refraction:
        w.multiply(Reg.STRENGTH, Reg.STRENGTH, Reg.LOCAL, mask=MY)
        w.subtract(Reg.LOCAL, Reg.LOCAL, (Reg.STRENGTH, Y))
        passing = w.fresh("passing")
        w.branch(Condition.NONE, total, passing)
        w.add(Reg.STRENGTH, Reg.STRENGTH, (Reg.STRENGTH, Y), mask=MX)
        w.move(Reg.STRENGTH, (Reg.STRENGTH, ZERO), mask=MY)
        w.label(passing)


def _child(w, kind, direction, origin, keeps):
    """Starts a ray of weight U2, or puts it on the stack if ``keeps`` says that others come first.

    ``direction`` and ``origin`` write instructions, given register and store.
    """
    if keeps is not None:
        first = w.fresh("first")
        w.on_flag(keeps, first, clear=True)
        w.label(f"{kind}.waits")
        origin(Reg.TRAVEL, Store.NOWHERE)
        w.push(Reg.TRAVEL)
        direction(Reg.TRAVEL, Store.NOWHERE)
        w.push(Reg.TRAVEL, Reg.U2)
        w.move(Reg.OWNER, (Reg.STATE, X), mask=MZ)
        w.push(Reg.OWNER)
        w.goto(f"{kind} not")
        w.label(first)
    w.label(f"{kind}.starts")
    w.move(Reg.WEIGHT, Reg.U2)
    direction(Reg.DIRECTION, Store.DIRECTION)
    origin(Reg.ORIGIN, Store.ORIGIN)
    w.goto("start")
    w.label(f"{kind} not")


def write_children(w):
    """The rays that follow the hit; what is not started goes on with :func:`write_next`'s."""
    f = w.features
    w.branch(Condition.NONE, (Reg.STATE, X), "next")
    w.on_flag(MaterialFlag.PARENT, "next", clear=True)
    w.subtract(Reg.STATE, Reg.STATE, w.literal(1), mask=MX)
    whole = Reg.WEIGHT
    if f.transparency and f.shares:
        whole = Reg.U1
        w.multiply(whole, Reg.WEIGHT, (Reg.OPACITY, X))
    if f.shares:
        if f.transparency:
            w.on_flag(MaterialFlag.SHARES, "refraction not" if f.refraction else "reflection not", clear=True)
        w.emit(Op.OFFSET, dst=Reg.U0, a=Reg.ORIGIN, x=Reg.POINT)
        w.branch(Condition.NONE, (Reg.STRENGTH, X), "reflection not")
        w.multiply(Reg.U2, whole, (Reg.STRENGTH, X))
        plain = w.fresh("plain")
        w.on_flag(MaterialFlag.TINTED, plain, clear=True)
        w.multiply(Reg.U2, Reg.U2, Reg.COLOR)
        w.label(plain)
        w.unless_worth_it(Reg.U2, "reflection not")
        _child(w, "reflection",
               lambda dst, store: w.columns(dst, (Reg.COSINE, (ONE, "-", X, "-", X)), Reg.DIRECTION, Reg.NORMAL,
                                            Reg.NORMAL, store=store),
               lambda dst, store: w.columns(dst, (Reg.U0, (ONE, X, ZERO)), Reg.POINT, Reg.NORMAL, store=store),
               MaterialFlag.FORKS if f.refraction or f.transparency else None)
    if f.refraction:
        w.on_flag(MaterialFlag.CLEAR, "refraction not", clear=True)
        w.branch(Condition.NONE, (Reg.STRENGTH, Y), "refraction not")
        w.multiply(Reg.U2, whole, (Reg.STRENGTH, Y))
        w.multiply(Reg.U2, Reg.U2, Reg.COLOR)
        w.unless_worth_it(Reg.U2, "refraction not")
        _child(w, "refraction",
               lambda dst, store: w.columns(dst, (Reg.BEND, (X, "-", Y, "-", Z)), Reg.DIRECTION, Reg.NORMAL,
                                            Reg.NORMAL, store=store),
               lambda dst, store: w.columns(dst, (Reg.U0, (ONE, "-", X, ZERO)), Reg.POINT, Reg.NORMAL, store=store),
               MaterialFlag.BLEND if f.transparency else None)
    if f.transparency:
        w.on_flag(MaterialFlag.BLEND, "next", clear=True)
        w.subtract(Reg.T0, w.one, (Reg.OPACITY, X))
        w.multiply(Reg.U2, Reg.WEIGHT, Reg.T0)
        w.unless_worth_it(Reg.U2, "next")
        w.label("transparency.starts")
        w.move(Reg.WEIGHT, Reg.U2)
        w.move(Reg.STATE, w.literal(MAX_LAYERS), mask=MY)
        w.move(Reg.LENGTH, (Reg.HIT, X), mask=MX)
        w.stored(Reg.DIRECTION, Store.DIRECTION)
        w.stored(Reg.ORIGIN, Store.ORIGIN)
        w.goto("trace")


def write_next(w):
    """The next ray of the stack, or the end."""
    f = w.features
    w.label("next")
    if f.children and f.shares:
        if f.refraction or f.transparency:
            w.branch(Condition.EMPTY, Reg.SUM, "done")
            w.pop(Reg.ORIGIN, Reg.DIRECTION, Reg.WEIGHT, Reg.OWNER)
            w.move(Reg.STATE, (Reg.OWNER, Z), mask=MX)
            w.stored(Reg.DIRECTION, Store.DIRECTION)
            w.stored(Reg.ORIGIN, Store.ORIGIN)
            w.goto("start")
        w.label("done")
    w.emit(Op.EMIT, x=Reg.SUM)
    if f.children and f.shares:
        w.label("start")
        if f.transparency:
            w.move(Reg.STATE, w.literal(MAX_LAYERS), mask=MY)
        w.move(Reg.LENGTH, (Reg.LENGTH, ZERO), mask=MX)
    if f.transparency or f.children:
        w.label("trace")
        w.trace(Reg.LENGTH, Reg.OWNER)
        w.goto("hit")
