"""The rendezvous: when packets start, with which rays, and that each ray comes back once."""

import random
from collections import Counter, deque

import pytest

from fpu import FloatFormat
from rtl.layout import PACKET_RAYS, IntervalSource
from rtl.microcode import NO_TRIANGLE, Op, Program, lane_width
from rtl.rendezvous import Rendezvous
from tests.bench import Packed, drain, feed, simulate
from tests.rtl.packets import random_mask, random_token, rays_of

FMT = FloatFormat(5, 8)
STACK_DEPTH, RAY_STACK_DEPTH, INDEX_WIDTH = 3, 5, 24
PROGRAM = Program(({"op": Op.EMIT},) * 50, ())
NUM_PACKETS = 60
ANY_HIT, HAS_FAR, SAME_ORIGIN = 1, 2, 4


class Packets:
    """Packets of all threads: which of their rays run, which have stopped how, and which are to come back."""

    def __init__(self, rng, *, num_threads, threads, num_packets):
        self.rng = rng
        self.num_packets = num_packets
        self.begins, self.stops, self.packets = deque(), deque(), deque()
        self.running = [set() for _ in range(num_threads)]
        # Rays that have stopped to be traced, in the order of their stops: what they stopped with.
        self.traced = [{} for _ in range(num_threads)]
        # Of rays under way in the trace: their tokens.
        self.under_way = [{} for _ in range(num_threads)]
        self.age = [0] * num_threads
        # Those that are about to stop, at random.
        self.working = []
        self.tracing = []
        self.limits, self.colors = deque(), deque()
        self.events = Counter()
        for thread in threads:
            self.begin(thread)

    def begin(self, thread):
        if not self.num_packets:
            return
        self.num_packets -= 1
        self.age[thread] = 0
        self.begins.append({"thread": thread, "mask": random_mask(self.rng)})

    def begun(self, begin):
        assert not self.running[begin.thread]
        self.running[begin.thread] = set(rays_of(begin.mask))
        self.working += [(begin.thread, ray) for ray in rays_of(begin.mask)]

    def stop(self):
        """One of the rays at work stops."""
        rng = self.rng
        thread, ray = self.working.pop(rng.randrange(len(self.working)))
        token = {"thread": thread, "ray": ray, "counter": rng.randrange(50), "sp": rng.randrange(RAY_STACK_DEPTH + 1),
                 "hit": rng.randrange(2)}
        # Later on rays end more often.
        is_trace = rng.random() * 3 > self.age[thread] * 0.4
        a = [int(FMT.encode(rng.randrange(64) / 8)) for _ in range(3)]
        x = [rng.choice([NO_TRIANGLE, rng.getrandbits(24)]), rng.choice([NO_TRIANGLE, rng.getrandbits(24)]),
             rng.choice([3, 3, 3, 4])] if is_trace else [rng.getrandbits(lane_width(FMT)) for _ in range(3)]
        flags = rng.choice([SAME_ORIGIN, SAME_ORIGIN, SAME_ORIGIN, 0]) | rng.choice([ANY_HIT, 0]) \
            | rng.choice([HAS_FAR, 0])
        self.stops.append({"token": token, "is_trace": int(is_trace), "flags": flags, "a": a, "x": x})

    def stopped(self, stop):
        """A stop is accepted; what is to follow, a start or an end, or nothing."""
        thread, ray = stop.token.thread, stop.token.ray
        self.running[thread].remove(ray)
        if stop.is_trace:
            self.limits.append((thread, ray, stop))
            self.traced[thread][ray] = stop
        else:
            self.colors.append((thread, ray, list(stop.x)))
        if self.running[thread]:
            return None
        traced = self.traced[thread]
        if not traced:
            self.events["finished"] += 1
            return "finished", thread
        numbers = {stop.x[2] for stop in traced.values()}
        shared = all(stop.flags & SAME_ORIGIN for stop in traced.values()) and len(numbers) == 1
        self.events["shared" if shared else "of their own"] += 1
        self.events["alone"] += len(traced) == 1
        start = {"thread": thread, "level": 0, "mask": sum(1 << ray for ray in traced), "sp": 0,
                 "hit": sum(1 << ray for ray, stop in traced.items() if stop.flags & HAS_FAR),
                 "interval": IntervalSource.FRESH}
        return "start", start, int(shared)

    def started(self, start):
        """Traversal will take its time, and lose rays on the way."""
        rng, thread = self.rng, start["thread"]
        hit = start["hit"] | rng.randrange(16) & start["mask"]
        token = random_token(rng, thread=thread, stack_depth=STACK_DEPTH, hit=hit, level=0, sp=0)
        self.tracing.append(token)
        for ray, stop in self.traced[thread].items():
            self.under_way[thread][ray] = {"thread": thread, "ray": ray, "counter": stop.token.counter,
                                           "sp": stop.token.sp, "hit": hit >> ray & 1}
        self.running[thread] = set(self.traced[thread])
        self.traced[thread] = {}
        self.age[thread] += 1

    def came_back(self, ray):
        expected = self.under_way[ray.thread].pop(ray.ray)
        assert {name: ray[name] for name in expected} == expected
        self.working.append((ray.thread, ray.ray))
        self.events["came back"] += 1


@pytest.mark.parametrize(("seed", "num_threads", "gap", "pace", "bank_bits"), [
    (0, 1, 0.0, 1.0, 0), (1, 5, 0.0, 1.0, 0), (2, 16, 0.6, 0.5, 1), (3, 16, 0.2, 1.0, 0), (4, 2, 0.3, 1.0, 1)])
