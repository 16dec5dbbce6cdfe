"""Formats: limits, encoding against exact fractions, shapes."""

from fractions import Fraction

import numpy as np
import pytest
from amaranth.hdl import Module, Signal
from amaranth.lib import wiring
from amaranth.lib.wiring import In, Out

from fpu import FloatFormat
from tests.bench import simulate
from tests.fpu import reference

FORMATS = [FloatFormat(2, 1), FloatFormat(3, 2), FloatFormat(7, 16), FloatFormat(8, 23)]


def test_properties():
    fmt = FloatFormat(7, 16)
    assert (fmt.width, fmt.sig_width, fmt.bias, str(fmt)) == (24, 17, 63, "7.16")
    assert fmt.max == (2 - 2.0 ** -16) * 2.0 ** 63
    assert fmt.min_normal == 2.0 ** -62
    assert fmt == FloatFormat.parse(" 7.16 ")
    assert hash(fmt) == hash(FloatFormat.parse("7.16"))


@pytest.mark.parametrize("text", ["7", "7,16", "7.16.1", "-7.16", "", "a.b"])
def test_parse_malformed(text):
    with pytest.raises(ValueError, match=r"like 7\.16"):
        FloatFormat.parse(text)


@pytest.mark.parametrize("text", ["1.16", "9.16", "7.0", "7.24"])
def test_parse_limits(text):
    with pytest.raises(ValueError, match="width must be between"):
        FloatFormat.parse(text)


@pytest.mark.parametrize("fmt", FORMATS, ids=str)
def test_encode(fmt):
    rng = np.random.default_rng(5)
    x = rng.normal(size=2_000) * 2.0 ** rng.integers(-fmt.bias - 3, fmt.bias + 4, 2_000)
    members = fmt.decode(rng.integers(0, 1 << fmt.width, 1_000))
    members = members[np.isfinite(members)]
    half = fmt.min_normal / 2
    x = np.concatenate([
        x, members, members * (1 + 2.0 ** -(fmt.frac_width + 1)), members * (1 + 2.0 ** -40),
        [0.0, -0.0, np.inf, -np.inf, fmt.max, -fmt.max, fmt.max * (1 + 2.0 ** -(fmt.frac_width + 3)),
         fmt.min_normal, half, -half, fmt.min_normal * (1 - 2.0 ** -(fmt.frac_width + 2)), 1e-300, 1e300, 5e-324]])
    want = [reference.pack(int(np.signbit(value)), np.inf if np.isinf(value) else abs(Fraction(value)),
                           fmt.exp_width, fmt.frac_width) for value in x]
    assert (fmt.encode(x) == want).all()
    decoded = [(-1.0) ** sign * float(magnitude) for sign, magnitude in
               (reference.unpack(bits, fmt.exp_width, fmt.frac_width) for bits in want)]
    assert (fmt.decode(want) == decoded).all()
    assert (np.signbit(fmt.decode(want)) == np.signbit(x)).all()
    assert (fmt.quantize(x) == decoded).all()


def test_scalar():
    fmt = FloatFormat(7, 16)
    assert fmt.encode(1.0) == 63 << 16
    assert fmt.decode(63 << 16) == 1.0
    assert fmt.quantize(np.float32(0.1)).shape == ()


def test_nan():
    with pytest.raises(ValueError, match="NaN"):
        FloatFormat(7, 16).encode([0.0, np.nan])


class Negation(wiring.Component):
    def __init__(self, fmt):
        super().__init__({"a": In(fmt), "r": Out(fmt), "kept": Out(fmt, init=-1.5)})

    def elaborate(self, platform):
        m = Module()
        kept = Signal(self.kept.shape(), init=-1.5)
        m.d.sync += kept.eq(kept.shape().const(0.1))
        m.d.comb += [self.r.eq(self.a), self.r.sign.eq(~self.a.sign), self.kept.eq(kept)]
        return m


@pytest.mark.parametrize("fmt", FORMATS, ids=str)
def test_shape(fmt):
    dut = Negation(fmt)

    async def testbench(ctx):
        assert ctx.get(dut.kept) == -1.5
        for value in (0.0, 1.0, -1.5, float("inf")):
            ctx.set(dut.a, value)
            assert ctx.get(dut.r) == -value
        ctx.set(dut.a, 1.0)
        assert [ctx.get(getattr(dut.a, name)) for name in ("frac", "exp", "sign")] == [0, fmt.bias, 0]
        await ctx.tick()
        assert ctx.get(dut.kept) == fmt.quantize(0.1)

    simulate(dut, testbench, name=f"format_{fmt}")
