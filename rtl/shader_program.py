"""The program of full shading: the rules of docs/shading.md as instructions of :mod:`rtl.microcode`."""

from .microcode import Condition, Op, Store, X, Y, Z, constant_numbers
from .program.children import write_children, write_next, write_strengths
from .program.features import ShaderFeatures
from .program.layers import MAX_LAYERS, SAVED
from .program.lights import write_lights
from .program.records import MaterialFlag
from .program.sky import write_sky
from .program.surface import write_look, write_normal
from .program.writer import MX, MY, MZ, ONE, ZERO, Reg, Writer

__all__ = ["RAY_KINDS", "ShaderFeatures", "ray_kind", "shader_program", "stack_words"]

_SAME_ORIGIN = 4
_NO_OWNER = (1 << 24) - 1, (1 << 24) - 1, 0

#: What rays are counted by.
RAY_KINDS = ("primary", "shadow", "reflection", "refraction", "transparency", "hole")


def ray_kind(label):
    """Which of :data:`RAY_KINDS` a label of the program counts, or None."""
    kind = label.split(".")[0]
    return RAY_KINDS.index(kind) if kind in RAY_KINDS and ("." in label or kind == "primary") else None


def stack_words(features):
    """Registers that a ray's stack must hold: four a pending ray, and what is put aside in a shadow of glass."""
    pending = 2 * features.depth if features.children else 0
    return 4 * pending + (len(SAVED) if features.shadows and features.clear else 0)


def shader_program(*, features):
    """The program.

    Parameters
    ----------
    features : ShaderFeatures
        What it is able to do.

    Returns
    -------
    Program
        Its labels ``KIND.…`` of :data:`RAY_KINDS` are where such a ray is counted.
    """
    w = Writer(features)
    _write_primary(w)
    w.label("hit")
    w.hit(Reg.OWNER, 1)
    w.branch(Condition.MISS, (Reg.OWNER, X), "sky")
    w.hit(Reg.HIT, 0)
    is_called = features.shadows and features.clear
    if is_called:
        w.emit(Op.CALL, dst=Reg.OPACITY, mask=MZ, target="look")
    else:
        write_look(w)
    if features.transparency:
        w.branch(Condition.NONE, (Reg.OPACITY, X), "hole")
    write_normal(w)
    w.on_flag(MaterialFlag.LIT, "dark", clear=True)
    write_lights(w)
    w.label("unlit")
    if features.shares:
        w.on_flag(MaterialFlag.SHARES, "local", clear=True)
        write_strengths(w)
        w.label("local")
    _write_local(w)
    if features.children:
        write_children(w)
    if not (features.children and features.transparency):
        w.goto("next")
    w.label("dark")
    w.move(Reg.FILTERED, (Reg.FILTERED, ZERO))
    w.move(Reg.DIFFUSE, (Reg.FILTERED, ZERO))
    w.goto("unlit")
    if features.transparency:
        w.label("hole")
        w.branch(Condition.NONE, (Reg.STATE, Y), "next")
        w.label("hole.passed")
        w.subtract(Reg.STATE, Reg.STATE, w.literal(1), mask=MY)
        w.move(Reg.LENGTH, (Reg.HIT, X), mask=MX)
        w.goto("trace")
    w.label("sky")
    write_sky(w)
    write_next(w)
    if is_called:
        w.label("look")
        write_look(w)
        w.emit(Op.RETURN, x=(Reg.OPACITY, Z))
    return w.assembled()


def _write_primary(w):
    """The camera's ray."""
    f, camera = w.features, constant_numbers["camera"]
    w.rows(Reg.DIRECTION, Reg.LIMITS, *camera, store=Store.DIRECTION)
    w.columns(Reg.ORIGIN, (Reg.LIMITS, (ONE, ZERO, ZERO)), constant_numbers["eye"], store=Store.ORIGIN)
    if f.shares or f.highlights:
        w.rows(Reg.LENGTH, Reg.DIRECTION, None, None, Reg.DIRECTION, mask=MZ)
        w.root(Reg.LENGTH, (Reg.LENGTH, Z), mask=MY)
    w.move(Reg.SUM, (Reg.LIMITS, ZERO))
    if f.shadows:
        w.move(Reg.LIMITS, (Reg.LIMITS, ZERO), mask=MX)
    if f.children:
        w.move(Reg.WEIGHT, w.one)
    if f.children or f.transparency:
        w.move(Reg.STATE, w.literal(f.depth, MAX_LAYERS, 0))
    w.label("primary")
    w.trace(constant_numbers["zero"], w.literal(*_NO_OWNER), _SAME_ORIGIN)


def _write_local(w):
    """What the surface sends itself, times the weight, to SUM."""
    f, light = w.features, Reg.U1
    w.cut(light, Reg.DIFFUSE)
    w.add(light, light, Reg.FILTERED)
    w.multiply(light, light, Reg.COLOR)
    if f.shares:
        whole = w.fresh("whole")
        w.on_flag(MaterialFlag.SHARES, whole, clear=True)
        w.multiply(light, light, Reg.LOCAL)
        w.label(whole)
    if f.highlights:
        w.on_flag(MaterialFlag.GLOSSY, "dull", clear=True)
        w.bytes(Reg.U2, (Reg.MATERIAL + 3, Z))
        w.multiply(Reg.U2, Reg.SPECULAR, (Reg.U2, Z))
        plain = w.fresh("plain")
        w.on_flag(MaterialFlag.TINTED, plain, clear=True)
        w.multiply(Reg.U2, Reg.U2, Reg.COLOR)
        w.label(plain)
        w.add(light, light, Reg.U2)
        w.label("dull")
    if f.emission:
        w.on_flag(MaterialFlag.SHINES, "faint", clear=True)
        w.decode(Reg.U2, (Reg.MATERIAL + 2, Z))
        w.add(light, light, Reg.U2)
        w.label("faint")
    if f.transparency:
        whole = w.fresh("whole")
        w.on_flag(MaterialFlag.BLEND, whole, clear=True)
        w.multiply(light, light, (Reg.OPACITY, X))
        w.label(whole)
    if f.children:
        w.multiply(light, light, Reg.WEIGHT)
    w.add(Reg.SUM, Reg.SUM, light)
