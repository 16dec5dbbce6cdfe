"""Shaders running random programs, against an interpreter a ray at a time.

The units around it are the test's: a transformation that multiplies, caches and textures that answer with functions of
what they are asked, traversal that hits what the ray's number says. All of them take their time.
"""

import random
from collections import Counter, deque
from itertools import count

import pytest

from fpu import FloatFormat
from rtl.layout import IntervalSource
from rtl.microcode import NO_TRIANGLE, lane_width
from rtl.rendezvous import TraceFlag
from rtl.shaders import Shaders
from tests.bench import Packed, drain, feed, memory, simulate, steady, watch
from tests.rtl.colors import encoded_byte
from tests.rtl.packets import fields, random_token, rays_of
from tests.rtl.shader_rays import NUM_GENERATIONS, STACK_DEPTH, Interpreter, product, random_program

FMT = FloatFormat(5, 8)
TRAVERSAL_DEPTH, INDEX_WIDTH, COORD_WIDTH = 3, 24, 7


def bits(value):
    return int(FMT.encode(float(value)))


def record_of(number):
    """Six floats, six integers."""
    rng = random.Random(number)
    return [bits(rng.randrange(-64, 65) / 16) for _ in range(6)] + [rng.getrandbits(24) for _ in range(6)]


def texel_of(*request):
    rng = random.Random(repr(request))
    return [rng.randrange(65537) for _ in range(4)]


def plain(tag):
    return fields(tag) | {"token": fields(tag.token)}


class Slow:
    """Things that come out some cycles after they went in, in another order."""

    def __init__(self, rng, *, latency):
        self.rng, self.latency = rng, latency
        self.inside = []
        self.out = deque()

    def put(self, thing):
        self.inside.append((self.rng.randrange(1, self.latency + 1), thing))

    def tick(self):
        """At most one is done in a cycle."""
        self.inside = [(left - 1, thing) for left, thing in self.inside]
        done = next((number for number, (left, _) in enumerate(self.inside) if left <= 0), None)
        if done is not None:
            self.out.append(self.inside.pop(done)[1])


