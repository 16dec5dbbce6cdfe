"""Registers that a host sets and reads, and values behind them."""

import random

import pytest
from amaranth.hdl import ResetInserter, Signal

from rtl.host.register_file import RegisterFile
from tests.bench import simulate


@pytest.mark.parametrize(("num_registers", "num_values"), [(1, 1), (2, 5), (16, 16), (21, 50)])
def test_what_is_set_is_read(num_registers, num_values):
    rng = random.Random(num_registers)
    reset = Signal()
    file = RegisterFile(num_registers=num_registers, num_values=num_values)
    dut = ResetInserter(reset)(file)
    values = [rng.getrandbits(32) for _ in range(num_values)]
    seen = set()

    async def work(ctx):
        ctx.set(file.values, values)
        registers = [0] * num_registers
        for step in range(400):
            if step % 100 == 50:
                # As memory keeps what it holds, this is where an old word could come back.
                ctx.set(reset, 1)
                await ctx.tick()
                ctx.set(reset, 0)
                registers = [0] * num_registers
            number, word = rng.randrange(num_registers + num_values), rng.getrandbits(32)
            if rng.random() < 0.4:
                ctx.set(file.set, {"valid": 1, "number": number, "word": word})
                await ctx.tick()
                ctx.set(file.set, {"valid": 0, "number": rng.randrange(num_registers), "word": 0})
                if number < num_registers:
                    registers[number] = word
                await ctx.tick()
            assert list(ctx.get(file.registers)) == registers
            ctx.set(file.number, number)
            await ctx.tick().repeat(RegisterFile.latency)
            assert ctx.get(file.value) == [*registers, *values][number]
            seen.add((number, bool(ctx.get(file.value))))

    simulate(dut, work, name="register_file")
    assert len(seen) > num_registers + num_values / 2
