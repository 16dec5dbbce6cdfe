"""Queues and merges against Python's own."""

import random
from collections import deque

import pytest

from rtl.queue import Merge, Queue
from tests.bench import drain, feed, simulate, until


@pytest.mark.parametrize("block", [False, True])
@pytest.mark.parametrize(("seed", "depth", "gaps"), [
    (0, 1, (0.0, 0.0)), (1, 2, (0.0, 0.5)), (2, 5, (0.5, 0.0)), (3, 8, (0.3, 0.3)), (4, 3, (0.0, 0.8))])
def test_queue_keeps_order(seed, depth, gaps, block):
    rng = random.Random(seed)
    dut = Queue(16, depth=depth, block=block)
    sent = [rng.getrandbits(16) for _ in range(300)]
    received = []
    held = deque()
    had_one = False

    async def compare_level(ctx):
        nonlocal had_one
        async for _, _, level, writes, ready, reads, valid, value in ctx.tick().sample(
                dut.level, dut.i.valid, dut.i.ready, dut.o.ready, dut.o.valid, dut.i.payload):
            assert level == len(held) <= depth
            assert ready == (len(held) < depth)
            # What was written in one cycle is there in the next; from block RAM, perhaps one later after another.
            assert valid == bool(held) or (block and held and had_one)
            had_one = bool(reads and valid)
            if reads and valid:
                held.popleft()
            if writes and ready:
                held.append(value)

    simulate(dut, until(lambda: len(received) == len(sent), quiet=depth + 2), name="queue", background=(
        compare_level, feed(dut.i, deque(sent), rng=rng, gap=gaps[0]),
        drain(dut.o, received.append, rng=rng, gap=gaps[1])))
    assert received == sent


@pytest.mark.parametrize(("depth", "block"), [(1, False), (4, False), (4, True)])
def test_queue_overflow_is_noticed(depth, block):
    def fill(num_elements):
        dut = Queue(4, depth=depth, always_ready=True, block=block)

        async def write(ctx):
            ctx.set(dut.i.valid, 1)
            for _ in range(num_elements):
                await ctx.tick()
            ctx.set(dut.i.valid, 0)
            await ctx.tick()
            assert ctx.get(dut.level) == num_elements

        simulate(dut, write, name="queue")

    fill(depth)
    with pytest.raises(AssertionError, match="a queue overflows"):
        fill(depth + 1)


@pytest.mark.parametrize("block", [False, True])
@pytest.mark.parametrize("held", [2, 5])
def test_queue_passes_an_element_a_cycle(held, block):
    dut = Queue(8, depth=8, block=block)
    received = []

    async def pass_on(ctx):
        for number in range(40):
            ctx.set(dut.i.payload, number)
            ctx.set(dut.i.valid, 1)
            ctx.set(dut.o.ready, number >= held)
            if number >= held:
                # Others wait, so the one gap that block RAM may have comes at most once.
                received.append(ctx.get(dut.o.payload) if ctx.get(dut.o.valid) else None)
            await ctx.tick()

    simulate(dut, pass_on, name="queue")
    gaps = received.count(None)
    assert gaps <= (1 if block and held == 2 else 0)
    assert [number for number in received if number is not None] == list(range(40 - held - gaps))


@pytest.mark.parametrize(("seed", "num_inputs", "gaps"), [
    (0, 1, (0.0, 0.3)), (1, 2, (0.5, 0.0)), (2, 3, (0.2, 0.4)), (3, 5, (0.7, 0.0)), (4, 3, (0.0, 0.0))])
def test_merge_loses_and_doubles_nothing(seed, num_inputs, gaps):
    rng = random.Random(seed)
    dut = Merge(12, num_inputs=num_inputs)
    sent = [[source << 8 | number for number in range(rng.randrange(1, 100))] for source in range(num_inputs)]
    received = []
    waits = [0] * num_inputs

    async def measure_waits(ctx):
        streams = [signal for port in dut.i for signal in (port.valid, port.ready)]
        async for _, _, *flags in ctx.tick().sample(*streams):
            pairs = list(zip(flags[::2], flags[1::2], strict=True))
            served = [number for number, (valid, ready) in enumerate(pairs) if valid and ready]
            assert len(served) <= 1
            for number, (valid, ready) in enumerate(pairs):
                waits[number] = waits[number] + len(served) if valid and not ready else 0
                assert waits[number] < num_inputs, "an input is passed over more than once by each other"

    simulate(dut, until(lambda: len(received) == sum(map(len, sent)), quiet=5), name="merge", background=(
        measure_waits, drain(dut.o, received.append, rng=rng, gap=gaps[1]),
        *(feed(port, deque(values), rng=rng, gap=gaps[0]) for port, values in zip(dut.i, sent, strict=True))))
    for source, values in enumerate(sent):
        assert [value for value in received if value >> 8 == source] == values


def test_merge_takes_turns():
    dut = Merge(4, num_inputs=3)
    received = []
    rng = random.Random(0)
    simulate(dut, until(lambda: len(received) == 30), ticks=35, name="merge", background=(
        drain(dut.o, received.append),
        *(feed(port, deque([number] * 20), rng=rng) for number, port in enumerate(dut.i))))
    assert received[:30] == [0, 1, 2] * 10
