"""Performance counters."""

import random

from rtl.counters import Counters
from tests.bench import simulate


def test_counts_clears_and_wraps():
    names = ("cycles", "often", "rarely")
    dut = Counters(names, width=5)
    rng = random.Random(1)

    async def count(ctx):
        expected = dict.fromkeys(names, 0)
        for _ in range(400):
            events = {"cycles": 1, "often": int(rng.random() < 0.7), "rarely": int(rng.random() < 0.05)}
            clear = rng.random() < 0.01
            ctx.set(dut.clear, clear)
            for name, event in events.items():
                ctx.set(getattr(dut, f"event_{name}"), event)
            await ctx.tick()
            expected = {name: 0 if clear else (count + events[name]) % 32 for name, count in expected.items()}
            assert {name: ctx.get(getattr(dut, name)) for name in names} == expected

    simulate(dut, count, name="counters")
