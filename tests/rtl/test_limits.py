"""Intersection of rays with limits: nearest and farthest distance, a triangle they do not hit, any hit that will do."""

import math
import random
from collections import Counter, deque

import pytest

from fpu import FloatFormat
from rtl.intersection import Intersection
from rtl.layout import PACKET_RAYS
from rtl.unit_triangle import GRAZING, MARGIN, MAX_MARGIN, MAX_TOLERANCE, REACH
from tests.bench import drain, feed, simulate
from tests.rtl.packets import fields, random_token, rays_of
from tests.rtl.rounded import Rounded, same
from tests.rtl.test_intersection import reference_test

FMT = FloatFormat(5, 8)
LATENCIES = {"add": 4, "mul": 2, "div": 6, "cmp": 1}
STACK_DEPTH, INDEX_WIDTH = 3, 8
#: Triangle that a ray has hit that has hit none; instance of a triangle that is in none.
NONE = (1 << INDEX_WIDTH) - 1
NUM_TRIANGLES = 3


def power(value):
    return 2.0 ** math.floor(math.log2(abs(value))) if value else 0.0


class World:
    """Rays with limits, the packets in triangles' spaces that they are tested in, and what they are to have hit."""

    def __init__(self, *, seed, num_threads, num_packets, near, tolerance=0):
        self.near = near
        self.tolerance = tolerance
        self.rng = random.Random(seed)
        self.arithmetic = Rounded(FMT)
        self.num_packets = num_packets
        self.limits, self.vectors, self.entered = deque(), deque(), deque()
        # Of each thread: limits by ray, records by ray, tests that are still to come, and its instance.
        self.rays, self.records = {}, {thread: {} for thread in range(num_threads)}
        # Of each thread, t of the soft hits that wait for another and whether they are loose, by ray and whether from
        # behind.
        self.soft = {}
        self.left = dict.fromkeys(range(num_threads), 0)
        self.instances, self.expected = {}, {}
        self.events = Counter()

    def begin(self, thread):
        """The limits of a packet's rays."""
        rng = self.rng
        self.num_packets -= 1
        self.left[thread] = rng.randrange(3, 7)
        self.rays[thread], self.records[thread], self.soft[thread] = {}, {}, {}
        for ray in rng.sample(range(PACKET_RAYS), rng.randrange(1, PACKET_RAYS + 1)):
            limits = {"t_near": rng.choice([0.0, 0.0, 0.5, 1.0, 1.5]),
                      "triangle": rng.choice([*range(NUM_TRIANGLES), NONE]),
                      "instance": rng.choice([*range(2), NONE, NONE]), "any_hit": rng.randrange(2)}
            has_far, t_far = rng.randrange(2), rng.choice([0.75, 1.0, 2.0, 3.5])
            self.limits.append({"thread": thread, "ray": ray, "has_far": has_far, "t_far": t_far, "limits": limits})
            self.rays[thread][ray] = limits
            if has_far:
                self.records[thread][ray] = {"t": t_far, "key": t_far, "triangle": NONE}

    def test(self, thread):
        """The packet in one triangle's space, some of its rays anyway."""
        rng = self.rng
        self.left[thread] -= 1
        rays, records = self.rays[thread], self.records[thread]
        mask = sum(1 << ray for ray in rng.sample(sorted(rays), rng.randrange(1, len(rays) + 1)))
        token = random_token(rng, thread=thread, stack_depth=STACK_DEPTH, mask=mask,
                             hit=sum(1 << ray for ray in records))
        index, solid, own = rng.randrange(NUM_TRIANGLES), rng.randrange(2), rng.randrange(2)
        instance = self.instances[thread] if token["level"] else NONE
        packet = {"token": token, "index": index, "solid": solid}
        numbers = rays_of(mask)
        origin = scale = None
        for ray in numbers:
            if origin is None or own:
                scales = [rng.choice([0, FMT.bias - 1, FMT.bias, FMT.bias, FMT.bias + 1]) for _ in range(3)]
                scale = {"scale": scales} if self.tolerance else {}
                origin = [rng.randrange(-4, 9) / 4 for _ in range(2)] + [rng.choice([-1, 1]) * rng.randrange(1, 16) / 4]
                self.vectors.append(packet | {"is_origin": 1, "ray": ray, "first": int(ray == numbers[0]), "last": 0,
                                              **scale, "vector": dict(zip("xyz", origin, strict=True))})
            target = rng.randrange(4) / 4, rng.randrange(3) / 4, 0.0
            if self.tolerance and rng.random() < 0.85:
                target = rng.choice([0.25, 0.5]), rng.choice([-1, -4, -6, -6, -6, -12, -100]) / 256, 0.0
            # t is how often this fits in, often one of the limits.
            times = rng.choice([1.0, 1.0, 2.0, 4 / 3, 0.5, 0.25, -1.0, *[1.0] * (6 if self.tolerance else 0)])
            direction = [self.arithmetic.round(times * (end - begin))
                         for end, begin in zip(target, origin, strict=True)]
            loss = rng.choice([0.0, 0.5, 1.0, 4.0])
            lost = [0, 0, FMT.bias + int(math.log2(loss * power(direction[2])))] if loss else [0, 0, 0]
            self.vectors.append(packet | {"is_origin": 0, "ray": ray, "first": int(ray == numbers[0]),
                                          "last": int(ray == numbers[-1]),
                                          **({"scale": lost} if self.tolerance else {}),
                                          "vector": dict(zip("xyz", direction, strict=True))})
            self.keep(thread, ray, index, instance, solid, origin, direction, token["level"], scales, loss)
        self.expected[thread] = token | {"hit": sum(1 << ray for ray in records)}

    @staticmethod
    def raised(t, units):
        """So many units in the last place farther."""
        return float(FMT.decode(FMT.encode(t) + units)) if 0 < t < math.inf else t

    @staticmethod
    def is_inside(u, v, total, edges):
        """Whether no edge is crossed by more than it gives."""
        return all(x >= 0 or -x < edge for x, edge in zip((u, v), edges, strict=True)) and (
            total <= 1 or total < 1 + max(edges))

    def join(self, thread, ray, t, key, direction, is_loose):
        """Whether a soft hit finds one that waits for it; else it may wait itself."""
        is_back, reach = math.copysign(1, direction[2]) < 0, int(REACH * 2**FMT.frac_width)
        waiting, other_is_loose = self.soft[thread].get((ray, is_back), (math.inf, False))
        if waiting <= self.raised(t, reach) and t <= self.raised(waiting, reach):
            if not (is_loose and other_is_loose):
                self.events["joined"] += 1
                self.events["one of two joined is loose"] += is_loose or other_is_loose
                return True
            self.events["both loose"] += 1
        if not key < self.records[thread].get(ray, {}).get("key", math.inf):
            self.events["alone and too far"] += 1
            return False
        self.events["waits"] += 1
        self.events["waits behind"] += waiting < t
        self.events["of another side"] += (ray, not is_back) in self.soft[thread]
        self.soft[thread][ray, is_back] = t, is_loose
        if ray not in self.records[thread]:
            self.records[thread][ray] = {"key": math.inf, "triangle": NONE}
        return False

    def keep(self, thread, ray, index, instance, solid, origin, direction, level, scales, loss):
        limits, records, events = self.rays[thread][ray], self.records[thread], self.events
        t, u, v, _ = reference_test(self.arithmetic, origin, direction)
        kept, total = records.get(ray, {}).get("key", math.inf), self.arithmetic.add(u, v)
        errors = [max(2.0 ** (scale - FMT.bias) if scale else 0.0, power(self.arithmetic.mul(t, way)) * loss)
                  for scale, way in zip(scales, direction[:2], strict=False)]
        is_firm = u >= 0 and v >= 0 and total <= 1
        times = 1 if loss > GRAZING else 2
        is_soft, is_close = (not is_firm and self.tolerance and self.is_inside(
            u, v, total, [min(units * error * 2.0**-FMT.frac_width, MAX_TOLERANCE) for error in errors])
            for units in (times * self.tolerance, self.tolerance))
        later = int(min(times * MARGIN * self.tolerance * loss, MAX_MARGIN * 2**FMT.frac_width))
        key = self.raised(t, later) if is_soft else t
        if not ((is_firm or is_soft) and t < math.inf):
            events["beside"] += 1
        elif not (limits["t_near"] if self.near else 0) < t:
            events["too near" if t > 0 else "behind"] += 1
            events["just too near"] += t == limits["t_near"] > 0
        elif (index, instance) == (limits["triangle"], limits["instance"]):
            events["excluded inside of an instance" if level else "excluded"] += 1
        elif is_soft and not self.join(thread, ray, t, key, direction, not is_close):
            pass
        elif not key < kept:
            events["over" if kept == 0 else "as far" if key == kept else "too far"] += 1
            events["beyond t_far"] += records[ray]["triangle"] == NONE
        else:
            over = solid and limits["any_hit"]
            events["is over" if over else "passes through" if limits["any_hit"] else "closest"] += 1
            events["excluded but for its instance"] += index == limits["triangle"]
            records[ray] = {"t": 0.0 if over else t, "key": 0.0 if over else key, "u": u, "v": v,
                            "cosine": direction[2], "triangle": index, "in_instance": level,
                            "instance": instance if level else None}


