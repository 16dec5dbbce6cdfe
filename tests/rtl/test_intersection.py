"""Intersection against the unit triangle in rounded float64: hits, misses, ties, edges, and what is kept."""

import math
import random
from collections import Counter, deque

import pytest

from fpu import FloatFormat
from rtl.intersection import Intersection
from rtl.layout import PACKET_RAYS
from tests.bench import drain, feed, simulate, until
from tests.rtl.packets import fields, random_token, rays_of
from tests.rtl.rounded import Rounded, same

FMT = FloatFormat(5, 8)
LATENCIES = {"add": 4, "mul": 2, "div": 6, "cmp": 1}
STACK_DEPTH, INDEX_WIDTH = 3, 8


def reference_test(arithmetic, origin, direction):
    """t, u, v and whether it is a hit."""
    t = -arithmetic.div(origin[2], direction[2])
    u, v = (arithmetic.add(origin[axis], arithmetic.mul(t, direction[axis])) for axis in range(2))
    return t, u, v, 0 < t < math.inf and u >= 0 and v >= 0 and arithmetic.add(u, v) <= 1


class World:
    """Packets in triangles' spaces, and the hits that each ray is to have kept."""

    def __init__(self, *, seed, num_threads, num_packets):
        self.rng = random.Random(seed)
        self.arithmetic = Rounded(FMT)
        self.num_packets = num_packets
        self.vectors = deque()
        self.expected = {}
        # Of each thread, its rays' hits; and the instance that it is in.
        self.hits = {thread: {} for thread in range(num_threads)}
        self.instances = {}
        self.events = Counter()

    def scalar(self):
        rng = self.rng
        return rng.choice([*(rng.randrange(-4, 9) / 4 for _ in range(5)), 0.0, -0.0, self.arithmetic.any(rng)])

    def hit_on_edge(self, origin):
        """A direction to a point whose barycentric coordinates lie on or next to an edge."""
        rng = self.rng
        u = rng.choice([0.0, 0.25, 0.5, 1.0])
        v = rng.choice([0.0, 1 - u, 1 - u, rng.randrange(5) / 4])
        target = [x + rng.choice([0, 0, 2 ** -8, -2 ** -8]) for x in (u, v)]
        scale = rng.choice([0.5, 1.0, 2.0])
        ends = zip((*target, 0.0), origin, strict=True)
        return [self.arithmetic.round(scale * (end - begin)) for end, begin in ends]

    def begin(self, thread):
        """Gives a packet to the thread, which may have left all its hits behind."""
        rng = self.rng
        if self.num_packets == 0:
            return
        self.num_packets -= 1
        hits = self.hits[thread]
        if rng.random() < 0.2:
            hits.clear()
        token = random_token(rng, thread=thread, stack_depth=STACK_DEPTH, hit=sum(1 << ray for ray in hits))
        index = rng.randrange(1 << INDEX_WIDTH)
        origin = [rng.randrange(-4, 9) / 4 if rng.random() < 0.9 else self.scalar() for _ in range(3)]
        packet = {"token": token, "index": index}
        self.vectors.append(packet | {"is_origin": 1, "ray": 0, "last": 0, "vector": self.vector(origin)})
        rays = rays_of(token["mask"])
        for ray in rays:
            direction = self.hit_on_edge(origin) if rng.random() < 0.75 else [self.scalar() for _ in range(3)]
            self.vectors.append(packet | {"is_origin": 0, "ray": ray, "first": ray == rays[0],
                                          "last": ray == rays[-1], "vector": self.vector(direction)})
            t, u, v, is_hit = reference_test(self.arithmetic, origin, direction)
            if not is_hit:
                self.events["miss"] += 1
            elif ray in hits and not t < hits[ray]["t"]:
                self.events["tie" if t == hits[ray]["t"] else "farther"] += 1
            else:
                self.events["nearer" if ray in hits else "first"] += 1
                hits[ray] = {"t": t, "u": u, "v": v, "cosine": direction[2], "triangle": index,
                             "in_instance": token["level"], "instance": self.instances.get(thread)}
        self.events["edge"] += sum(hit["u"] == 0 or hit["v"] == 0 or hit["u"] + hit["v"] == 1 for hit in hits.values())
        self.expected[thread] = token | {"hit": sum(1 << ray for ray in hits)}

    @staticmethod
    def vector(values):
        return dict(zip("xyz", values, strict=True))


