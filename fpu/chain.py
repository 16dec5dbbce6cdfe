"""Carry chains whose tables do more than add."""

from itertools import groupby

from amaranth.hdl import Cat, Const, Instance, Module, Signal, Value
from amaranth.lib import enum, wiring
from amaranth.lib.wiring import In, Out

__all__ = ["CarryChain", "ChainBit", "carry_chain"]


class ChainBit(enum.Enum, shape=3):
    """What two numbers a place of a :class:`CarryChain` adds, made of its inputs a, b and c."""

    #: a, and b, the latter inverted where c is set.
    ADD = 0
    #: a, and b, the latter inverted unless c is set.
    SUBTRACT = 1
    #: a where c is set, else b; and nothing.
    CHOOSE = 2
    #: not a, and b, so that what leaves the chain is carried where a < b; a = b where c is set.
    COMPARE = 3
    #: a but not b, twice: it is carried into the place above.
    CARRY = 4


def _addends(kind, a, b, c):
    """The two numbers, bit by bit, of places of one kind; on integers too."""
    match kind:
        case ChainBit.ADD:
            return a, b ^ c
        case ChainBit.SUBTRACT:
            return a, b ^ ~c
        case ChainBit.CHOOSE:
            return c & a | ~c & b, b & 0
        case ChainBit.COMPARE:
            return ~a | c, b & ~c
        case ChainBit.CARRY:
            return a & ~b, a & ~b


def _generated(kind, a, b):
    """What is carried on where both numbers have the same bit, which needs no c."""
    match kind:
        case ChainBit.ADD | ChainBit.SUBTRACT:
            return a
        case ChainBit.CHOOSE:
            return 0
        case ChainBit.COMPARE:
            return b
        case ChainBit.CARRY:
            return a & ~b


def _table(kind):
    """Initial value of a place's table: above whether a carry passes, in the lowest four what is carried."""
    passes = carried = 0
    for place in range(8):
        a, b, c = (place >> bit & 1 for bit in range(3))
        x, y = (number & 1 for number in _addends(kind, a, b, c))
        passes |= (x ^ y) << place
        if place < 4:
            carried |= (_generated(kind, a, b) & 1) << place
    return passes << 8 | carried


class CarryChain(wiring.Component):
    """r = x + y modulo 2^width, x and y made of a, b and c place by place as ``kinds`` says, all in one carry chain.

    In an ECP5 a table of four inputs stands before each place of a chain. What synthesis makes of ``+`` uses two of
    them, so an inversion, a choice or a mask before it takes tables of its own; here the chain's own tables do that.
    For an ECP5 the cells are instantiated, elsewhere it is an addition.

    Parameters
    ----------
    kinds : sequence of ChainBit
        What each place does, from the least significant up.

    Members
    -------
    a, b, c : In(len(kinds))
        Operands.
    r : Out(len(kinds))
        Sum, in the same cycle.
    """

    def __init__(self, kinds):
        self.kinds = tuple(kinds)
        width = len(self.kinds)
        super().__init__({"a": In(width), "b": In(width), "c": In(width), "r": Out(width)})

    def elaborate(self, platform):
        m = Module()
        if getattr(platform, "device", "").startswith("LFE5"):
            self._instantiate(m)
        else:
            first, second, low = [], [], 0
            for kind, run in groupby(self.kinds):
                places = slice(low, low := low + len(tuple(run)))
                x, y = _addends(kind, self.a[places], self.b[places], self.c[places])
                first.append(x)
                second.append(y)
            m.d.comb += self.r.eq(Cat(first) + Cat(second))
        return m

    def _instantiate(self, m):
        # A place that lets no carry pass, so that it does not matter what enters: leading a zero in would cost more.
        start = 0 if self.kinds[0] is ChainBit.CARRY else 1
        # A cell has two places.
        end = (start + len(self.kinds)) % 2
        kinds = [*[ChainBit.CARRY] * start, *self.kinds, *[ChainBit.CARRY] * end]
        operands = {name: Cat(Const(0, start), getattr(self, name.lower()), Const(0, end)) for name in "ABC"}
        results = Cat(Signal(start, name="below"), self.r, Signal(end, name="above"))
        ports = {"i_CIN": Const(0, 1)}
        for place, kind in enumerate(kinds):
            half = place % 2
            ports |= {f"i_{name}{half}": operand[place] for name, operand in operands.items()}
            ports |= {f"i_D{half}": Const(1, 1), f"o_S{half}": results[place],
                      f"p_INIT{half}": Const(_table(kind), 16), f"p_INJECT1_{half}": "NO"}
            if half:
                # One carried out to nowhere would cost two tables that lead it out.
                carry = Signal(name=f"carry{place}")
                m.submodules[f"places{place - 1}"] = Instance(
                    "CCU2C", **ports, **({"o_COUT": carry} if place + 1 < len(kinds) else {}))
                ports = {"i_CIN": carry}


def carry_chain(m, name, *runs):
    """Sum of a :class:`CarryChain`, the submodule ``name`` of ``m``.

    A run is a tuple of a kind and the a, b and c of its places, from the least significant up: values of the same
    width, or integers; of c also a single bit, for all places.
    """
    kinds, operands = [], ([], [], [])
    for kind, *values in runs:
        width = max(len(Value.cast(value)) for value in values if not isinstance(value, int))
        kinds += [kind] * width
        for operand, value in zip(operands, values, strict=True):
            value = Const(value, width) if isinstance(value, int) else Value.cast(value)
            operand.append(value.replicate(width) if len(value) == 1 else value)
    m.submodules[name] = chain = CarryChain(kinds)
    m.d.comb += [chain.a.eq(Cat(operands[0])), chain.b.eq(Cat(operands[1])), chain.c.eq(Cat(operands[2]))]
    return chain.r