@pytest.mark.parametrize(("seed", "num_threads", "gap", "near", "tolerance"), [
    (0, 1, 0.0, True, 0), (1, 6, 0.3, True, 0), (2, 12, 0.0, True, 0), (3, 8, 0.0, False, 0), (4, 8, 0.2, True, 4),
    (5, 1, 0.0, False, 4)])
def test_limits(seed, num_threads, gap, near, tolerance):
    world = World(seed=seed, num_threads=num_threads, num_packets=180 if tolerance else 90, near=near,
                  tolerance=tolerance)
    rng = world.rng
    dut = Intersection(fmt=FMT, num_threads=num_threads, stack_depth=STACK_DEPTH, index_width=INDEX_WIDTH,
                       latencies=LATENCIES, limited=True, near=near, num_readers=2, tolerance=tolerance)
    tested = deque()
    accepted = Counter()
    idle, beginning = set(range(num_threads)), set()

    async def work(ctx):
        """Packets that are begun have their limits taken, then enter instances and are tested, again and again."""
        while world.num_packets or any(world.left.values()) or world.expected:
            ctx.set(dut.entered.valid, 0)
            for thread in [thread for thread in beginning if accepted[thread] == len(world.rays[thread])]:
                beginning.remove(thread)
                idle.add(thread)
                accepted[thread] = 0
            thread = rng.choice(sorted(idle)) if idle else None
            if thread is not None:
                if not world.left[thread]:
                    if world.num_packets:
                        world.begin(thread)
                        idle.remove(thread)
                        beginning.add(thread)
                elif thread not in world.instances or rng.random() < 0.4:
                    world.instances[thread] = rng.randrange(2)
                    ctx.set(dut.entered, {"valid": 1, "thread": thread, "index": world.instances[thread]})
                else:
                    world.test(thread)
                    idle.remove(thread)
            await ctx.tick()

    async def read_hits(ctx):
        while True:
            if not tested:
                await ctx.tick()
                continue
            token = tested.popleft()
            thread = token.thread
            assert fields(token) == world.expected[thread]
            ctx.set(dut.hit_address, thread)
            for ray, record in world.records[thread].items():
                reader = rng.randrange(2)
                ctx.set(dut.record_address[reader], {"thread": thread, "ray": ray})
                await ctx.tick().repeat(2)
                got = ctx.get(dut.record[reader])
                assert same(ctx.get(dut.hit_distances[ray]), record["key"])
                for name, expected in record.items():
                    if expected is not None and name != "key":
                        assert same(float(got[name]), float(expected)), name
                num_records[0] += 1
            del world.expected[thread]
            idle.add(thread)

    num_records = [0]
    simulate(dut, work, name="limits", ticks=50_000, background=(
        read_hits, feed(dut.limit, world.limits, rng=rng, gap=gap), log_accepted(dut, accepted),
        feed(dut.vector, world.vectors, rng=rng, gap=gap), drain(dut.tested, tested.append)))
    events = world.events
    for event in ("beside", "behind", "too near", "just too near", "excluded", "excluded inside of an instance",
                  "excluded but for its instance", "over", "as far", "too far", "beyond t_far", "is over",
                  "passes through", "closest"):
        assert events[event] > 2 or "near" in event, event
    assert min(events["too near"], events["just too near"]) > 2 if near else not events["too near"]
    assert num_records[0] > 200
    if tolerance:
        assert min(events[event] for event in ("of another side", "joined", "alone and too far", "waits",
                                              "waits behind", "one of two joined is loose", "both loose")) > 0


def log_accepted(dut, accepted):
    async def testbench(ctx):
        async for _, _, taken, thread in ctx.tick().sample(dut.limit.valid & dut.limit.ready, dut.limit.payload.thread):
            accepted[thread] += taken
    return testbench
