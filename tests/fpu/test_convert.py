"""Conversion from and to integers against exact fractions."""

from fractions import Fraction

import numpy as np
import pytest
from amaranth.hdl import Value

from fpu import FloatFormat, FloatToInt, IntToFloat, Rounding
from fpu.convert import float_to_int
from tests.bench import simulate
from tests.fpu import clocked, reference

FORMATS = [FloatFormat(2, 3), FloatFormat(3, 2), FloatFormat(7, 16)]
SHAPES = [(1, False, 0), (2, True, 0), (7, True, 3), (8, False, 0), (8, False, 11), (19, True, 0), (19, True, 19),
          (24, False, -5), (53, False, 0), (53, True, 64)]


def stream(dut, operand, result, values):
    """Results for ``values``, one a clock."""
    got = []

    async def testbench(ctx):
        for index in range(len(values) + dut.latency):
            if index < len(values):
                ctx.set(operand, values[index])
            if index >= dut.latency:
                got.append(ctx.get(result))
            await ctx.tick()

    simulate(clocked(dut), testbench, name=type(dut).__name__)
    return got


def limits(int_width, signed):
    return (-(1 << int_width - 1), (1 << int_width - 1) - 1) if signed else (0, (1 << int_width) - 1)


@pytest.mark.parametrize("latency", [None, 0, 2, 12])
@pytest.mark.parametrize(("int_width", "signed", "num_frac_bits"), SHAPES)
@pytest.mark.parametrize("fmt", FORMATS, ids=str)
def test_int_to_float(fmt, int_width, signed, num_frac_bits, latency):
    rng = np.random.default_rng(6)
    lowest, highest = limits(int_width, signed)
    powers = [sign * ((1 << place) + offset) for place in range(int_width) for offset in (-1, 0, 1) for sign in (-1, 1)]
    values = [value for value in powers if lowest <= value <= highest]
    values += [lowest, highest, *rng.integers(lowest, highest, 40, endpoint=True).tolist()]
    for rounding in Rounding if latency is None else [Rounding.NEAREST_EVEN]:
        dut = IntToFloat(fmt, int_width=int_width, signed=signed, num_frac_bits=num_frac_bits, latency=latency,
                         rounding=rounding)
        want = [reference.pack(int(value < 0), abs(Fraction(value)) / Fraction(2) ** num_frac_bits,
                               fmt.exp_width, fmt.frac_width,
                               truncate=rounding is Rounding.TRUNCATE) for value in values]
        assert stream(dut, dut.i, Value.cast(dut.r), values) == want
        emulated = [IntToFloat.emulation[rounding](fmt.params, value, 2.0 ** -num_frac_bits) for value in values]
        assert fmt.encode(emulated).tolist() == want


@pytest.mark.parametrize("latency", [None, 0, 2, 12])
@pytest.mark.parametrize(("int_width", "signed", "num_frac_bits"), SHAPES)
@pytest.mark.parametrize("fmt", FORMATS, ids=str)
def test_float_to_int(fmt, int_width, signed, num_frac_bits, latency):
    rng = np.random.default_rng(7)
    lowest, highest = limits(int_width, signed)
    unit = 2.0 ** -num_frac_bits
    bits = np.arange(1 << fmt.width) if fmt.width < 8 else fmt.encode(np.concatenate([
        rng.normal(size=60) * 2.0 ** rng.integers(-2, int_width + 2, 60) * unit,
        [0.0, -0.0, np.inf, -np.inf, 1e-9, fmt.max, -fmt.max],
        np.array([lowest, highest, highest + 1.0, lowest - 1.0]) * unit]))
    dut = FloatToInt(fmt, int_width=int_width, signed=signed, num_frac_bits=num_frac_bits, latency=latency)
    want = [reference.to_int(int(a), lowest, highest, fmt.exp_width, fmt.frac_width, num_frac_bits) for a in bits]
    assert stream(dut, Value.cast(dut.a), dut.r, bits.tolist()) == want
    assert [float_to_int(a, lowest, highest, unit) for a in fmt.decode(bits)] == want


def test_limits():
    for cls in (IntToFloat, FloatToInt):
        with pytest.raises(ValueError, match="Integer width"):
            cls(FloatFormat(7, 16), int_width=54)
        with pytest.raises(ValueError, match="fraction bits"):
            cls(FloatFormat(7, 16), int_width=8, num_frac_bits=65)