class World:
    """What is to come of each packet, and the units around the shader."""

    def __init__(self, *, seed, block, num_threads, num_packets, latency):
        self.rng = rng = random.Random(seed)
        self.program = random_program(seed, block=block)
        self.camera = [[rng.randrange(-64, 65) / 16 for _ in range(3)] for _ in range(4)]
        self.interpreter = Interpreter(FMT, self.program, camera=self.camera, record=record_of, texel=texel_of)
        self.num_packets = num_packets
        self.primaries = deque()
        self.stepped, self.loaded, self.texels, self.traced = (Slow(rng, latency=latency) for _ in range(4))
        self.shared = {}
        # By thread and ray: what it is to do, and its record; by thread: the round of tracing.
        self.outcomes, self.hits, self.records = {}, {}, {}
        self.rounds, self.masks = {}, {}
        self.pixels = {}
        self.places = {thread: (rng.randrange(60), rng.randrange(60)) for thread in range(num_threads)}
        self.events = Counter()
        self.num_instructions = 0
        for thread in range(num_threads):
            self.begin(thread)

    def begin(self, thread):
        if not self.num_packets:
            return
        self.num_packets -= 1
        rng = self.rng
        x, y = (rng.randrange(-(1 << COORD_WIDTH), 1 << COORD_WIDTH) for _ in range(2))
        token = random_token(rng, thread=thread, stack_depth=TRAVERSAL_DEPTH)
        self.primaries.append({"token": token, "x": x, "y": y})
        self.rounds[thread], self.masks[thread] = 0, token["mask"]
        for ray in rays_of(token["mask"]):
            hits = [None if rng.random() < 0.15 else self.random_hit() for _ in range(NUM_GENERATIONS)]
            outcome = self.interpreter.run([bits(x + 2 * (ray & 1)), bits(y - 2 * (ray >> 1)), bits(1)], hits)
            self.outcomes[thread, ray], self.hits[thread, ray] = outcome, hits
            self.num_instructions += outcome.num_instructions
            self.events.update(steps=len(outcome.steps), loads=len(outcome.loads), texels=len(outcome.texels),
                               traces=len(outcome.traces))
            self.events["most pushed"] = max(self.events["most pushed"], outcome.most_pushed)
            # The colours of packets that are done may still be waiting.
            self.pixels.setdefault(thread, []).append((ray, outcome.color))

    def random_hit(self):
        rng = self.rng
        return {**{name: rng.randrange(-64, 65) / 16 for name in ("t", "u", "v", "cosine")},
                "triangle": rng.randrange(NO_TRIANGLE), "instance": rng.getrandbits(24),
                "in_instance": rng.randrange(2)}

    def step(self, step):
        store, expected = self.outcomes[step.thread, step.ray].steps.pop(0)
        assert step.store == store
        rows = [[bits(row[axis]) for axis in "xyz"] for row in step.rows]
        result = product(FMT, rows, [bits(step.vector[axis]) for axis in "xyz"])
        assert result == expected
        self.stepped.put({"valid": 1, "tag": plain(step.tag),
                          "vector": {axis: float(FMT.decode(lane)) for axis, lane in zip("xyz", result, strict=True)}})

    def load(self, load):
        token = load.payload.token
        number = self.outcomes[token.thread, token.ray].loads.pop(0)
        assert load.index == number
        width = lane_width(FMT)
        item = sum(lane << width * place for place, lane in enumerate(record_of(number)))
        self.loaded.put({"item": item, "payload": plain(load.payload)})

    def texel(self, request):
        token = request.payload.token
        s, t, base, sides = self.outcomes[token.thread, token.ray].texels.pop(0)
        assert (bits(request.s), bits(request.t), request.base) == (s, t, base)
        assert (request.log2_width, request.log2_height) == (sides & 15, sides >> 4 & 15)
        assert (request.filtered, request.folded) == (sides >> 8 & 1, sides >> 9 & 1)
        *color, opacity = texel_of(s, t, base, sides)
        self.texels.put({"color": color, "opacity": opacity, "payload": plain(request.payload)})

    def limit(self, limit):
        thread, ray = limit.thread, limit.ray
        expected, limits = self.outcomes[thread, ray].traces[self.rounds[thread]], limit.limits
        assert (bits(limits.t_near), bits(limit.t_far)) == (expected["t_near"], expected["t_far"])
        assert (limits.triangle, limits.instance) == (expected["triangle"], expected["instance"])
        assert (limits.any_hit, limit.has_far) == (expected["flags"] >> TraceFlag.ANY_HIT & 1,
                                                   expected["flags"] >> TraceFlag.HAS_FAR & 1)

    def start(self, start):
        thread, generation = start.thread, self.rounds[start.thread]
        traces = {ray: self.outcomes[thread, ray].traces[generation] for ray in rays_of(self.masks[thread])
                  if generation < len(self.outcomes[thread, ray].traces)}
        has_far = sum(1 << ray for ray, trace in traces.items() if trace["flags"] >> TraceFlag.HAS_FAR & 1)
        assert start.mask == sum(1 << ray for ray in traces)
        assert (start.level, start.sp, start.interval, start.hit) == (0, 0, IntervalSource.FRESH, has_far)
        shared = all(trace["flags"] >> TraceFlag.SAME_ORIGIN & 1 for trace in traces.values()) \
            and len({trace["number"] for trace in traces.values()}) == 1
        assert self.shared.pop(thread) == shared
        self.events["packets traced"] += 1
        hit = 0
        for ray in traces:
            record = self.hits[thread, ray][generation]
            if record is not None:
                self.records[thread, ray] = record
            elif has_far >> ray & 1:
                self.records[thread, ray] = self.random_hit() | {"triangle": NO_TRIANGLE}
            hit |= (record is not None or has_far >> ray & 1) << ray
        # On the way, rays that cannot gain are left out.
        token = random_token(self.rng, thread=thread, stack_depth=TRAVERSAL_DEPTH, hit=hit, level=0)
        self.traced.put(token)

    def packet_taken(self, token):
        self.rounds[token.thread] += 1

    def finished(self, token):
        thread = token.thread
        for ray in rays_of(self.masks[thread]):
            outcome = self.outcomes[thread, ray]
            assert not outcome.steps + outcome.loads + outcome.texels
            assert len(outcome.traces) <= self.rounds[thread]
        self.events["finished"] += 1
        self.begin(thread)

    def pixel(self, pixel):
        thread = next(thread for thread, (x, y) in self.places.items() if pixel.x - x in (0, 1) and
                      pixel.y - y in (0, 1) and any(ray == (pixel.x - x) + 2 * (pixel.y - y)
                                                    for ray, _ in self.pixels.get(thread, ())))
        x, y = self.places[thread]
        ray = pixel.x - x + 2 * (pixel.y - y)
        # A thread's packets end one after the other.
        place = next(place for place, (number, _) in enumerate(self.pixels[thread]) if number == ray)
        _, color = self.pixels[thread].pop(place)
        shown = [pixel.color >> shift & 255 for shift in (16, 8, 0)]
        assert all(abs(byte - encoded_byte(lane)) <= 1 for byte, lane in zip(shown, color, strict=True))
        assert not pixel.is_hit
        self.events["pixels"] += 1
        self.events["gray"] += len(set(shown)) == 1


