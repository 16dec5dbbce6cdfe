"""Powers of two: every pair, hardware and emulation against fractions."""

from fractions import Fraction

import numpy as np
import pytest
from amaranth.sim import Simulator

from fpu import Datapath, FloatFormat

# A bias below and one above the width of the fraction.
FORMATS = FloatFormat(3, 5), FloatFormat(4, 3)


def exact(a):
    return None if np.isinf(a) else Fraction(float(a))


def fitted(fmt, a):
    return 0.0 if a < Fraction(fmt.min_normal) else np.inf if a > Fraction(fmt.max) else float(a)


def raised(fmt, a, power):
    """By walking from member to member."""
    steps = power * 2.0**fmt.frac_width
    if a == 0.0 or np.isinf(a) or not 1 <= steps < 2.0**fmt.frac_width:
        return a
    members = np.unique(np.abs(fmt.decode(np.arange(1 << fmt.width))))
    place = np.searchsorted(members, abs(a)) + int(steps)
    return np.copysign(members[min(place, len(members) - 1)], a)


def expected(fmt, op, a, b):
    """What the operation's text says, by fractions."""
    x, y = exact(a), exact(b)
    if op == "power_max":
        return max(a, b)
    if op == "power_mul":
        return 0.0 if 0.0 in (a, b) else np.inf if None in (x, y) else fitted(fmt, x * y)
    if op == "power_div":
        return 0.0 if a == 0.0 or y is None else np.inf if x is None or b == 0.0 else fitted(fmt, x / y)
    if op == "raised":
        return raised(fmt, a, b)
    if op == "is_within":
        return x is not None and (y is None or abs(x) < y)
    limit = Fraction(1) if y is None else min(y, Fraction(1))
    return a == -np.inf or (x is not None and (x <= 1 or x < 1 + limit))


@pytest.mark.parametrize("fmt", FORMATS, ids=str)
@pytest.mark.parametrize("latency", [0, 1, 2])
@pytest.mark.parametrize("op", ["power_max", "power_mul", "power_div", "raised", "is_within", "is_at_most_one_plus"])
def test_every_pair(fmt, latency, op):
    powers = np.array([0.0, *(2.0 ** np.arange(1 - fmt.bias, fmt.exp_inf - fmt.bias)), np.inf])
    every = np.unique(fmt.decode(np.arange(1 << fmt.width)))
    first = every if op == "raised" or op.startswith("is_") else powers
    a, b = (pair.ravel() for pair in np.meshgrid(first, powers))
    dp = Datapath(fmt, latencies={"power": latency})
    dp.output("r", getattr(dp, op)(dp.input("a"), dp.input("b")))
    # Relations take no operator, and no register.
    assert dp.latency == (0 if op.startswith("is_") else 2 * latency if op == "raised" else latency)
    model = dp.model(a=a, b=b)["r"]
    wanted = np.array([expected(fmt, op, p, q) for p, q in zip(a, b, strict=True)])
    assert (model == wanted).all()
    assert len(np.unique(wanted)) > 1

    dut, hardware = dp.component(), []
    simulator = Simulator(dut)

    async def at_once(ctx):
        for p, q in zip(a, b, strict=True):
            ctx.set(dut.a, float(p))
            ctx.set(dut.b, float(q))
            hardware.append(ctx.get(dut.r))

    async def one_a_clock(ctx):
        for number in range(a.size + dp.latency):
            if number < a.size:
                ctx.set(dut.a, float(a[number]))
                ctx.set(dut.b, float(b[number]))
            if number >= dp.latency:
                hardware.append(ctx.get(dut.r))
            await ctx.tick()

    if dp.latency:
        simulator.add_clock(1e-8)
    simulator.add_testbench(one_a_clock if dp.latency else at_once)
    simulator.run()
    assert (np.array(hardware) == wanted).all()


def test_power_of_a_float():
    fmt = FloatFormat(4, 3)
    dp = Datapath(fmt)
    dp.output("r", dp.power(dp.input("a")))
    a = fmt.decode(np.arange(1 << fmt.width))
    finite = np.isfinite(a) & (a != 0)
    r = dp.model(a=a)["r"]
    assert (r[~finite] == np.abs(a[~finite])).all()
    assert (r[finite] == 2.0 ** np.floor(np.log2(np.abs(a[finite])))).all()
    assert dp.latency == 0
    assert dp.cost() == {"add": 0, "mul": 0, "div": 0, "cmp": 0}
