"""The texture unit against exact fractions, with gaps on every side and a memory of random latency."""

import random
from collections import deque

import pytest
from amaranth.hdl import Value

from fpu import FloatFormat
from rtl.texel_address import TexturePlace
from rtl.texture import Texture
from tests.bench import drain, feed, simulate, until
from tests.rtl import textures

SIZES = [(1, 1), (1, 8), (8, 1), (2, 2), (64, 16), (4, 32)]


class Stored:
    """Some textures one after the other in a memory."""

    def __init__(self, sizes, *, fmt, rng):
        self.words, self._kept = [rng.getrandbits(32) for _ in range(12)], []
        for width, height in sizes:
            pixels = [[tuple(rng.getrandbits(8) for _ in range(4)) for _ in range(width)] for _ in range(height)]
            places = [textures.interesting_coordinates(fmt, side, rng, 300) for side in (width, height)]
            self._kept.append((len(self.words), pixels, places))
            self.words += textures.packed_words(pixels)

    def request(self, rng, *, number, payload, filtered, folded=False):
        """A lookup in texture ``number``, and its answer."""
        base, pixels, places = self._kept[number]
        s, t = map(rng.choice, places)
        *color, opacity = textures.look_up(pixels, s, t, filtered=filtered, folded=folded)
        sides = {"log2_width": len(pixels[0]).bit_length() - 1, "log2_height": len(pixels).bit_length() - 1}
        return ({"s": s, "t": t, "base": base, **sides, "filtered": int(filtered), "folded": int(folded),
                 "payload": payload}, (*color, opacity, payload))

    def requests(self, rng, count, sizes):
        """Lookups of all kinds."""
        given = []
        for payload in range(count):
            number = rng.randrange(len(sizes))
            folded = sizes[number][0] == sizes[number][1] and rng.random() < 0.5
            given.append(self.request(rng, number=number, payload=payload, filtered=rng.random() < 0.7, folded=folded))
        return given


def answered(response):
    return *(response.color[channel] for channel in range(3)), response.opacity, response.payload


def memory_of(dut, words, *, line_items, rng, gap=0.0, latency=1):
    """Background testbenches: lines in order, each up to ``latency`` cycles after its request; and their list."""
    asked, lines, answers = [], [], deque()

    def ask(line):
        asked.append((rng.randrange(latency), line))
        lines.append(line)

    async def wait(ctx):
        now, pending = 0, deque()
        async for _ in ctx.tick():
            now += 1
            pending.extend((now + delay, line) for delay, line in asked)
            asked.clear()
            while pending and pending[0][0] <= now:
                first = pending.popleft()[1] * line_items
                answers.extend((words[first:first + line_items] + [0] * line_items)[:line_items])

    return lines, (wait, drain(dut.line_request, ask, rng=rng, gap=gap), feed(dut.line_data, answers, rng=rng, gap=gap))


def check(dut, words, given, *, line_items, rng, gap=0.0, latency=1, ticks=None):
    """Gives requests and compares answers; returns the lines asked for."""
    got = []
    lines, memory = memory_of(dut, words, line_items=line_items, rng=rng, gap=gap, latency=latency)
    simulate(dut, until(lambda: len(got) == len(given), quiet=40), name="texture", background=(
        *memory, feed(dut.request, deque(request for request, _ in given), rng=rng, gap=gap),
        drain(dut.response, lambda response: got.append(answered(response)), rng=rng, gap=gap)),
        ticks=ticks or 500 + len(given) * (40 + 10 * latency))
    assert sorted(got, key=lambda answer: answer[-1]) == [answer for _, answer in given]
    return lines


@pytest.mark.parametrize(("seed", "fmt", "num_slots", "line_items", "num_lines", "num_fetches", "gap", "latency"), [
    (0, FloatFormat(7, 16), 16, 4, 128, 4, 0.0, 1), (1, FloatFormat(7, 16), 8, 8, 16, 2, 0.3, 12),
    (2, FloatFormat(5, 8), 2, 4, 4, 1, 0.6, 30), (3, FloatFormat(8, 23), 4, 4, 2, 3, 0.0, 40),
    (4, FloatFormat(7, 16), 32, 8, 8, 4, 0.8, 3)])
def test_lookups(seed, fmt, num_slots, line_items, num_lines, num_fetches, gap, latency):
    rng = random.Random(seed)
    stored = Stored(SIZES, fmt=fmt, rng=rng)
    dut = Texture(fmt=fmt, payload_shape=9, num_slots=num_slots, num_lines=num_lines, line_items=line_items,
                  num_fetches=num_fetches, index_width=11)
    given = stored.requests(rng, 250, SIZES)
    check(dut, stored.words, given, line_items=line_items, rng=rng, gap=gap, latency=latency)


def test_a_long_side_and_a_far_base():
    rng, fmt = random.Random(5), FloatFormat(7, 16)
    sizes = [(4096, 2), (2, 4096)]
    stored = Stored(sizes, fmt=fmt, rng=rng)
    dut = Texture(fmt=fmt, payload_shape=9)
    check(dut, stored.words, stored.requests(rng, 300, sizes), line_items=4, rng=rng, latency=5)


@pytest.mark.parametrize(("filtered", "cycles"), [(True, 4), (False, 2)])
def test_requests_a_clock(filtered, cycles):
    """With all texels in the cache the unit is as busy as it can be."""
    rng, fmt = random.Random(6), FloatFormat(7, 16)
    stored = Stored([(2, 2)], fmt=fmt, rng=rng)
    dut = Texture(fmt=fmt, payload_shape=9, index_width=11)
    given = [stored.request(rng, number=0, payload=payload, filtered=filtered) for payload in range(400)]
    check(dut, stored.words, given, line_items=4, rng=rng, ticks=cycles * len(given) + 150)