def run(world, *, num_threads, gap, latencies=LATENCIES):
    dut = Intersection(fmt=FMT, num_threads=num_threads, stack_depth=STACK_DEPTH, index_width=INDEX_WIDTH,
                       latencies=latencies)
    tested = deque()
    idle = set(range(num_threads))
    num_rays = 0

    async def enter(ctx):
        """Threads that are idle enter instances at random, then take their next packet."""
        while True:
            ctx.set(dut.entered.valid, 0)
            thread = world.rng.choice(sorted(idle)) if idle else None
            if thread is not None and world.rng.random() < 0.5:
                index = world.rng.randrange(1 << INDEX_WIDTH)
                world.instances[thread] = index
                ctx.set(dut.entered, {"valid": 1, "thread": thread, "index": index})
            elif thread in world.instances:
                idle.remove(thread)
                world.begin(thread)
            await ctx.tick()

    async def read_hits(ctx):
        """From the cycle after the packet was tested on."""
        while world.num_packets or world.expected:
            if not tested:
                await ctx.tick()
                continue
            token = tested.popleft()
            thread = token.thread
            assert fields(token) == world.expected.pop(thread)
            ctx.set(dut.hit_address, thread)
            for ray in range(PACKET_RAYS + 1):
                ctx.set(dut.record_address[0], {"thread": thread, "ray": ray % PACKET_RAYS})
                await ctx.tick()
                if ray and ray - 1 in world.hits[thread]:
                    await check_record(ctx, thread, ray - 1)
            idle.add(thread)

    async def check_record(ctx, thread, ray):
        expected = world.hits[thread][ray]
        record = ctx.get(dut.record[0])
        assert same(ctx.get(dut.hit_distances[ray]), expected["t"])
        for name in ("t", "u", "v", "cosine"):
            assert same(record[name], expected[name])
        assert record.triangle == expected["triangle"]
        assert record.in_instance == expected["in_instance"]
        assert not record.in_instance or record.instance == expected["instance"]

    async def count_busy(ctx):
        nonlocal num_rays
        async for _, _, busy in ctx.tick().sample(dut.busy):
            num_rays += busy

    simulate(dut, read_hits, until(lambda: True, quiet=20), ticks=40 * world.num_packets, name="intersection",
             background=(enter, count_busy, feed(dut.vector, world.vectors, rng=world.rng, gap=gap),
                         drain(dut.tested, tested.append)))
    assert not tested
    assert num_rays == sum(world.events[event] for event in ("miss", "tie", "farther", "nearer", "first"))
    return world.events


@pytest.mark.parametrize(("seed", "num_threads", "gap"), [(0, 1, 0.0), (1, 5, 0.3), (2, 8, 0.0)])
def test_closest_hits(seed, num_threads, gap):
    events = run(World(seed=seed, num_threads=num_threads, num_packets=120), num_threads=num_threads, gap=gap)
    assert min(events[event] for event in ("miss", "tie", "farther", "nearer", "first", "edge")) > 3


@pytest.mark.parametrize("latencies", [{"add": 0, "mul": 0, "div": 2, "cmp": 0}, None])
def test_latencies_of_operators(latencies):
    run(World(seed=4, num_threads=3, num_packets=30), num_threads=3, gap=0.2, latencies=latencies)


@pytest.mark.parametrize(("origin", "direction", "is_hit"), [
    ((0.0, 0.25, 1.0), (0.0, 0.0, -1.0), True),            # u = 0
    ((-0.0, 0.25, 1.0), (-0.0, 0.0, -1.0), True),          # u = -0
    ((0.25, 0.0, 1.0), (0.0, 0.0, -1.0), True),            # v = 0
    ((0.25, 0.75, 1.0), (0.0, 0.0, -1.0), True),           # u + v = 1
    ((0.25, 0.75390625, 1.0), (0.0, 0.0, -1.0), False),    # the next number
    ((-2.0 ** -14, 0.25, 1.0), (0.0, 0.0, -1.0), False),   # the largest number below zero
    ((0.25, 0.25, 1.0), (0.0, 0.0, 1.0), False),           # behind the origin
    ((0.25, 0.25, 0.0), (0.0, 0.0, -1.0), False),          # t = 0
    ((0.25, 0.25, -0.0), (0.0, 0.0, -1.0), False),
    ((0.25, 0.25, 1.0), (0.0, 0.0, 0.0), False),           # along the triangle: t = ∞ of either sign
    ((0.25, 0.25, 1.0), (0.0, 0.0, -0.0), False),
    ((0.25, 0.25, 0.0), (0.0, 0.0, 0.0), False),           # in its plane
    ((0.25, 0.25, 1.0), (0.0, 0.0, -2.0 ** -14), True),    # t as large as can be
    ((0.25, 0.25, 4.0), (0.0, 0.0, -2.0 ** -14), False),   # overflows
])
def test_edges_and_limits(origin, direction, is_hit):
    dut = Intersection(fmt=FMT, num_threads=1, stack_depth=1, index_width=8, latencies=LATENCIES)
    token = {"thread": 0, "hit": 0, "mask": 1}
    vectors = deque({"token": token, "is_origin": is_origin, "first": 1 - is_origin, "last": 1 - is_origin,
                     "vector": World.vector(vector)} for is_origin, vector in ((1, origin), (0, direction)))
    tested = []
    simulate(dut, until(lambda: tested), background=(
        feed(dut.vector, vectors, rng=random.Random(0)), drain(dut.tested, tested.append)), ticks=100, name="edges")
    assert [token.hit for token in tested] == [int(is_hit)]
