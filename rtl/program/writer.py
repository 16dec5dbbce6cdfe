"""Short names for what shader programs do."""

from amaranth.lib import enum

from ..microcode import Assembler, Condition, Lane, Mode, Op, Store, X, Y, Z
from ..srgb import COLOR_ONE

__all__ = ["MX", "MXY", "MY", "MYZ", "MZ", "ONE", "ZERO", "Reg", "Writer"]

ONE, ZERO = Lane.ONE, Lane.ZERO
#: Masks of lanes.
MX, MY, MZ, MXY, MYZ = 1, 2, 4, 3, 6

#: Smallest weight of a ray that is started: 2⁻¹².
_MIN_WEIGHT = COLOR_ONE >> 12


class Reg(enum.IntEnum):
    """The registers of a ray. Those of numbers 9 to 12, 27 to 30 and others are used anew where they are free."""

    #: t_near, 0, and t_far of shadow rays, −strength of the light; screen coordinates at first.
    LIMITS = 0
    #: Colours added so far.
    SUM = 1
    #: The ray's weight.
    WEIGHT = 2
    ORIGIN = 3
    DIRECTION = 4
    #: Triangle, instance, D′z or number of the light.
    OWNER = 5
    #: Generations that may follow, holes that may follow, –.
    STATE = 6
    #: t_near, 1/d, d².
    LENGTH = 7
    #: t, u, v; later t, D′z.
    HIT = 8
    #: Four of them: flat normal, then texture coordinates; the last three are free later.
    TRIANGLE = 9
    #: Four of them.
    MATERIAL = 13
    #: R/d.
    MIRRORED = 17
    #: Opacity, –, where to return.
    OPACITY = 18
    #: N, unit, towards the viewer.
    NORMAL = 19
    #: c = D·N in all lanes; later d² − c² in the last.
    COSINE = 20
    #: P.
    POINT = 21
    #: Ambient light, and that through glass; this and the next three are a record.
    FILTERED = 22
    #: Light by floats.
    DIFFUSE = 23
    #: Highlights.
    SPECULAR = 24
    #: First light, end of the lights, –.
    RANGE = 25
    #: What glass leaves of a light.
    VISIBLE = 26
    #: Four of them; records of all kinds.
    LIGHT = 27
    #: S.
    TRAVEL = 31

    # Other names of the same registers.
    #: Colour of the surface.
    COLOR = 13
    #: What lies free while lights are looked at.
    T0 = 10
    T1 = 11
    T2 = 12
    #: Strengths: reflection, refraction, highlights.
    STRENGTH = 10
    #: Light that stays, in all lanes.
    LOCAL = 11
    #: η, ηc, κ.
    BEND = 27
    U0 = 28
    U1 = 29
    U2 = 30


