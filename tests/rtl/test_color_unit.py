"""The colour unit against plain integers and fractions, its operations in any order, back to back."""

import math
import random
import re

import pytest
from amaranth.back import rtlil
from amaranth.hdl import Value

from fpu import FloatFormat
from rtl.color_unit import ColorUnit, byte_fraction
from rtl.microcode import Op, lane_width
from tests.bench import simulate
from tests.rtl import colors
from tests.rtl.color_operations import HIGHEST, color_operation

WIDE, NARROW, WIDEST = FloatFormat(7, 16), FloatFormat(5, 8), FloatFormat(8, 23)
OPERATIONS = [Op.ROOT, Op.CUT, Op.COLOR_MULTIPLY, Op.COLOR_ADD, Op.COLOR_SUBTRACT, Op.DECODE, Op.BYTES, Op.OFFSET,
              Op.MOVE]


def run(dut, fmt, operations):
    """Results of (op, a, x), one a clock, as lanes."""
    width = lane_width(fmt)
    got = []

    def packed(lanes):
        return sum(lane << width * number for number, lane in enumerate(lanes))

    async def testbench(ctx):
        for now in range(len(operations) + dut.latency):
            if now < len(operations):
                op, a, x = operations[now]
                ctx.set(Value.cast(dut.op), op.value)
                ctx.set(Value.cast(dut.a), packed(a))
                ctx.set(Value.cast(dut.x), packed(x))
            if now >= dut.latency:
                bits = ctx.get(Value.cast(dut.r))
                got.append([bits >> width * number & (1 << width) - 1 for number in range(3)])
            await ctx.tick()

    simulate(dut, testbench, ticks=len(operations) + 100, name="color_unit")
    return got


def check(dut, fmt, operations, **parameters):
    for given, got in zip(operations, run(dut, fmt, operations), strict=True):
        assert got == color_operation(fmt, *given, **parameters), given


def random_lane(fmt, op, rng):
    """A float, a colour, or any bits, as likely at an edge as anywhere."""
    if op in (Op.CUT, Op.ROOT, Op.OFFSET):
        exp = rng.choice([0, 1, fmt.exp_inf - 1, fmt.exp_inf, fmt.bias + rng.randrange(-18, 10),
                          rng.randrange(fmt.exp_inf + 1)])
        exp = min(max(exp, 0), fmt.exp_inf)
        frac = rng.choice([0, (1 << fmt.frac_width) - 1, rng.getrandbits(fmt.frac_width)]) if exp < fmt.exp_inf else 0
        return rng.getrandbits(1) << fmt.width - 1 | exp << fmt.frac_width | frac
    return rng.choice([0, 1, 65535, 65536, HIGHEST - 1, HIGHEST, 1 << rng.randrange(24), rng.getrandbits(24),
                       rng.getrandbits(17), rng.getrandbits(lane_width(fmt))])


def random_operation(fmt, op, rng):
    lanes = [[random_lane(fmt, op, rng) for _ in range(3)] for _ in range(2)]
    if op is Op.COLOR_MULTIPLY:
        lanes[1] = [min(lane & 0x1ffff, rng.choice([65536, 131071])) for lane in lanes[1]]
    return op, *lanes


@pytest.mark.parametrize("offset_log2", [3, 0])
@pytest.mark.parametrize("fmt", [WIDE, NARROW], ids=str)
def test_operations_in_any_order(fmt, offset_log2):
    rng = random.Random(offset_log2)
    dut = ColorUnit(fmt=fmt, offset_log2=offset_log2)
    check(dut, fmt, [random_operation(fmt, rng.choice(OPERATIONS), rng) for _ in range(2500)], offset_log2=offset_log2)


@pytest.mark.parametrize("op", OPERATIONS)
def test_an_operation_alone(op):
    """Without the others, and in a format wider than a colour."""
    rng = random.Random(5)
    dut = ColorUnit(fmt=WIDEST, operations=[op])
    check(dut, WIDEST, [random_operation(WIDEST, op, rng) for _ in range(200)])


@pytest.mark.parametrize(("operations", "latencies"), [
    ([Op.ROOT], None), ([Op.MOVE, Op.ROOT], {"rsqrt": 3}), ([Op.CUT, Op.COLOR_ADD, Op.ROOT], {"rsqrt": 1}),
    ([Op.COLOR_SUBTRACT, Op.COLOR_ADD], None), ([Op.DECODE, Op.BYTES, Op.OFFSET], None)])
