"""Write-out: pixels in order with their colours, whatever memory and receiver do."""

import math
import random
from collections import deque
from fractions import Fraction

import pytest
from amaranth.hdl import Module
from amaranth.lib.memory import Memory

from fpu import FloatFormat
from rtl.write_out import WriteOut
from tests.bench import drain, feed, memory, simulate, until
from tests.rtl.packets import fields, random_token
from tests.rtl.rounded import Rounded

FMT = FloatFormat(5, 8)
INDEX_WIDTH, COORD_WIDTH, STACK_DEPTH = 9, 6, 2
BACKGROUND = 0x123456


def reference_color(color, cosine):
    """Each channel times |cosine| cut to 8 fraction bits, at most 1, cut to a whole number."""
    light = 256 if abs(cosine) >= 1 else abs(Fraction(cosine)) * 256 // 1
    return sum(((color >> shift & 255) * int(light) >> 8) << shift for shift in (0, 8, 16))


def random_record(rng):
    arithmetic = Rounded(FMT)
    cosine = rng.choice([0.0, -0.0, 1.0, -1.0, math.inf, rng.uniform(-1.2, 1.2), arithmetic.any(rng)])
    return {"t": arithmetic.any(rng), "u": arithmetic.any(rng), "v": arithmetic.any(rng),
            "cosine": arithmetic.round(cosine), "triangle": rng.randrange(1 << INDEX_WIDTH),
            "instance": rng.randrange(1 << INDEX_WIDTH), "in_instance": rng.randrange(2)}


@pytest.mark.parametrize(("seed", "num_threads", "size", "gap", "latency"), [
    (0, 1, (16, 12), 0.0, 1), (1, 4, (17, 9), 0.4, 5), (2, 8, (1, 1), 0.0, 20), (3, 3, (31, 63), 0.7, 3)])
def test_pixels(seed, num_threads, size, gap, latency):
    rng = random.Random(seed)
    num_packets = 70
    colors = [rng.getrandbits(32) for _ in range(1 << INDEX_WIDTH)]
    m = Module()
    m.submodules.dut = dut = WriteOut(fmt=FMT, num_threads=num_threads, stack_depth=STACK_DEPTH,
                                      index_width=INDEX_WIDTH, coord_width=COORD_WIDTH)
    m.submodules.positions = positions = Memory(shape=dut.position.shape(), depth=num_threads, init=[])
    position = positions.read_port(domain="comb")
    m.d.comb += [position.addr.eq(dut.position_address), dut.position.eq(position.data)]

    idle = set(range(num_threads))
    records, given, expected, released, pixels = {}, [], [], [], []
    packets, requests, answers = deque(), deque(), deque()

    async def give_packets(ctx):
        ctx.set(dut.width, size[0])
        ctx.set(dut.height, size[1])
        ctx.set(dut.background, BACKGROUND)
        while len(given) < num_packets:
            if idle and rng.random() >= gap:
                thread = rng.choice(sorted(idle))
                idle.remove(thread)
                x, y = (2 * rng.randrange(-(-extent // 2)) for extent in size)
                ctx.set(positions.data[thread], {"x": x, "y": y})
                give(thread, x, y)
            await ctx.tick()

    def give(thread, x, y):
        token = random_token(rng, thread=thread, stack_depth=STACK_DEPTH)
        given.append(token)
        packets.append(token)
        for ray in range(4):
            records[thread, ray] = record = random_record(rng)
            at = x + ray % 2, y + ray // 2
            if at[0] < size[0] and at[1] < size[1]:
                is_hit = token["hit"] >> ray & 1
                color = reference_color(colors[record["triangle"]], record["cosine"])
                expected.append((*at, is_hit, record, color if is_hit else BACKGROUND))

    def release(token):
        assert fields(token) == given[len(released)]
        released.append(token.thread)
        idle.add(token.thread)

    def receive(pixel):
        x, y, is_hit, record, color = expected[len(pixels)]
        assert (pixel.x, pixel.y, pixel.is_hit, pixel.color) == (x, y, is_hit, color)
        if is_hit:
            assert {name: pixel.hit[name] for name in record} == record
        pixels.append(pixel)

    async def answer_requests(ctx):
        """In order, each ``latency`` cycles after its request at the earliest."""
        now = 0
        async for _ in ctx.tick():
            now += 1
            requests.extend((now + latency, colors[index]) for index in asked)
            asked.clear()
            if requests and requests[0][0] <= now:
                answers.append(requests.popleft()[1])

    async def check_idle(ctx):
        async for _, _, idle in ctx.tick().sample(dut.idle):
            if len(released) == num_packets:
                assert not idle or len(pixels) == len(expected)

    async def finish(ctx):
        await until(lambda: len(pixels) == len(expected) and len(released) == num_packets, quiet=30)(ctx)
        assert ctx.get(dut.idle)

    asked = []
    simulate(m, give_packets, finish, name="write_out", background=(
        answer_requests, memory(dut.record_address, dut.record, lambda at: records.get((at.thread, at.ray), {})),
        feed(dut.packet, packets, rng=rng, gap=gap), drain(dut.pixel, receive, rng=rng, gap=gap),
        # What it looks at is as of the cycle before only because it comes between these two.
        check_idle, drain(dut.finished, release),
        drain(dut.color_request, asked.append, rng=rng, gap=gap), feed(dut.color_data, answers, rng=rng)))
