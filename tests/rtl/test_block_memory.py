"""Block memories against a list."""

import random

import pytest

from rtl.block_memory import BlockMemory
from tests.bench import simulate


@pytest.mark.parametrize("registered", [False, True])
def test_rows_come_after_the_latency(registered):
    rng = random.Random(4)
    dut = BlockMemory(9, depth=12, registered=registered)
    rows, asked = [0] * 12, []
    expected = []

    async def use(ctx):
        for _ in range(400):
            written, read = rng.sample(range(12), 2)
            writes, reads = rng.random() < 0.5, rng.random() < 0.7
            value = rng.getrandbits(9)
            ctx.set(dut.write, {"valid": writes, "address": written, "data": value})
            ctx.set(dut.reading, reads)
            ctx.set(dut.address, read)
            # Without the register behind it, the memory holds what was read last.
            asked.append(rows[read] if reads else asked[-1] if asked and not registered else None)
            await ctx.tick()
            if writes:
                rows[written] = value
            if len(asked) >= dut.latency and (row := asked[-dut.latency]) is not None:
                assert ctx.get(dut.data) == row
                expected.append(row)

    simulate(dut, use, name="block_memory")
    assert len(set(expected)) > 50


def test_a_read_that_meets_a_write_is_noticed():
    dut = BlockMemory(4, depth=4)

    async def meet(ctx):
        ctx.set(dut.write, {"valid": 1, "address": 2, "data": 7})
        ctx.set(dut.address, 2)
        await ctx.tick().repeat(2)
        ctx.set(dut.reading, 1)
        await ctx.tick().repeat(2)

    with pytest.raises(AssertionError, match="a row is read while it is written"):
        simulate(dut, meet, name="block_memory")