def test_some_operations(operations, latencies):
    rng = random.Random(6)
    dut = ColorUnit(fmt=NARROW, operations=operations, latencies=latencies)
    check(dut, NARROW, [random_operation(NARROW, rng.choice(operations), rng) for _ in range(200)])


def test_every_byte():
    dut = ColorUnit(fmt=WIDE, operations=[Op.DECODE, Op.BYTES])
    zero = [0, 0, 0]
    check(dut, WIDE, [(op, zero, [byte << 16 | (byte + 85) % 256 << 8 | (byte + 170) % 256, 0, 0])
                      for byte in range(256) for op in (Op.DECODE, Op.BYTES)])
    assert [byte_fraction(byte) for byte in range(256)] == [colors.byte_fraction(byte) for byte in range(256)]


def test_cut_at_its_edges():
    fmt, unit = WIDE, 2.0**-16
    values = [0.0, -0.0, unit, 0.999 * unit, -unit, -1.0, 1.0, 1 - 2 * unit, 255.998, 256.0, 1e9, math.inf, -math.inf]
    bits = [int(fmt.encode(value)) for value in values]
    lanes = [[bits[(number + k) % len(bits)] for k in range(3)] for number in range(len(bits))]
    dut = ColorUnit(fmt=fmt, operations=[Op.CUT])
    got = run(dut, fmt, [(Op.CUT, [0, 0, 0], x) for x in lanes])
    assert [row[0] for row in got] == [0, 0, 1, 0, 0, 0, 65536, 65534, 0xffff80, HIGHEST, HIGHEST, HIGHEST, 0]
    check(dut, fmt, [(Op.CUT, [0, 0, 0], x) for x in lanes])


def test_offset_at_its_edges():
    fmt, one = WIDE, WIDE.bias << 16
    below = fmt.frac_width - 3
    cases = {(0, 0): 0, (1 << 23, 0): 0, (0x1234, 0): 0, (one, 0): one - (below << 16),
             (one | 1 << 23 | 0xffff, 5 << 16): one - (below << 16), (below << 16, 0): 0,
             (below + 1 << 16, 0): 1 << 16, (5 << 16, one + 3 * 65536): one + (3 - below << 16)}
    dut = ColorUnit(fmt=fmt, operations=[Op.OFFSET])
    for place in range(3):
        given = [[[lane if k == place else 0 for k in range(3)] for lane in pair] for pair in cases]
        assert run(dut, fmt, [(Op.OFFSET, a, x) for a, x in given]) == [[bits] * 3 for bits in cases.values()]


def test_only_what_is_asked_for_is_built():
    def parts(operations):
        """The unit's submodules that are more than wires, without their numbers."""
        text = rtlil.convert(ColorUnit(fmt=WIDE, operations=operations), name="top")
        return set(re.findall(r"^module \\top\.(\w+?)\d*$", text, re.MULTILINE))

    assert parts([Op.MOVE, Op.COLOR_ADD]) == set()
    assert parts([Op.CUT, Op.DECODE]) == {"until", "cut", "linear"}
    assert parts(OPERATIONS) == {"until", "cut", "linear", "lower", "upper", "root"}


def test_latencies():
    assert ColorUnit(fmt=WIDE).latency == 11
    assert ColorUnit(fmt=WIDE, latencies={"rsqrt": 7}).latency == 8
    assert ColorUnit(fmt=WIDE, operations=[op for op in OPERATIONS if op is not Op.ROOT]).latency == 4
    assert ColorUnit(fmt=WIDE, operations=[Op.MOVE]).latency == 1


def test_limits():
    for value in (-1, 17):
        with pytest.raises(ValueError, match=f"offset_log2 must be between 0 and 16, not {value}"):
            ColorUnit(fmt=WIDE, offset_log2=value)
    with pytest.raises(ValueError, match=r"some of ROOT, CUT, .*, OFFSET, MOVE, not MOVE, TRACE$"):
        ColorUnit(fmt=WIDE, operations=[Op.TRACE, Op.MOVE])
    with pytest.raises(ValueError, match=r"not none$"):
        ColorUnit(fmt=WIDE, operations=[])
