"""Write-back: every result once, those of a source in order, each source in its turn, and who cannot wait does not."""

import random
from collections import deque

import pytest
from amaranth.lib import data

from fpu import FloatFormat
from rtl.register_file import lanes_layout
from rtl.requests import tag_layout
from rtl.results import WriteBack, result_layout
from tests.bench import feed, simulate, until, watch

FMT = FloatFormat(4, 5)
TOKEN = data.StructLayout({"ray": 8})
RESULT = result_layout(TOKEN, lanes_layout(FMT))


def result(rng, source, number):
    return {"token": {"ray": number % 256}, "last": rng.randrange(2), "dst": source, "mask": rng.randrange(8),
            "value": [rng.getrandbits(10) for _ in range(3)]}


def plain(value):
    return {"token": {"ray": value.token.ray}, "last": value.last, "dst": value.dst, "mask": value.mask,
            "value": list(value.value)}


@pytest.mark.parametrize(("num_inputs", "gap", "steps"), [(1, 0.0, 0.0), (2, 0.5, 0.3), (6, 0.0, 0.0), (6, 0.2, 0.5),
                                                           (6, 0.9, 0.9)])
def test_every_result_once(num_inputs, gap, steps):
    rng = random.Random(num_inputs)
    dut = WriteBack(fmt=FMT, num_inputs=num_inputs, tag=tag_layout(TOKEN), result=RESULT)
    sent = [[result(rng, source, number) for number in range(200)] for source in range(num_inputs)]
    left = [deque(each) for each in sent]
    # Those of the transformation unit say so by their destination.
    stepping, stepped, written = 31, [], []

    async def step(ctx):
        number = 0
        async for _ in ctx.tick():
            valid = any(left) and rng.random() < steps
            ctx.set(dut.stepped.valid, valid)
            if valid:
                vector = [rng.getrandbits(10) for _ in range(3)]
                ctx.set(dut.stepped.tag, {"token": {"ray": number % 256}, "dst": stepping, "mask": 7})
                for axis, bits in zip("xyz", vector, strict=True):
                    ctx.set(getattr(dut.stepped.vector, axis).as_value(), bits)
                stepped.append({"token": {"ray": number % 256}, "last": 1, "dst": stepping, "mask": 7,
                                "value": vector})
                number += 1

    simulate(dut, until(lambda: not any(left), quiet=3 * num_inputs * 20), name="results", background=(
        step, watch(dut.o, lambda o: written.append(plain(o.result))),
        *(feed(port, queue, rng=rng, gap=gap) for port, queue in zip(dut.i, left, strict=True))))
    for source, expected in enumerate(sent):
        assert [each for each in written if each["dst"] == source] == expected
    assert [each for each in written if each["dst"] == stepping] == stepped


@pytest.mark.parametrize("num_inputs", [1, 2, 6])
def test_one_a_cycle_and_each_in_turn(num_inputs):
    rng = random.Random(0)
    dut = WriteBack(fmt=FMT, num_inputs=num_inputs, tag=tag_layout(TOKEN), result=RESULT)
    left = [deque(result(rng, source, number) for number in range(60)) for source in range(num_inputs)]
    written = []

    async def note(ctx):
        async for _, _, valid, source in ctx.tick().sample(dut.o.valid, dut.o.result.dst):
            written.append(source if valid else None)

    simulate(dut, until(lambda: not any(left)), name="results", background=(
        note, *(feed(port, queue, rng=rng) for port, queue in zip(dut.i, left, strict=True))))
    begin = next(cycle for cycle, source in enumerate(written) if source is not None)
    steady = written[begin:begin + 50 * num_inputs]
    assert None not in steady
    assert all(set(steady[cycle:cycle + num_inputs]) == set(range(num_inputs))
               for cycle in range(0, len(steady), num_inputs))


def test_the_transformation_unit_takes_one_cycle():
    dut = WriteBack(fmt=FMT, num_inputs=2, tag=tag_layout(TOKEN), result=RESULT)

    async def testbench(ctx):
        ctx.set(dut.i[0].valid, 1)
        await ctx.tick().repeat(4)
        ctx.set(dut.stepped.valid, 1)
        ctx.set(dut.stepped.tag.dst, 9)
        await ctx.tick()
        ctx.set(dut.stepped.valid, 0)
        assert ctx.get(dut.o.valid)
        assert ctx.get(dut.o.result.dst) == 9
        await ctx.tick()
        assert ctx.get(dut.o.valid)
        assert ctx.get(dut.o.result.dst) == 0

    simulate(dut, testbench, name="results")
