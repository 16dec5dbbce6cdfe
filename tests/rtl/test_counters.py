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


def test_events_of_several_sources():
    names = ("cycles", "often", "rarely")
    num_sources = 3
    dut = Counters(names, width=8, num_sources=num_sources)
    rng = random.Random(2)
    seen = {name: set() for name in names}

    async def count(ctx):
        expected = dict.fromkeys(names, 0)
        for _ in range(300):
            events = {"cycles": 1, "often": rng.randrange(num_sources + 1), "rarely": num_sources * (rng.random() < .1)}
            for name, event in events.items():
                ctx.set(getattr(dut, f"event_{name}"), event)
                seen[name].add(event)
            await ctx.tick()
            expected = {name: (count + events[name]) % 256 for name, count in expected.items()}
            assert {name: ctx.get(getattr(dut, name)) for name in names} == expected

    simulate(dut, count, name="counters")
    assert seen == {"cycles": {1}, "often": {0, 1, 2, 3}, "rarely": {0, 3}}
