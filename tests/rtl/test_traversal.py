"""Traversal against kd-steps in rounded float64, many packets at a time, a step a clock."""

import math
import random
from collections import Counter, deque

import pytest

from fpu import FloatFormat
from rtl.layout import PACKET_RAYS, Axis, IntervalSource
from rtl.traversal import Traversal
from tests.bench import drain, feed, memory, simulate, until, watch
from tests.rtl.packets import fields, random_mask, random_token, rays_of
from tests.rtl.rounded import Rounded

FMT = FloatFormat(5, 8)
LATENCIES = {"add": 4, "div": 8, "cmp": 1}
INDEX_WIDTH, STACK_DEPTH = 10, 6
FRESH = [(0.0, math.inf)] * PACKET_RAYS


def reference_step(split, origin, direction, interval):
    """The intervals on which a ray visits the lower and the upper child; None where it does not."""
    t_near, t_far = interval
    arithmetic = Rounded(FMT)
    offset = arithmetic.sub(split, origin)
    if direction == 0:
        return (interval if offset >= 0 else None), (interval if offset <= 0 else None)
    t = arithmetic.div(offset, direction)
    first = (t_near, min(t, t_far)) if t_near <= t else None
    second = (max(t, t_near), t_far) if t <= t_far else None
    return (first, second) if direction > 0 else (second, first)


def reference_packet(token, node, rays, intervals):
    """What becomes of a packet: (rays that go on, upper child, intervals), the same of what is put off, or None."""
    visits = [{}, {}]
    for ray in rays_of(token["mask"]):
        steps = reference_step(node["split"], *rays[ray], intervals[ray])
        for child, interval in enumerate(steps):
            if interval is not None and not node["empty"][child]:
                visits[child][ray] = interval
    leader = rays[rays_of(token["mask"])[0]]
    order = (1, 0) if math.copysign(1.0, leader[1]) < 0 else (0, 1)
    return [(child, visits[child]) for child in order if visits[child]]


class World:
    """Nodes, rays and intervals at random, and what the unit is to make of them."""

    def __init__(self, *, seed, num_threads, num_steps):
        self.rng = random.Random(seed)
        self.arithmetic = Rounded(FMT)
        self.num_steps = num_steps
        self.nodes = deque()
        self.rays = {}
        self.popped = {}
        self.stepped = {}
        self.expected = {}
        self.pushed = {}
        self.events = Counter()
        self.leaves = deque()
        for thread in range(num_threads):
            self.visit(thread)

    def coordinate(self):
        """Mostly small multiples of 1/4, so that planes run through origins and distances coincide."""
        rng = self.rng
        return rng.choice([rng.randrange(-8, 9) / 4, rng.randrange(-8, 9) / 4, 0.0, -0.0, self.arithmetic.any(rng)])

    def interval(self):
        rng = self.rng
        t_near = rng.choice([0.0, rng.randrange(8) / 4, abs(self.arithmetic.any(rng))])
        return t_near, max(t_near, rng.choice([math.inf, rng.randrange(12) / 4, abs(self.arithmetic.any(rng))]))

    def visit(self, thread, token=None):
        """Lets the thread visit a node: the one its token tells, else any."""
        rng = self.rng
        if self.num_steps == 0:
            return
        self.num_steps -= 1
        if token is None or token["sp"] == STACK_DEPTH:
            level = rng.randrange(2)
            place = rng.choice([IntervalSource.FRESH, IntervalSource.POP])
            token = random_token(rng, thread=thread, stack_depth=STACK_DEPTH - 1, level=level, interval=place)
            self.rays[thread, level] = [[(self.coordinate(), self.coordinate()) for _ in range(3)]
                                        for _ in range(PACKET_RAYS)]
            self.popped[thread] = [self.interval() for _ in range(PACKET_RAYS)]
        axis = rng.choice([Axis.X, Axis.Y, Axis.Z])
        node = {"split": self.coordinate(), "child": 2 * rng.randrange(1 << INDEX_WIDTH - 1),
                "empty": [rng.random() < 0.15, rng.random() < 0.15]}
        rays = [ray[axis.value] for ray in self.rays[thread, token["level"]]]
        intervals = {IntervalSource.FRESH: FRESH, IntervalSource.STEP: self.stepped.get(thread),
                     IntervalSource.POP: self.popped.get(thread)}[token["interval"]]
        self.expected[thread] = token, node, reference_packet(token, node, rays, intervals)
        self.nodes.append({"item": self.item(axis, **node), "payload": token})

    @staticmethod
    def item(axis, split, child, empty):
        return int(FMT.encode(split)) << 32 | empty[1] << 27 | empty[0] << 26 | axis.value << 24 | child

    def read_rays(self, at):
        rays = self.rays.get((at.thread, at.level))
        if rays is None or at.axis == Axis.LEAF:
            return [{"origin": 1.0, "direction": 1.0}] * PACKET_RAYS
        return [dict(zip(("origin", "direction"), ray[at.axis.value], strict=True)) for ray in rays]

    def read_popped(self, thread):
        intervals = self.popped.get(thread, FRESH)
        return [dict(zip(("t_near", "t_far"), interval, strict=True)) for interval in intervals]

    def push(self, push):
        assert push.token.thread not in self.pushed
        self.pushed[push.token.thread] = push

    def child(self, child):
        token, node, (first, *put_off) = self.expected.pop(child.token.thread)
        upper, visits = first
        after = token | {"mask": sum(1 << ray for ray in visits), "sp": token["sp"] + len(put_off),
                         "interval": IntervalSource.STEP}
        assert fields(child.token) == after
        assert child.node == node["child"] + upper
        push = self.pushed.pop(token["thread"], None)
        assert (push is not None) == bool(put_off)
        if put_off:
            upper, put_off = put_off[0]
            assert fields(push.token) == token | {"mask": sum(1 << ray for ray in put_off)}
            assert push.node == node["child"] + upper
            for ray, interval in put_off.items():
                assert (push.intervals[ray].t_near, push.intervals[ray].t_far) == interval
            self.events["both"] += 1
        # Intervals of the other rays are anything; no ray that is left out comes back before a pop.
        self.stepped[token["thread"]] = [visits.get(ray) for ray in range(PACKET_RAYS)]
        self.events["child"] += 1
        self.visit(token["thread"], after)

    def pop(self, pop):
        token, _, visits = self.expected.pop(pop.thread)
        assert not visits
        assert fields(pop) == token
        self.events["none"] += 1
        self.visit(token["thread"])


