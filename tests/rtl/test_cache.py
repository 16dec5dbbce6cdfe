"""The cache against a dictionary, with gaps on every side and a memory of random latency."""

import random

import pytest

from rtl.cache import Cache
from tests.bench import simulate


def run_cache(*, seed, num_lines, line_items, item_width, num_fetches, gap, latency, indices):
    rng = random.Random(seed)
    num_waiting = 7
    dut = Cache(item_width=item_width, payload_shape=16, index_width=12, num_lines=num_lines,
                line_items=line_items, num_fetches=num_fetches, num_waiting=num_waiting)
    item_words = -(-item_width // 32)
    words = [rng.getrandbits(32) for _ in range(4096 * item_words)]
    num_requests = len(indices)
    answers = {}
    in_cache = 0
    events = {"hit": 0, "miss": 0, "lines": 0}

    def item(index):
        value = sum(words[index * item_words + k] << (32 * k) for k in range(item_words))
        return value & ((1 << item_width) - 1)

    async def ask(ctx):
        nonlocal in_cache
        for number, index in enumerate(indices):
            while in_cache >= num_waiting or rng.random() < gap:
                await ctx.tick()
            ctx.set(dut.request.payload, {"index": index, "payload": number})
            ctx.set(dut.request.valid, 1)
            in_cache += 1
            await ctx.tick().until(dut.request.ready)
            ctx.set(dut.request.valid, 0)

    async def answer(ctx):
        nonlocal in_cache
        while len(answers) < num_requests:
            ctx.set(dut.response.ready, rng.random() >= gap)
            _, _, valid, ready, payload = await ctx.tick().sample(
                dut.response.valid, dut.response.ready, dut.response.payload)
            if valid and ready:
                assert payload.payload not in answers, "a request was answered twice"
                answers[payload.payload] = payload.item
                in_cache -= 1
        for _ in range(50):
            _, _, valid = await ctx.tick().sample(dut.response.valid)
            assert not valid

    async def memory(ctx):
        pending = []
        now = 0
        while True:
            now += 1
            ctx.set(dut.line_request.ready, rng.random() >= gap)
            due = bool(pending) and pending[0][0] <= now
            ctx.set(dut.line_data.valid, due)
            if due:
                ctx.set(dut.line_data.payload, pending.pop(0)[1])
            _, _, valid, ready, line = await ctx.tick().sample(
                dut.line_request.valid, dut.line_request.ready, dut.line_request.payload)
            if valid and ready:
                events["lines"] += 1
                first = line * dut.line_words
                start = now + rng.randrange(1, latency + 1)
                pending += [(start + k, words[first + k]) for k in range(dut.line_words)]

    async def count(ctx):
        async for _, _, hit, miss in ctx.tick().sample(dut.hit, dut.miss):
            events["hit"] += hit
            events["miss"] += miss

    simulate(dut, ask, answer, background=(memory, count), ticks=200 * num_requests + 1000, name="cache")
    assert answers == {number: item(index) for number, index in enumerate(indices)}
    assert events["hit"] + events["miss"] == num_requests
    return events


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize(("line_items", "item_width"), [(1, 33), (4, 32), (2, 64), (1, 288), (2, 24)])
def test_every_request_is_answered_once_and_right(seed, line_items, item_width):
    # Near ones share lines; far ones, a multiple of the cache's size apart, evict each other.
    rng = random.Random(seed)
    indices = [rng.randrange(40) * rng.choice((1, 1, 8 * line_items)) for _ in range(300)]
    run_cache(seed=seed, num_lines=8, line_items=line_items, item_width=item_width, num_fetches=1 + seed,
              gap=0.3 * (seed % 3), latency=1 + 7 * seed, indices=indices)


def test_lines_are_kept():
    rng = random.Random(1)
    events = run_cache(seed=1, num_lines=64, line_items=2, item_width=64, num_fetches=4, gap=0.0, latency=4,
                       indices=[rng.randrange(40) for _ in range(1000)])
    assert events["hit"] > 900
    # A line is remembered for as many fetches as the ring is long; whoever waited longer fetches once more.
    assert 20 <= events["lines"] <= 25


def test_a_line_wanted_by_all_is_fetched_once():
    events = run_cache(seed=2, num_lines=8, line_items=1, item_width=64, num_fetches=4, gap=0.0, latency=40,
                       indices=[5] * 8)
    assert events["lines"] == 1


def test_a_hit_is_answered_after_6_cycles_one_a_clock():
    dut = Cache(item_width=32, payload_shape=8, index_width=6, num_lines=4, line_items=2, num_waiting=16)
    answered = []

    async def warm_up_and_ask(ctx):
        ctx.set(dut.line_request.ready, 1)
        ctx.set(dut.response.ready, 1)
        ctx.set(dut.request.valid, 1)
        await ctx.tick()
        ctx.set(dut.request.valid, 0)
        await ctx.tick().until(dut.line_request.valid)
        for word in (11, 22):
            ctx.set(dut.line_data.valid, 1)
            ctx.set(dut.line_data.payload, word)
            await ctx.tick()
        ctx.set(dut.line_data.valid, 0)
        await ctx.tick().until(dut.response.valid)
        ctx.set(dut.request.valid, 1)
        for number in range(30):
            ctx.set(dut.request.payload, {"index": number % 2, "payload": number})
            assert ctx.get(dut.request.ready)
            answered.append((ctx.get(dut.response.payload.payload), ctx.get(dut.response.payload.item))
                            if ctx.get(dut.response.valid) else None)
            await ctx.tick()

    simulate(dut, warm_up_and_ask, name="cache")
    assert answered == [None] * 6 + [(number, (11, 22)[number % 2]) for number in range(24)]


def test_a_line_of_one_word():
    with pytest.raises(ValueError, match=r"^A line of a cache has a single word; it must have 2 or more$"):
        Cache(item_width=32, payload_shape=1, index_width=4, num_lines=2, num_waiting=1)