def test_a_block_is_fetched_once():
    rng, fmt = random.Random(7), FloatFormat(7, 16)
    stored = Stored([(16, 16)], fmt=fmt, rng=rng)
    dut = Texture(fmt=fmt, payload_shape=9, index_width=11)
    given = [stored.request(rng, number=0, payload=payload, filtered=True) for payload in range(300)]
    lines = check(dut, stored.words, given, line_items=4, rng=rng)
    assert {*lines} <= set(range(3, 67))
    # Whoever has looked again in vain may fetch a line that has come meanwhile.
    assert len(lines) <= 80


@pytest.mark.parametrize("num_slots", [2, 8])
def test_there_are_never_more_in_flight_than_slots(num_slots):
    rng, fmt = random.Random(8), FloatFormat(7, 16)
    stored = Stored(SIZES, fmt=fmt, rng=rng)
    dut = Texture(fmt=fmt, payload_shape=9, num_slots=num_slots, index_width=11)
    given = stored.requests(rng, 60, SIZES)
    requests, got = deque(request for request, _ in given), []
    accepted = 0

    async def receive(ctx):
        nonlocal accepted
        for _ in range(600):
            _, _, valid, ready = await ctx.tick().sample(dut.request.valid, dut.request.ready)
            accepted += valid & ready
        # Nothing has been taken from it: it is full, and all of it is ready to go.
        assert accepted == num_slots
        while len(got) < len(given):
            ctx.set(dut.response.ready, 1)
            _, _, valid, ready, response, asks, takes = await ctx.tick().sample(
                dut.response.valid, dut.response.ready, dut.response.payload, dut.request.valid, dut.request.ready)
            accepted += asks & takes
            if valid and ready:
                got.append(answered(response))
            assert accepted - len(got) <= num_slots

    _, memory = memory_of(dut, stored.words, line_items=4, rng=rng)
    simulate(dut, receive, background=(*memory, feed(dut.request, requests, rng=rng)), name="texture_slots")
    assert got == [answer for _, answer in given]


def test_flush_forgets_texels():
    rng, fmt = random.Random(9), FloatFormat(7, 16)
    before, after = (Stored(SIZES, fmt=fmt, rng=rng) for _ in range(2))
    words = list(before.words)
    dut = Texture(fmt=fmt, payload_shape=9, index_width=11)
    given = [*before.requests(rng, 100, SIZES), *after.requests(rng, 100, SIZES)]
    requests, got = deque(request for request, _ in given[:100]), []

    async def control(ctx):
        await until(lambda: len(got) == 100)(ctx)
        words[:] = after.words
        ctx.set(dut.flush, 1)
        await ctx.tick().until(dut.flushed)
        ctx.set(dut.flush, 0)
        requests.extend(request for request, _ in given[100:])
        await until(lambda: len(got) == 200)(ctx)

    _, memory = memory_of(dut, words, line_items=4, rng=rng)
    simulate(dut, control, name="texture_flush", background=(
        *memory, feed(dut.request, requests, rng=rng),
        drain(dut.response, lambda response: got.append(answered(response)))))
    assert got == [answer for _, answer in given]


def places(fmt, given):
    """Of (coordinate, log2_side, folded), one a clock."""
    dut, got = TexturePlace(fmt=fmt), []

    async def testbench(ctx):
        for now in range(len(given) + dut.latency):
            if now < len(given):
                bits, log2_side, folded = given[now]
                ctx.set(Value.cast(dut.coordinate), bits)
                ctx.set(dut.log2_side, log2_side)
                ctx.set(dut.folded, folded)
            if now >= dut.latency:
                got.append(ctx.get(dut.place))
            await ctx.tick()

    simulate(dut, testbench, ticks=len(given) + 100, name="texture_place")
    return got


@pytest.mark.parametrize("fmt", [FloatFormat(2, 3), FloatFormat(3, 2), FloatFormat(6, 2)], ids=str)
def test_place_of_every_coordinate(fmt):
    given = [(bits, log2_side, folded) for bits in range(1 << fmt.width) for log2_side in range(13)
             for folded in (0, 1)]
    assert places(fmt, given) == [
        textures.place(float(fmt.decode(bits)), 1 << log2_side, folded) for bits, log2_side, folded in given]


@pytest.mark.parametrize("fmt", [FloatFormat(7, 16), FloatFormat(8, 23)], ids=str)
def test_place(fmt):
    rng = random.Random(10)
    coordinates = fmt.encode(textures.interesting_coordinates(fmt, 64, rng, 3000))
    given = [(int(bits), rng.randrange(13), rng.randrange(2)) for bits in coordinates]
    assert places(fmt, given) == [
        textures.place(float(fmt.decode(bits)), 1 << log2_side, folded) for bits, log2_side, folded in given]


@pytest.mark.parametrize(("parameters", "message"), [
    ({"num_slots": 1}, "at least 2 slots, not 1"), ({"num_slots": 12}, "12 is not a power of 2"),
    ({"line_items": 3}, "3 is not a power of 2")])
def test_limits(parameters, message):
    with pytest.raises(ValueError, match=message):
        Texture(fmt=FloatFormat(7, 16), payload_shape=4, **parameters)