def run(world, *, num_threads, gap, latencies=LATENCIES):
    dut = Traversal(fmt=FMT, num_threads=num_threads, stack_depth=STACK_DEPTH, index_width=INDEX_WIDTH,
                    latencies=latencies)
    num_steps = world.num_steps + len(world.nodes)

    async def count_busy(ctx):
        async for _, _, busy in ctx.tick().sample(dut.busy):
            world.events["busy"] += busy
            world.events["cycles"] += 1

    simulate(dut, until(lambda: not world.num_steps and not world.expected, quiet=20), ticks=10 * num_steps,
             name="traversal", background=(
                 memory(dut.step_address, dut.step_rays, world.read_rays),
                 memory(dut.popped_address, dut.popped_intervals, world.read_popped),
                 # What is put off is looked at before what goes on.
                 watch(dut.push, world.push), drain(dut.child, world.child), drain(dut.pop, world.pop), count_busy,
                 feed(dut.node, world.nodes, rng=world.rng, gap=gap)))
    assert not world.pushed
    assert world.events["busy"] == num_steps
    return world.events


@pytest.mark.parametrize("seed", range(3))
def test_steps(seed):
    num_threads = (5, 16, 24)[seed]
    world = World(seed=seed, num_threads=num_threads, num_steps=300)
    events = run(world, num_threads=num_threads, gap=0.2 * seed)
    assert min(events["both"], events["none"], events["child"] - events["both"]) > 20


@pytest.mark.parametrize("latencies", [
    {"add": 0, "div": 0, "cmp": 0, "select": 1}, {"add": 1, "div": 9, "cmp": 2}, None])
def test_latencies_of_operators(latencies):
    run(World(seed=7, num_threads=7, num_steps=120), num_threads=7, gap=0.1, latencies=latencies)


def test_a_step_a_clock():
    world = World(seed=9, num_threads=32, num_steps=600)
    events = run(world, num_threads=32, gap=0.0)
    assert events["cycles"] < 600 + 40


def test_leaves_pass():
    rng = random.Random(3)
    dut = Traversal(fmt=FMT, num_threads=4, stack_depth=STACK_DEPTH, index_width=INDEX_WIDTH, latencies=LATENCIES)
    sent = [(random_token(rng, thread=rng.randrange(4), stack_depth=STACK_DEPTH, mask=random_mask(rng)),
             rng.randrange(1 << INDEX_WIDTH)) for _ in range(40)]
    nodes = deque({"item": rng.getrandbits(38) << 26 | Axis.LEAF.value << 24 | place, "payload": token}
                  for token, place in sent)
    leaves = []

    def nothing(_):
        raise AssertionError("a leaf became something else")

    simulate(dut, until(lambda: len(leaves) == len(sent), quiet=30), name="traversal", background=(
        feed(dut.node, nodes, rng=rng, gap=0.3),
        drain(dut.leaf, lambda leaf: leaves.append((fields(leaf.token), leaf.list))),
        drain(dut.child, nothing), drain(dut.pop, nothing), watch(dut.push, nothing)))
    assert leaves == sent
