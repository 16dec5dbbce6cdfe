"""The shader's instructions: what a ray does between being traced and being traced again.

Each ray has 32 registers of three lanes, a stack, and a program counter. A lane holds a float of the chip's format, or
an integer: a number of a record or a triangle, bytes, or a colour of 8 integer and 16 fraction bits. An instruction
reads ``a``, ``b``, ``c`` as they are, and of ``x`` the lanes that ``select`` names, floats negated where ``negate``
says so; it writes the lanes of ``mask`` of register ``dst``. A ray has one instruction under way at a time.

There are no other multipliers and adders for floats than those of the transformation unit (paper §2.2: rays are made
by giving it a transformation and an initial ray).
"""

from dataclasses import dataclass, field

from amaranth.lib import data, enum
from amaranth.utils import ceil_log2

__all__ = ["NO_TRIANGLE", "NUM_REGISTERS", "Assembler", "Condition", "Lane", "Mode", "Op", "Program", "Store", "X", "Y",
           "Z", "constant_numbers", "instruction_layout", "lane_width"]

#: Registers of a ray; numbers from here on are constants.
NUM_REGISTERS = 32

#: Triangle that a ray has hit that has hit none.
NO_TRIANGLE = (1 << 24) - 1

#: Fraction bits of a colour.
COLOR_FRAC_BITS = 16


def lane_width(fmt):
    """Bits of a lane: a float, or three bytes."""
    return max(fmt.width, 24)


class Op(enum.Enum, shape=5):
    """What an instruction does; ``[x]`` are the selected lanes of register x, ``[x]₀`` the first of them."""

    #: By ``mode``: [x]₀·a + [x]₁·b + [x]₂·c, or (a·[x], b·[x], c·[x]), or a ⊗ [x]: the transformation unit.
    VECTOR = 0
    #: 1/√[x]₀, in each lane.
    ROOT = 1
    #: Float [x] as colour: cut to 16 fraction bits, at least 0, at most the largest.
    CUT = 2
    #: Colours (a·[x] + ½ ulp) cut to 16 fraction bits, saturating; [x] is at most 1.
    COLOR_MULTIPLY = 3
    #: Integers a + [x], saturating.
    COLOR_ADD = 4
    #: Integers a − [x], at least 0.
    COLOR_SUBTRACT = 5
    #: Colours of three sRGB-encoded bytes, the most significant of [x]₀ in lane x.
    DECODE = 6
    #: Colours n/255 of three bytes, the most significant of [x]₀ in lane x.
    BYTES = 7
    #: Float 2^offset_log2 ulp of the largest magnitude in a and [x], in each lane.
    OFFSET = 8
    #: [x].
    MOVE = 9
    #: Goes on at ``target`` if ``condition`` holds.
    BRANCH = 10
    #: Goes on at ``target``; the number of the next instruction, in each lane.
    CALL = 11
    #: Goes on at instruction [x]₀.
    RETURN = 12
    #: Record number [x]₀ + a's lane select₁ of the shading memory: registers dst to dst + 3.
    LOAD = 13
    #: Texel at coordinates ([x]₀, [x]₁) of the texture that a describes: colours, and in each lane of dst + 1 opacity.
    TEXTURE = 14
    #: Of the last hit (t, u, v), or with ``bit`` 1 the integers triangle and instance, and D′z.
    HIT = 15
    #: Stops until the ray is traced: from a = (t_near, t_far, –), not hitting triangle [x]₀ of instance [x]₁. ``bit``
    #: 0: any hit will do, 1: there is a t_far, 2: rays with the same integer [x]₂ have the same origin.
    TRACE = 16
    #: Puts a on the ray's stack.
    PUSH = 17
    #: Takes from the stack.
    POP = 18
    #: Ends the ray; its pixel is the colour [x], encoded.
    EMIT = 19


class Mode(enum.Enum, shape=2):
    """Which products :attr:`Op.VECTOR` sums."""

    COLUMNS = 0
    ROWS = 1
    DIAGONAL = 2


class Lane(enum.Enum, shape=3):
    """What ``select`` takes."""

    X = 0
    Y = 1
    Z = 2
    #: All bits zero.
    ZERO = 3
    #: Float 1.
    ONE = 4


class Store(enum.Enum, shape=2):
    """Where a result of :attr:`Op.VECTOR` goes besides its register."""

    NOWHERE = 0
    #: The ray's origin.
    ORIGIN = 1
    #: The ray's direction.
    DIRECTION = 2


class Condition(enum.Enum, shape=4):
    """When :attr:`Op.BRANCH` jumps."""

    ALWAYS = 0
    #: Float [x]₀ < 0.
    NEGATIVE = 1
    #: Float [x]₀ ≥ 0.
    NOT_NEGATIVE = 2
    #: Float [x]₀ = 0.
    ZERO = 3
    #: Float [x]₀ ≠ 0.
    NOT_ZERO = 4
    #: Integer [x]₀ = 0.
    NONE = 5
    #: Integer [x]₀ ≠ 0.
    SOME = 6
    #: Integer [x]₀ is less than a's lane select₁.
    LESS = 7
    #: Integer [x]₀ is not less than a's lane select₁.
    NOT_LESS = 8
    #: Bit ``bit`` of integer [x]₀ is set.
    SET = 9
    #: Bit ``bit`` of integer [x]₀ is not set.
    CLEAR = 10
    #: Integer [x]₀ is :data:`NO_TRIANGLE`.
    MISS = 11
    #: The ray's stack is empty.
    EMPTY = 12


