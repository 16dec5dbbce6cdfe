"""Each operation of a datapath is what its name says, in software and in hardware."""

from math import copysign, isinf

import numpy as np
import pytest

from fpu import Datapath, FloatFormat
from tests.bench import simulate
from tests.fpu import clocked, reference
from tests.fpu.operands import all_pairs

FMT = FloatFormat(3, 2)


def exact(function):
    """An operation on values by its reference on bits."""
    def operation(*values):
        bits = function(*(int(FMT.encode(value)) for value in values), FMT.exp_width, FMT.frac_width)
        return float(FMT.decode(bits))
    return operation


FLOATS = {
    "add": exact(reference.add), "sub": exact(reference.subtract), "mul": exact(reference.multiply),
    "div": exact(reference.divide), "min": lambda a, b: a if a < b else b, "max": lambda a, b: a if a > b else b,
}
OF_ONE = {
    "neg": lambda a: -a, "abs": abs, "reciprocal": exact(reference.reciprocal), "sqrt": exact(reference.square_root),
    "reciprocal_sqrt": exact(reference.reciprocal_square_root),
}
RELATIONS = {
    "lt": lambda a, b: a < b, "le": lambda a, b: a <= b, "eq": lambda a, b: a == b, "ge": lambda a, b: a >= b,
    "gt": lambda a, b: a > b,
}
TESTS = {
    "is_zero": lambda a: a == 0, "is_negative": lambda a: a < 0, "sign": lambda a: copysign(1, a) < 0,
    "is_finite": lambda a: not isinf(a), "is_at_most_one": lambda a: a <= 1,
}


@pytest.fixture(scope="module")
def everything():
    """All operations on a and b, and what they are to give."""
    dp = Datapath(FMT, latencies={"add": 2, "mul": 0, "div": 1, "cmp": 1, "rec": 2, "sqrt": 1, "rsqrt": 2, "select": 1})
    a, b = dp.input("a"), dp.input("b")
    wanted = {}

    def output(name, node, function):
        dp.output(name, node)
        wanted[name] = function

    for name, function in (FLOATS | RELATIONS).items():
        output(name, getattr(dp, name)(a, b), function)
    for name, function in (OF_ONE | TESTS).items():
        output(name, getattr(dp, name)(a), lambda a, b, function=function: function(a))
    # The same comparators, used the other way round
    for name, function in RELATIONS.items():
        output(f"{name}_reversed", getattr(dp, name)(b, a), lambda a, b, function=function: function(b, a))
    negative, below = dp.is_negative(a), dp.lt(a, b)
    output("not_", dp.logical_not(negative), lambda a, b: not a < 0)
    output("and_", dp.logical_and(negative, below), lambda a, b: a < 0 and a < b)
    output("or_", dp.logical_or(negative, below), lambda a, b: a < 0 or a < b)
    output("select", dp.select(negative, a, b), lambda a, b: a if a < 0 else b)
    output("select_flag", dp.select(negative, below, dp.sign(b)), lambda a, b: a < b if a < 0 else copysign(1, b) < 0)
    output("register", dp.register(a), lambda a, b: a)
    output("register_flag", dp.register(below), lambda a, b: a < b)
    output("const", dp.const(0.6), lambda a, b: 0.625)
    output("const_tie", dp.const(1.125), lambda a, b: 1.0)
    return dp, wanted


def check(wanted, pairs, got):
    for name, function in wanted.items():
        for pair, value in zip(pairs, got[name], strict=True):
            want = function(*pair)
            assert (value, copysign(1, value)) == (want, copysign(1, want)), (name, pair, value, want)


def test_model(everything):
    dp, wanted = everything
    a, b = (FMT.decode(bits) for bits in all_pairs(FMT))
    check(wanted, list(zip(a.tolist(), b.tolist(), strict=True)), dp.model(a=a, b=b))


def test_hardware(everything):
    dp, wanted = everything
    chosen = np.random.default_rng(31).permutation(len(all_pairs(FMT)[0]))[:500]
    pairs = list(zip(*(FMT.decode(bits[chosen]).tolist() for bits in all_pairs(FMT)), strict=True))
    dut = dp.component()
    got = {name: [] for name in wanted}

    async def testbench(ctx):
        for now in range(len(pairs) + dut.latency):
            if now < len(pairs):
                ctx.set(dut.a, pairs[now][0])
                ctx.set(dut.b, pairs[now][1])
            if now >= dut.latency:
                for name, values in got.items():
                    values.append(ctx.get(getattr(dut, name)))
            await ctx.tick()

    simulate(clocked(dut), testbench, name="operations")
    check(wanted, pairs, got)
