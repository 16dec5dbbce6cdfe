"""What rays see that meet nothing (docs/shading.md, section 9)."""

from ..microcode import Condition, Op, X, Y, Z
from .records import BEYOND
from .writer import MX, MXY, MY, ONE, ZERO, Reg

__all__ = ["write_sky"]


def write_sky(w):
    """Adds the sky's, or the background's, colour to SUM."""
    w.load(Reg.LIGHT, (Reg.SUM, ZERO), BEYOND)
    color, texture = Reg.LIGHT, Reg.LIGHT + 1
    if w.features.sky:
        w.branch(Condition.NONE, (texture, Y), "background")
        _octahedron(w)
        w.emit(Op.TEXTURE, dst=Reg.T0, a=texture, x=Reg.T2)
        w.move(color, Reg.T0)
        w.label("background")
    if w.features.children:
        w.multiply(color, color, Reg.WEIGHT)
    w.add(Reg.SUM, Reg.SUM, color)


def _octahedron(w):
    """T2: coordinates of DIRECTION on the octahedron."""
    half, one = w.literal(0.5), w.literal(1.0)
    upright = Reg.T0
    w.move(upright, Reg.DIRECTION)
    for lane, mask in ((X, 1), (Y, 2), (Z, 4)):
        positive = w.fresh("positive")
        w.branch(Condition.NOT_NEGATIVE, (upright, lane), positive)
        w.move(upright, (upright, ("-", lane)), mask=mask)
        w.label(positive)
    # 1/2m as the root of 1/(2m)².
    w.rows(Reg.T1, upright, w.literal(2.0), mask=MX)
    w.scaled(Reg.T1, (Reg.T1, X), Reg.T1, mask=MX)
    w.root(Reg.T1, (Reg.T1, X), mask=MX)
    w.branch(Condition.NEGATIVE, (Reg.DIRECTION, Z), "below")
    # (p + 1)/2, (q + 1)/2.
    w.columns(Reg.T2, (Reg.T1, (X, ONE, ZERO)), Reg.DIRECTION, half, mask=MXY)
    w.goto("octahedron")
    w.label("below")
    # Where p ≥ 0: (2 − |q|)/2, else |q|/2.
    w.scaled(Reg.T0, (Reg.T1, X), upright, mask=MXY)
    w.columns(Reg.T1, (Reg.T1, ("-", ONE, ONE, ZERO)), Reg.T0, one, mask=MXY)
    w.move(Reg.T2, (Reg.T1, (Y, X, ZERO)))
    for lane, other, mask in ((X, Y, MX), (Y, X, MY)):
        right = w.fresh("right")
        w.branch(Condition.NOT_NEGATIVE, (Reg.DIRECTION, lane), right)
        w.move(Reg.T2, (Reg.T0, other), mask=mask)
        w.label(right)
    w.label("octahedron")