X, Y, Z = Lane.X, Lane.Y, Lane.Z
_REGISTER_WIDTH = 6


def instruction_layout(length):
    """An instruction of a program of ``length`` instructions; a wide one reads ``b`` and ``c`` too."""
    register = range(1 << _REGISTER_WIDTH)
    return data.StructLayout({
        "op": Op, "mode": Mode, "condition": Condition, "store": Store, "bit": 5, "mask": 3,
        "dst": register, "a": register, "b": register, "c": register, "x": register,
        "select": data.ArrayLayout(Lane, 3), "negate": 3, "target": range(max(length, 2)), "is_wide": 1,
    })


#: The first constants: a vector of zeros, then the camera's rows and origin.
constant_numbers = {"zero": NUM_REGISTERS, "camera": (NUM_REGISTERS + 1, NUM_REGISTERS + 2, NUM_REGISTERS + 3),
                    "eye": NUM_REGISTERS + 4}
_FIRST_LITERAL = NUM_REGISTERS + 5
_MAX_CONSTANTS = (1 << _REGISTER_WIDTH) - NUM_REGISTERS


@dataclass(frozen=True)
class Program:
    """A finished program.

    Parameters
    ----------
    instructions : tuple of dict
        Fields of :func:`instruction_layout`.
    literals : tuple
        Constants from the first after the camera's, each three floats or three integers.
    labels : dict from str to int
        Where they are.
    """

    instructions: tuple
    literals: tuple
    labels: dict = field(default_factory=dict)

    @property
    def ops(self):
        """Operations that it has: what is to be built."""
        return frozenset(instruction["op"] for instruction in self.instructions)


class Assembler:
    """Writes a program down, an instruction a call.

    A register is its number; of the one that becomes ``x``, ``(register, lanes)`` takes lanes, three or one for all,
    and a lane may be preceded by ``-``: ``(5, (X, "-", Y, Lane.ZERO))``.
    """

    def __init__(self):
        self._instructions = []
        self._literals = []
        self._labels = {}
        self._zero = constant_numbers["zero"]

    def literal(self, *values):
        """Number of the constant ``values``, three floats or three integers, or one for all."""
        values = tuple(values) * (3 // len(values))
        kind = {type(value) for value in values}
        if len(values) != 3 or len(kind) != 1 or not kind <= {int, float}:
            raise ValueError(f"a literal has three floats or three integers, or one of them, not {values}")
        # 1 and 1.0 are equal, but not the same constant.
        keys = [(type(known[0]), known) for known in self._literals]
        if (key := (type(values[0]), values)) not in keys:
            if _FIRST_LITERAL - NUM_REGISTERS + len(self._literals) == _MAX_CONSTANTS:
                raise ValueError(f"more than {_MAX_CONSTANTS} constants")
            self._literals.append(values)
            return _FIRST_LITERAL + len(keys)
        return _FIRST_LITERAL + keys.index(key)

    def label(self, name):
        """The next instruction is ``name``."""
        if name in self._labels:
            raise ValueError(f"label '{name}' is there twice")
        self._labels[name] = len(self._instructions)

    @staticmethod
    def _lanes(x):
        register, lanes = x if isinstance(x, tuple) else (x, (X, Y, Z))
        lanes = lanes if isinstance(lanes, tuple) else (lanes,)
        select, negate, minus = [], 0, 0
        for lane in lanes:
            if lane == "-":
                minus = 1
                continue
            select.append(lane)
            negate |= minus << len(select) - 1
            minus = 0
        if len(select) == 1:
            select, negate = select * 3, 7 * negate
        return dict(x=register, select=[lane.value for lane in select + [Lane.ZERO] * (3 - len(select))],
                    negate=negate)

    def emit(self, op, *, dst=0, mask=7, a=None, b=None, c=None, x=None, mode=Mode.COLUMNS, store=Store.NOWHERE,
             condition=Condition.ALWAYS, bit=0, target=None):
        """One instruction; ``target`` is a label."""
        a, b, c, x = (self._zero if register is None else register for register in (a, b, c, x))
        self._instructions.append(dict(
            op=op, mode=mode, condition=condition, store=store, bit=bit, mask=mask, dst=dst, a=a, b=b, c=c,
            **self._lanes(x), target=target, is_wide=int(op is Op.VECTOR and (b, c) != (self._zero,) * 2)))

    def assembled(self):
        """The program.

        Raises
        ------
        ValueError
            If a label is missing.
        """
        instructions = []
        for instruction in self._instructions:
            target = instruction["target"]
            if target is not None and target not in self._labels:
                raise ValueError(f"label '{target}' is missing")
            instructions.append({**instruction, "target": 0 if target is None else self._labels[target]})
        return Program(tuple(instructions), tuple(self._literals), dict(self._labels))


def counter_width(program):
    """Bits of a program counter."""
    return max(ceil_log2(len(program.instructions)), 1)
