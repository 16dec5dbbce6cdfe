"""The traversal stack against Python lists."""

import math
import random
from collections import Counter, deque

import pytest

from fpu import FloatFormat
from rtl.layout import PACKET_RAYS, IntervalSource
from rtl.stack import TraversalStack
from tests.bench import drain, feed, memory, simulate, until
from tests.rtl.packets import fields, random_mask, random_token, rays_of

FMT = FloatFormat(5, 8)
INDEX_WIDTH = 9


def build(*, num_threads, stack_depth, cmp_latency=1):
    return TraversalStack(fmt=FMT, num_threads=num_threads, stack_depth=stack_depth, index_width=INDEX_WIDTH,
                          latencies={"cmp": cmp_latency})


def random_push(rng):
    """An entry; distances from few values, so that they often coincide."""
    return {"node": rng.randrange(1 << INDEX_WIDTH), "mask": random_mask(rng),
            "intervals": [(rng.choice([0.0, -0.0, 1.5, 2.25, 3.0]), rng.choice([3.5, math.inf]))
                          for _ in range(PACKET_RAYS)]}


def as_push(entry, token):
    intervals = [{"t_near": t_near, "t_far": t_far} for t_near, t_far in entry["intervals"]]
    return {"valid": 1, "token": token, "node": entry["node"], "intervals": intervals}


class Threads:
    """Threads that push, then pop until both levels are empty, and what they are to get."""

    def __init__(self, *, seed, num_threads, stack_depth, num_pushes):
        self.rng = random.Random(seed)
        self.stack_depth = stack_depth
        self.num_pushes = num_pushes
        self.stacks = {(thread, level): [] for thread in range(num_threads) for level in range(2)}
        self.distances = {thread: [0.0] * PACKET_RAYS for thread in range(num_threads)}
        self.pushes, self.pops = deque(), deque()
        self.asked = {}
        self.idle = set(range(num_threads))
        self.events = Counter()

    @property
    def finished(self):
        return self.drained and not self.asked

    @property
    def drained(self):
        return not self.num_pushes and not any(self.stacks.values())

    def token(self, thread, level, **known):
        return random_token(self.rng, thread=thread, stack_depth=self.stack_depth, level=level,
                            sp=len(self.stacks[thread, level]), **known)

    def act(self):
        """One idle thread pushes or pops."""
        rng = self.rng
        thread = rng.choice(sorted(self.idle))
        level = rng.randrange(2)
        stack = self.stacks[thread, level]
        if self.num_pushes and len(stack) < self.stack_depth and rng.random() < 0.55:
            self.num_pushes -= 1
            entry = random_push(rng)
            self.pushes.append(as_push(entry, self.token(thread, level, mask=entry["mask"])))
            stack.append(entry)
        else:
            self.idle.remove(thread)
            self.distances[thread] = [rng.choice([0.0, 1.5, 2.25, 2.5]) for _ in range(PACKET_RAYS)]
            token = self.token(thread, level, hit=rng.choice([0, 15, 15, rng.randrange(16)]))
            self.pops.append(token)
            self.asked[thread] = token

    def next_worth(self, token):
        """What of the stack is left, the entry popped and its rays worth a visit; all None if there is none."""
        stack = self.stacks[token["thread"], token["level"]]
        distances = self.distances[token["thread"]]
        while stack:
            entry = stack.pop()
            rays = [ray for ray in rays_of(entry["mask"])
                    if not token["hit"] >> ray & 1 or entry["intervals"][ray][0] <= distances[ray]]
            if rays:
                return entry, sum(1 << ray for ray in rays)
            self.events["dropped"] += 1
        return None, None

    def resume(self, resume):
        token = self.asked.pop(resume.token.thread)
        entry, mask = self.next_worth(token)
        assert entry is not None
        assert fields(resume.token) == token | {
            "mask": mask, "sp": len(self.stacks[token["thread"], token["level"]]),
            "interval": IntervalSource.POP}
        assert resume.node == entry["node"]
        self.events["resumed"] += 1
        return token, entry

    def exhausted(self, exhausted):
        token = self.asked.pop(exhausted.thread)
        entry, _ = self.next_worth(token)
        assert entry is None
        assert fields(exhausted) == token | {"sp": 0}
        self.events["exhausted"] += 1
        self.idle.add(token["thread"])