def test_rays_wait_for_each_other(seed, num_threads, gap, pace, bank_bits):
    rng = random.Random(seed)
    dut = Rendezvous(fmt=FMT, num_threads=num_threads, stack_depth=STACK_DEPTH, index_width=INDEX_WIDTH,
                     program=PROGRAM, ray_stack_depth=RAY_STACK_DEPTH, bank_bits=bank_bits)
    threads = range(rng.randrange(1 << bank_bits), num_threads, 1 << bank_bits)
    packets = Packets(rng, num_threads=num_threads, threads=threads, num_packets=NUM_PACKETS)
    read = Packed(dut.stop.payload.shape())

    def took_limit(limit):
        thread, ray, stop = packets.limits.popleft()
        assert (limit.thread, limit.ray, limit.has_far) == (thread, ray, stop.flags & HAS_FAR > 0)
        assert FMT.encode(float(limit.t_far)) == stop.a[1]
        limits = limit.limits
        assert FMT.encode(float(limits.t_near)) == stop.a[0]
        assert (limits.triangle, limits.instance) == (stop.x[0], stop.x[1])
        assert limits.any_hit == stop.flags & ANY_HIT

    async def log(ctx):
        """What follows a stop follows after the latency."""
        following = deque([None] * Rendezvous.latency)
        async for _, _, begins, begin, stops, stop, start, token, finished, thread, shared, ended in ctx.tick().sample(
                dut.begin.valid & dut.begin.ready, dut.begin.payload, dut.stop.valid & dut.stop.ready,
                dut.stop.payload.as_value(), dut.start.valid, dut.start.payload, dut.finished.valid,
                dut.finished.payload.thread, dut.shared, dut.ended):
            if begins:
                packets.begun(begin)
            following.append(packets.stopped(read.unpack(stop)) if stops else None)
            match following.popleft():
                case None:
                    assert not start
                    assert not finished
                    assert not shared.valid
                case ("finished", expected):
                    assert (start, finished, shared.valid, thread) == (0, 1, 0, expected)
                    packets.begin(expected)
                case ("start", expected, is_shared):
                    assert (start, finished) == (1, 0)
                    assert (shared.valid, shared.thread, shared.shared) == (1, expected["thread"], is_shared)
                    assert {name: token[name] for name in expected} == expected
                    packets.started(expected)
            assert ended.valid == bool(packets.colors)
            if ended.valid:
                assert (ended.thread, ended.ray, list(ended.color)) == packets.colors.popleft()

    async def work(ctx):
        while packets.events["finished"] < NUM_PACKETS:
            if packets.working and rng.random() < pace:
                packets.stop()
            if packets.tracing and rng.random() < 0.2:
                packets.packets.append(packets.tracing.pop(rng.randrange(len(packets.tracing))))
            ctx.set(dut.may_end, rng.random() >= gap)
            await ctx.tick()
        await ctx.tick().repeat(20)

    simulate(dut, work, name="rendezvous", background=(
        log, feed(dut.begin, packets.begins, rng=rng, gap=gap),
        drain(dut.limit, took_limit, rng=rng, gap=gap), drain(dut.ray, packets.came_back, rng=rng, gap=gap),
        feed(dut.stop, packets.stops, rng=rng, gap=gap), feed(dut.packet, packets.packets, rng=rng, gap=gap)))
    assert packets.events["finished"] == NUM_PACKETS
    assert not packets.limits
    assert not packets.colors
    assert min(packets.events[event] for event in ("shared", "of their own", "alone")) > 10
    assert packets.events["came back"] > 200


def test_a_ray_stops_each_cycle_and_comes_back_each_cycle():
    dut = Rendezvous(fmt=FMT, num_threads=4, stack_depth=STACK_DEPTH, index_width=INDEX_WIDTH, program=PROGRAM,
                     ray_stack_depth=RAY_STACK_DEPTH)
    starts, rays = [], []
    every_ray = [(thread, ray) for thread in range(4) for ray in range(PACKET_RAYS)]

    async def work(ctx):
        ctx.set(dut.limit.ready, 1)
        ctx.set(dut.ray.ready, 1)
        for thread in range(4):
            ctx.set(dut.begin.payload, {"thread": thread, "mask": 15})
            ctx.set(dut.begin.valid, 1)
            await ctx.tick()
        ctx.set(dut.begin.valid, 0)
        for thread, ray in every_ray:
            ctx.set(dut.stop.payload, {"token": {"thread": thread, "ray": ray}, "is_trace": 1})
            ctx.set(dut.stop.valid, 1)
            _, _, ready, start = await ctx.tick().sample(dut.stop.ready, dut.start.valid)
            assert ready
            starts.append(start)
        ctx.set(dut.stop.valid, 0)
        packets = 0
        while len(rays) < len(every_ray):
            ctx.set(dut.packet.payload, {"thread": packets, "mask": 1})
            ctx.set(dut.packet.valid, packets < 4)
            _, _, ready, valid, ray = await ctx.tick().sample(dut.packet.ready, dut.ray.valid, dut.ray.payload)
            packets += ready
            if valid:
                rays.append((ray.thread, ray.ray))
            cycles.append(valid)

    cycles = []
    simulate(dut, work, name="rendezvous", ticks=200)
    assert starts == ([0] * Rendezvous.latency + [0, 0, 0, 1] * 4)[:len(every_ray)]
    assert rays == every_ray
    assert cycles == [0] + [1] * len(every_ray)
