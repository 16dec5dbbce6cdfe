"""Light through glass and veils, one after the other (docs/shading.md, 5.7)."""

from ..microcode import Condition, Op, X, Y, Z
from .writer import MX, MXY, MY, ZERO, Reg

__all__ = ["MAX_LAYERS", "SAVED", "write_layers"]

#: Layers, and holes, that a ray passes.
MAX_LAYERS = 64

_ANY_HIT, _HAS_LIMIT = 1, 2

#: Registers that lie on the stack meanwhile.
SAVED = (Reg.HIT, Reg.TRIANGLE, *range(Reg.MATERIAL, Reg.MATERIAL + 4), Reg.OPACITY)


def write_layers(w):
    """VISIBLE: what the layers from the present hit on leave of a light; goes on at the next light if it is nothing."""
    left = Reg.LIGHT + 3
    # What the light falls on, which it does not meet. Strictly onwards from a layer, that is not met again either.
    lit = Reg.LIGHT
    w.move(lit, Reg.OWNER)
    w.push(*SAVED)
    w.move(Reg.VISIBLE, w.one)
    w.move(left, w.literal(MAX_LAYERS), mask=MX)
    w.label("layer")
    w.hit(Reg.HIT, 0)
    w.hit(Reg.OWNER, 1, mask=MXY)
    w.emit(Op.CALL, dst=Reg.OPACITY, mask=4, target="look")
    if w.features.refraction:
        # Of r₀ and q: q·(1 − r₀)·o, then with the colour.
        w.bytes(Reg.T0, (Reg.MATERIAL + 3, Z))
        w.subtract(Reg.T1, w.one, Reg.T0, mask=MX)
        w.multiply(Reg.T0, Reg.T0, (Reg.T1, X), mask=MY)
        if w.features.transparency:
            w.multiply(Reg.T0, Reg.T0, (Reg.OPACITY, X), mask=MY)
        w.multiply(Reg.T1, Reg.COLOR, (Reg.T0, Y))
    else:
        w.move(Reg.T1, (Reg.T1, ZERO))
    if w.features.transparency:
        w.subtract(Reg.T0, w.one, (Reg.OPACITY, X))
        w.add(Reg.T1, Reg.T1, Reg.T0)
    w.multiply(Reg.VISIBLE, Reg.VISIBLE, Reg.T1)
    some = w.fresh("some")
    w.branch(Condition.SOME, (Reg.VISIBLE, X), some)
    w.branch(Condition.SOME, (Reg.VISIBLE, Y), some)
    w.branch(Condition.NONE, (Reg.VISIBLE, Z), "layer.dark")
    w.label(some)
    w.branch(Condition.NONE, (left, X), "layer.dark")
    w.subtract(left, left, w.literal(1), mask=MX)
    w.move(Reg.LIMITS, (Reg.HIT, X), mask=MX)
    w.label("shadow.layer")
    w.trace(Reg.LIMITS, lit, _ANY_HIT | _HAS_LIMIT)
    w.hit(Reg.T0, 1, mask=MX)
    w.branch(Condition.MISS, (Reg.T0, X), "layer.passed")
    w.hit(Reg.T0, 0, mask=MX)
    w.branch(Condition.NOT_ZERO, (Reg.T0, X), "layer")
    w.label("layer.dark")
    w.pop(*SAVED)
    w.move(Reg.OWNER, lit)
    w.move(Reg.LIMITS, (Reg.LIMITS, ZERO), mask=MX)
    w.goto("light.next")
    w.label("layer.passed")
    w.pop(*SAVED)
    w.move(Reg.OWNER, lit)
    w.move(Reg.LIMITS, (Reg.LIMITS, ZERO), mask=MX)
