"""The comparator is a total order of values, for every three numbers of a small format and of a large one."""

import pytest
from amaranth.hdl import Assert, Assume, Module, Signal

from fpu import Comparator, FloatFormat
from tests.formal.prove import prove


@pytest.mark.parametrize("fmt", [FloatFormat(3, 2), FloatFormat(7, 16)], ids=str)
def test_total_order(fmt, tmp_path):
    m = Module()
    numbers = [Signal(fmt.width, name=name) for name in "abc"]
    order = {}
    for number in numbers:
        view = fmt(number)
        # Infinity has one pattern of each sign.
        m.d.comb += Assume(~view.exp.all() | (view.frac == 0))
    for i in range(3):
        for j in range(3):
            m.submodules[f"compare{i}{j}"] = order[i, j] = compare = Comparator(fmt, latency=0)
            m.d.comb += [
                compare.a.eq(fmt(numbers[i])), compare.b.eq(fmt(numbers[j])),
                Assert(compare.lt + compare.eq + compare.gt == 1),
            ]
    a, b = (fmt(number) for number in numbers[:2])
    m.d.comb += [
        Assert(order[0, 0].eq),
        Assert(order[0, 1].lt == order[1, 0].gt),
        Assert(order[0, 1].eq == order[1, 0].eq),
        Assert(~(order[0, 1].lt & order[1, 2].lt) | order[0, 2].lt),
        Assert(~(order[0, 1].eq & order[1, 2].eq) | order[0, 2].eq),
        # It is the order of values: by sign, then as the bits count; all zeros are one.
        Assert(order[0, 1].eq == ((numbers[0] == numbers[1]) | (a.exp == 0) & (b.exp == 0))),
        Assert(order[0, 1].lt == ~order[0, 1].eq & (
            a.sign & ~b.sign | ~a.sign & ~b.sign & (numbers[0][:-1] < numbers[1][:-1])
            | a.sign & b.sign & (numbers[0][:-1] > numbers[1][:-1]))),
    ]
    prove(m, ports=numbers, cycles=1, by_induction=True, folder=tmp_path)
