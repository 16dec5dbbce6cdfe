"""What is at a hit: colour, opacity, point and normals (docs/shading.md, sections 3 and 4)."""

from ..microcode import Condition, Op, X, Y, Z
from .records import FIRST_MATRIX, MaterialFlag
from .writer import MX, MXY, MY, ONE, ZERO, Reg

__all__ = ["write_flat_normal", "write_look", "write_normal"]


def write_look(w):
    """Of the triangle OWNER at HIT: TRIANGLE, MATERIAL, COLOR, OPACITY."""
    material = Reg.MATERIAL
    w.load(Reg.TRIANGLE, (Reg.OWNER, X), FIRST_MATRIX)
    w.load(material, (Reg.TRIANGLE + 1, Z))
    alpha = w.features.transparency
    if alpha:
        w.move(Reg.OPACITY, w.one, mask=MX)
    if w.features.textures:
        plain = w.fresh("plain")
        w.on_flag(MaterialFlag.TEXTURED, plain, clear=True)
        w.columns(Reg.T0, (Reg.HIT, (Y, Z, ONE)), Reg.TRIANGLE + 1, Reg.TRIANGLE + 2, Reg.TRIANGLE + 3, mask=MXY)
        # The texel takes two registers, of which the second is no longer needed.
        w.emit(Op.TEXTURE, dst=Reg.T0, a=material + 2, x=Reg.T0)
        w.multiply(Reg.COLOR, Reg.COLOR, Reg.T0)
        if alpha:
            w.move(Reg.OPACITY, Reg.T1, mask=MX)
        w.label(plain)
    if alpha:
        solid = w.fresh("solid")
        w.on_flag(MaterialFlag.ALPHA, solid, clear=True)
        w.bytes(Reg.T0, (material + 1, Z))
        w.multiply(Reg.OPACITY, Reg.OPACITY, Reg.T0, mask=MX)
        blend = w.fresh("blend")
        w.on_flag(MaterialFlag.MASK, blend, clear=True)
        hole = w.fresh("cut out")
        w.less((Reg.OPACITY, X), (Reg.T0, Y), hole)
        w.label(solid)
        w.move(Reg.OPACITY, w.one, mask=MX)
        w.goto(blend)
        w.label(hole)
        w.move(Reg.OPACITY, (Reg.OPACITY, ZERO), mask=MX)
        w.label(blend)


def _to_world(w, outside):
    """NORMAL by A⁻ᵀ of the instance; goes on at ``outside`` if it is in none."""
    if w.features.instances:
        w.branch(Condition.MISS, (Reg.OWNER, Y), outside)
        w.load(Reg.LIGHT, (Reg.OWNER, Y), FIRST_MATRIX)
        w.columns(Reg.NORMAL, Reg.NORMAL, Reg.LIGHT, Reg.LIGHT + 1, Reg.LIGHT + 2)


def _unit(w):
    """NORMAL by its length."""
    w.rows(Reg.U0, Reg.NORMAL, Reg.NORMAL, mask=MX)
    w.root(Reg.U0, (Reg.U0, X), mask=MX)
    w.scaled(Reg.NORMAL, (Reg.U0, X), Reg.NORMAL)


def _towards_viewer(w, side):
    """NORMAL by the side that is seen, and COSINE where it matters."""
    front = w.fresh("front")
    w.branch(Condition.NEGATIVE, side, front)
    w.move(Reg.NORMAL, (Reg.NORMAL, ("-", X, "-", Y, "-", Z)))
    w.label(front)
    if w.features.shares or w.features.highlights:
        w.rows(Reg.COSINE, Reg.NORMAL, Reg.DIRECTION, Reg.DIRECTION, Reg.DIRECTION)


def _write_triangles_normal(w, known, *, seen_along):
    """NORMAL of the flat triangle, ``known`` from there on, by the side that is seen."""
    w.move(Reg.NORMAL, Reg.TRIANGLE)
    if w.features.instances:
        _to_world(w, known)
        _unit(w)
    w.label(known)
    _towards_viewer(w, seen_along)


def write_normal(w):
    """Of the hit: NORMAL, COSINE, POINT; D′z in HIT."""
    known = w.fresh("unit normal")
    if w.features.smooth:
        flat, mixed = w.fresh("flat"), w.fresh("mixed")
        w.branch(Condition.NONE, (Reg.TRIANGLE + 3, Z), flat)
        w.load(Reg.LIGHT, (Reg.TRIANGLE + 3, Z))
        w.columns(Reg.NORMAL, (Reg.HIT, (Y, Z, ONE)), Reg.LIGHT, Reg.LIGHT + 1, Reg.LIGHT + 2)
        _to_world(w, mixed)
        w.label(mixed)
        _unit(w)
        w.goto(known)
        w.label(flat)
    _write_triangles_normal(w, known, seen_along=(Reg.OWNER, Z))
    w.columns(Reg.POINT, (Reg.HIT, (ONE, X, ZERO)), Reg.ORIGIN, Reg.DIRECTION)
    if w.features.shares:
        w.move(Reg.HIT, (Reg.OWNER, Z), mask=MY)


def write_flat_normal(w):
    """NORMAL and COSINE for secondary rays: the flat ones where the interpolated one looks away."""
    if not w.features.smooth:
        return
    steady = w.fresh("steady")
    w.branch(Condition.NEGATIVE, (Reg.COSINE, X), steady)
    _write_triangles_normal(w, w.fresh("unit normal"), seen_along=(Reg.HIT, Y))
    w.label(steady)