@pytest.mark.parametrize(("seed", "num_threads", "stack_depth", "gap"), [
    (0, 1, 4, 0.2), (1, 5, 1, 0.0), (2, 8, 5, 0.4), (3, 16, 8, 0.0)])
def test_pushes_and_pops(seed, num_threads, stack_depth, gap):
    dut = build(num_threads=num_threads, stack_depth=stack_depth, cmp_latency=seed % 3)
    threads = Threads(seed=seed, num_threads=num_threads, stack_depth=stack_depth, num_pushes=300)
    rng = random.Random(100 + seed)
    to_read = deque()

    async def act(ctx):
        while not threads.finished:
            ctx.set(dut.push.valid, 0)
            if threads.idle and not threads.drained and rng.random() >= gap:
                threads.act()
            if threads.pushes:
                ctx.set(dut.push, threads.pushes.popleft())
            await ctx.tick()

    async def read_intervals(ctx):
        """In the cycle after a pop at the earliest; only then is its thread free for another."""
        while True:
            if not to_read:
                await ctx.tick()
                continue
            token, entry = to_read.popleft()
            ctx.set(dut.popped_address, token["thread"])
            await ctx.tick()
            await ctx.tick()
            intervals = ctx.get(dut.popped_intervals)
            assert [(interval.t_near, interval.t_far) for interval in intervals] == entry["intervals"]
            threads.idle.add(token["thread"])

    simulate(dut, act, until(lambda: not to_read, quiet=20), ticks=6_000, name="stack", background=(
        read_intervals, memory(dut.hit_address, dut.hit_distances, lambda thread: threads.distances[thread]),
        feed(dut.pop, threads.pops, rng=rng, gap=gap),
        drain(dut.resume, lambda resume: to_read.append(threads.resume(resume))),
        drain(dut.exhausted, threads.exhausted)))
    assert not threads.asked
    assert min(threads.events[event] for event in ("dropped", "resumed", "exhausted")) > 20


@pytest.mark.parametrize("cmp_latency", [0, 1, 3])
def test_pops_one_a_clock(cmp_latency):
    num_threads = 12
    dut = build(num_threads=num_threads, stack_depth=2, cmp_latency=cmp_latency)
    rng = random.Random(5)
    asked, answered = [], []
    now = 0

    async def clock(ctx):
        nonlocal now
        async for _ in ctx.tick():
            now += 1

    async def fill_and_pop(ctx):
        for thread in range(num_threads):
            entry = random_push(rng)
            ctx.set(dut.push, as_push(entry, {"thread": thread, "sp": 0, "mask": entry["mask"]}))
            await ctx.tick()
        ctx.set(dut.push.valid, 0)
        ctx.set(dut.pop.valid, 1)
        for thread in range(num_threads):
            ctx.set(dut.pop.payload, {"thread": thread, "sp": 1})
            asked.append((now, thread))
            assert ctx.get(dut.pop.ready)
            await ctx.tick()
        ctx.set(dut.pop.valid, 0)

    async def answers(ctx):
        while len(answered) < num_threads:
            if ctx.get(dut.resume.valid):
                answered.append((now, ctx.get(dut.resume.payload.token.thread)))
            await ctx.tick()

    simulate(dut, fill_and_pop, answers, background=[clock], name="stack")
    assert [thread for _, thread in answered] == list(range(num_threads))
    assert {end - begin for (begin, _), (end, _) in zip(asked, answered, strict=True)} == {4 + cmp_latency}


def test_overflow_is_noticed():
    dut = build(num_threads=2, stack_depth=3)

    async def push_too_many(ctx):
        for position in range(5):
            ctx.set(dut.push, {"valid": 1, "token": {"thread": 1, "sp": position}})
            await ctx.tick()

    with pytest.raises(AssertionError, match="a traversal stack overflows"):
        simulate(dut, push_too_many, name="stack")