@pytest.mark.parametrize(("seed", "block", "num_threads", "gap", "latency", "num_shaders"), [
    (0, 6, 1, 0.0, 4, 1), (1, 8, 4, 0.3, 30, 1), (2, 8, 8, 0.2, 3, 2), (3, 12, 5, 0.7, 12, 1), (4, 4, 8, 0.0, 90, 4)])
def test_random_programs(seed, block, num_threads, gap, latency, num_shaders):
    num_packets = max(5, num_threads + 2)
    world = World(seed=seed, block=block, num_threads=num_threads, num_packets=num_packets, latency=latency)
    rng = random.Random(100 + seed)
    dut = Shaders(fmt=FMT, num_threads=num_threads, stack_depth=TRAVERSAL_DEPTH, index_width=INDEX_WIDTH,
                  coord_width=COORD_WIDTH, program=world.program, ray_stack_depth=STACK_DEPTH, offset_log2=3,
                  num_shaders=num_shaders)

    stepped = Packed(dut.stepped.shape())

    async def work(ctx):
        ctx.set(dut.camera, {"rows": [dict(zip("xyz", row, strict=True)) for row in world.camera[:3]],
                             "origin": dict(zip("xyz", world.camera[3], strict=True))})
        for now in count():
            for unit in (world.stepped, world.loaded, world.texels, world.traced):
                unit.tick()
            done = world.stepped.out.popleft() if world.stepped.out else None
            ctx.set(dut.stepped.as_value(), 0 if done is None else stepped.pack(done))
            _, _, busy, idle = await ctx.tick().sample(dut.busy, dut.idle)
            world.events["instructions"] += busy
            waits = any(world.pixels.values())
            if world.events["finished"] == num_packets and not waits and idle and now > 100:
                break
        await ctx.tick().repeat(50)

    def position(number):
        async def testbench(ctx):
            while True:
                x, y = world.places.get(ctx.get(dut.position_address[number]), (0, 0))
                ctx.set(dut.position[number], {"x": x, "y": y})
                await ctx.changed(dut.position_address[number])
        return testbench

    async def never_idle_with_pixels(ctx):
        async for _, _, valid, idle in ctx.tick().sample(dut.pixel.valid, dut.idle):
            assert not (valid and idle)

    async def log_packets(ctx):
        async for _, _, taken, token in ctx.tick().sample(dut.packet.valid & dut.packet.ready, dut.packet.payload):
            if taken:
                world.packet_taken(token)

    slow = dict(rng=rng, gap=gap)
    simulate(dut, work, name="shader", ticks=60_000, background=(
        *map(steady, (dut.step, dut.load, dut.texture, dut.limit, dut.pixel)),
        *map(position, range(num_shaders)), never_idle_with_pixels, log_packets,
        watch(dut.shared, lambda shared: world.shared.update({shared.thread: shared.shared})),
        *(memory(address, record, lambda at: world.records.get((at.thread, at.ray), {}))
          for address, record in zip(dut.record_address, dut.record, strict=True)),
        drain(dut.step, world.step, **slow), drain(dut.load, world.load, **slow),
        drain(dut.texture, world.texel, **slow), drain(dut.limit, world.limit, **slow),
        drain(dut.pixel, world.pixel, **slow), drain(dut.start, world.start), drain(dut.finished, world.finished),
        feed(dut.primary, world.primaries, **slow), feed(dut.loaded, world.loaded.out, **slow),
        feed(dut.texel, world.texels.out, **slow), feed(dut.packet, world.traced.out, **slow)))
    events = world.events
    assert events["instructions"] == world.num_instructions
    assert events["finished"] == num_packets
    assert events["pixels"] > num_packets
    assert min(events["steps"], events["traces"], events["loads"], events["texels"]) > 10
    assert events["packets traced"] >= num_packets
