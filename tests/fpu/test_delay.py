"""Delays of all lengths, in flip-flops and in memory."""

import numpy as np
import pytest

from fpu import Delay, FloatFormat
from tests.bench import simulate
from tests.fpu import clocked


@pytest.mark.parametrize(("cycles", "memory_from"), [
    *((cycles, 100) for cycles in (0, 1, 2, 5)), *((cycles, 2) for cycles in (2, 3, 4, 7, 8, 33)), (4, 5), (5, 5)])
@pytest.mark.parametrize("shape", [11, FloatFormat(5, 7)], ids=str)
@pytest.mark.parametrize("registered", [False, True])
def test_delay(shape, cycles, memory_from, registered):
    dut = Delay(shape, cycles=cycles, memory_from=memory_from, registered=registered)
    values = [float(value) if isinstance(shape, FloatFormat) else value
              for value in np.random.default_rng(8).integers(0, 256, 100).tolist()]

    async def testbench(ctx):
        for now in range(len(values) + cycles):
            if now < len(values):
                ctx.set(dut.i, values[now])
            if now >= cycles:
                assert ctx.get(dut.o) == values[now - cycles]
            await ctx.tick()

    simulate(clocked(dut), testbench, name="delay")


@pytest.mark.parametrize("parameters", [{"cycles": -1}, {"cycles": 3, "memory_from": 1}])
def test_limits(parameters):
    with pytest.raises(ValueError, match="elay"):
        Delay(4, **parameters)