class Writer(Assembler):
    """An assembler with a method for each kind of instruction; ``x`` may be (register, lanes)."""

    def __init__(self, features):
        super().__init__()
        self.features = features
        self.one = self.literal(COLOR_ONE)
        self._number = 0

    def fresh(self, name):
        """A label that nobody else has."""
        self._number += 1
        return f"{name}.{self._number}"

    def columns(self, dst, x, a=None, b=None, c=None, *, mask=7, store=Store.NOWHERE):
        """x₀·a + x₁·b + x₂·c."""
        self.emit(Op.VECTOR, mode=Mode.COLUMNS, dst=dst, x=x, a=a, b=b, c=c, mask=mask, store=store)

    def rows(self, dst, x, a=None, b=None, c=None, *, mask=7, store=Store.NOWHERE):
        """(a·x, b·x, c·x)."""
        self.emit(Op.VECTOR, mode=Mode.ROWS, dst=dst, x=x, a=a, b=b, c=c, mask=mask, store=store)

    def diagonal(self, dst, x, a, *, mask=7):
        """(a₀x₀, a₁x₁, a₂x₂)."""
        self.emit(Op.VECTOR, mode=Mode.DIAGONAL, dst=dst, x=x, a=a, mask=mask)

    def scaled(self, dst, x, a, *, mask=7, store=Store.NOWHERE):
        """``a`` times the lane x = (register, lane) or (register, "-", lane)."""
        register, *lane = x
        self.columns(dst, (register, (*lane, ZERO, ZERO)), a, mask=mask, store=store)

    def stored(self, register, store):
        """``register`` into the ray store."""
        self.columns(register, (register, (ONE, ZERO, ZERO)), register, store=store, mask=0)

    def root(self, dst, x, *, mask=7):
        """1/√x."""
        self.emit(Op.ROOT, dst=dst, x=x, mask=mask)

    def cut(self, dst, x, *, mask=7):
        """Colour of floats."""
        self.emit(Op.CUT, dst=dst, x=x, mask=mask)

    def multiply(self, dst, a, x, *, mask=7):
        """Colours a·x, x at most 1."""
        self.emit(Op.COLOR_MULTIPLY, dst=dst, a=a, x=x, mask=mask)

    def add(self, dst, a, x, *, mask=7):
        """Integers a + x."""
        self.emit(Op.COLOR_ADD, dst=dst, a=a, x=x, mask=mask)

    def subtract(self, dst, a, x, *, mask=7):
        """Integers a − x, at least 0."""
        self.emit(Op.COLOR_SUBTRACT, dst=dst, a=a, x=x, mask=mask)

    def decode(self, dst, x):
        """Colours of encoded bytes."""
        self.emit(Op.DECODE, dst=dst, x=x)

    def bytes(self, dst, x, *, mask=7):
        """Colours n/255."""
        self.emit(Op.BYTES, dst=dst, x=x, mask=mask)

    def move(self, dst, x, *, mask=7):
        """x."""
        self.emit(Op.MOVE, dst=dst, x=x, mask=mask)

    def goto(self, target):
        """Goes on at ``target``."""
        self.emit(Op.BRANCH, target=target)

    def branch(self, condition, x, target):
        """Goes on at ``target`` if ``condition`` holds of the lane x = (register, lane)."""
        self.emit(Op.BRANCH, condition=condition, x=x, target=target)

    def less(self, x, a, target, *, negated=False):
        """Goes on at ``target`` if integer x < a, each (register, lane), or if it is not."""
        self.emit(Op.BRANCH, condition=Condition.NOT_LESS if negated else Condition.LESS, x=(x[0], (x[1], a[1])),
                  a=a[0], target=target)

    def on_bit(self, x, bit, target, *, clear=False):
        """Goes on at ``target`` if bit ``bit`` of x = (register, lane) is set, or if it is clear."""
        self.emit(Op.BRANCH, condition=Condition.CLEAR if clear else Condition.SET, x=x, bit=bit, target=target)

    def on_flag(self, flag, target, *, clear=False):
        """Goes on at ``target`` if the material's flag is set, or if it is clear."""
        self.on_bit((Reg.MATERIAL + 1, X), flag, target, clear=clear)

    def load(self, dst, x, base=None):
        """Record number x, (register, lane), plus ``base``."""
        a = None if base is None else self.literal(base)
        self.emit(Op.LOAD, dst=dst, x=(x[0], (x[1], X)), a=a)

    def hit(self, dst, part, *, mask=7):
        """Of the last hit t, u, v, or triangle, instance, D′z."""
        self.emit(Op.HIT, dst=dst, bit=part, mask=mask)

    def trace(self, limits, owner, flags=0):
        """Stops until the ray is traced."""
        self.emit(Op.TRACE, a=limits, x=owner, bit=flags)

    def push(self, *registers):
        """Puts registers on the stack."""
        for register in registers:
            self.emit(Op.PUSH, a=register)

    def pop(self, *registers):
        """Takes from the stack what :meth:`push` has put there."""
        for register in reversed(registers):
            self.emit(Op.POP, dst=register)

    def unless_worth_it(self, weight, target):
        """Goes on at ``target`` if no lane of a weight reaches 2⁻¹²."""
        started, least = self.fresh("worth it"), self.literal(_MIN_WEIGHT)
        self.less((weight, X), (least, X), started, negated=True)
        self.less((weight, Y), (least, X), started, negated=True)
        self.less((weight, Z), (least, X), target)
        self.label(started)
