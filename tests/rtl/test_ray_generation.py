"""Ray generation: every packet of a picture once, in order, to whichever thread is free."""

import random
from collections import deque

import pytest
from amaranth.hdl import Module
from amaranth.lib import wiring

from rtl.ray_generation import RayGeneration, packet_order
from rtl.threads import Threads
from tests.bench import drain, feed, simulate, watch
from tests.rtl.packets import random_token

COORD_WIDTH = 7


def reference_order(width, height):
    """Tiles of 8×8 packets row by row; in a tile, bits of x and y in turn, those of x the lower."""
    def place(packet):
        x, y = packet[0] // 2, packet[1] // 2
        morton = sum((x >> bit & 1) << 2 * bit | (y >> bit & 1) << 2 * bit + 1 for bit in range(3))
        return y >> 3, x >> 3, morton
    return sorted(((x, y) for y in range(0, height, 2) for x in range(0, width, 2)), key=place)


class Controller(wiring.Component):
    """Ray generation and the threads of one pipeline."""

    def __init__(self, *, num_threads, stack_depth, coord_width):
        self.rays = RayGeneration(coord_width=coord_width)
        self.threads = Threads(num_threads=num_threads, stack_depth=stack_depth, coord_width=coord_width)
        members = {name: member for name, member in self.threads.signature.members.items() if name != "packet"}
        super().__init__({**members, "start": self.rays.signature.members["start"]})

    def elaborate(self, platform):
        m = Module()
        m.submodules.rays, m.submodules.threads = rays, threads = self.rays, self.threads
        wiring.connect(m, rays.packet[0], threads.packet)
        wiring.connect(m, threads.primary, wiring.flipped(self.primary))
        wiring.connect(m, wiring.flipped(self.finished), threads.finished)
        m.d.comb += [self.begin.eq(threads.begin), threads.position_address[0].eq(self.position_address[0]),
                     self.position[0].eq(threads.position[0]), rays.start.eq(self.start),
                     self.ready.eq(rays.ready & threads.ready)]
        for unit in (rays, threads):
            m.d.comb += [unit.width.eq(self.width), unit.height.eq(self.height)]
        return m


@pytest.mark.parametrize("size", [(1, 1), (2, 2), (16, 16), (17, 15), (37, 50)])
def test_packet_order(size):
    assert list(packet_order(*size)) == reference_order(*size)


@pytest.mark.parametrize(("seed", "num_threads", "sizes", "gap"), [
    (0, 1, [(5, 3)], 0.0), (1, 4, [(1, 1), (17, 9), (16, 16)], 0.4), (2, 7, [(33, 18), (3, 40)], 0.0),
    (3, 64, [(20, 5), (20, 5)], 0.2)])
def test_pictures(seed, num_threads, sizes, gap):
    rng = random.Random(seed)
    dut = Controller(num_threads=num_threads, stack_depth=2, coord_width=COORD_WIDTH)
    at_work, waiting, finished = {}, [], deque()
    expected, started = deque(), deque()

    def begin(begin):
        started.append(begin.thread)

    def issue(packet):
        x, y = expected.popleft()
        width, height = size
        thread = packet.token.thread
        assert started.popleft() == thread
        assert thread < num_threads
        assert thread not in at_work, "a thread has two packets"
        assert (packet.x, packet.y) == (2 * x + 1 - width, height - (2 * y + 1))
        assert packet.token.mask == sum(1 << ray for ray in range(4)
                                        if x + ray % 2 < width and y + ray // 2 < height)
        at_work[thread] = x, y
        waiting.append(thread)

    async def draw(ctx):
        nonlocal size
        for size in sizes:
            assert ctx.get(dut.ready)
            expected.extend(reference_order(*size))
            ctx.set(dut.width, size[0])
            ctx.set(dut.height, size[1])
            ctx.set(dut.start, 1)
            await ctx.tick()
            ctx.set(dut.start, 0)
            while expected or at_work:
                if waiting and rng.random() < 0.3:
                    thread = waiting.pop(rng.randrange(len(waiting)))
                    ctx.set(dut.position_address[0], thread)
                    position = ctx.get(dut.position[0])
                    assert (position.x, position.y) == at_work[thread]
                    finished.append(random_token(rng, thread=thread, stack_depth=2))
                await ctx.tick()
            # What lies beyond the picture in the last tiles is still to be passed over.
            while not ctx.get(dut.ready):
                await ctx.tick()

    async def not_ready_too_early(ctx):
        async for _, _, ready, start in ctx.tick().sample(dut.ready, dut.start):
            assert start or not ready or not held[0]
            held[0] = bool(expected or at_work)

    size = None
    held = [False]
    simulate(dut, draw, name="ray_generation", background=(
        watch(dut.begin, begin), drain(dut.primary, issue, rng=rng, gap=gap),
        feed(dut.finished, finished, rng=rng, gap=gap),
        drain(dut.finished, lambda token: at_work.pop(token.thread)), not_ready_too_early))
    assert not started


@pytest.mark.parametrize(("seed", "num_pipelines", "sizes", "gap"), [
    (0, 2, [(33, 18)], 0.0), (1, 3, [(1, 1), (17, 9), (40, 3)], 0.6), (2, 4, [(2, 2), (37, 50)], 0.9)])
def test_each_packet_goes_to_one_pipeline(seed, num_pipelines, sizes, gap):
    rng = random.Random(seed)
    dut = RayGeneration(coord_width=COORD_WIDTH, num_pipelines=num_pipelines)
    taken = [[] for _ in range(num_pipelines)]
    pictures = []

    def take(pipeline):
        return lambda packet: taken[pipeline].append((packet.x, packet.y, packet.mask))

    async def draw(ctx):
        for width, height in sizes:
            assert ctx.get(dut.ready)
            ctx.set(dut.width, width)
            ctx.set(dut.height, height)
            ctx.set(dut.start, 1)
            await ctx.tick()
            ctx.set(dut.start, 0)
            expected = [(x, y, sum(1 << ray for ray in range(4) if x + ray % 2 < width and y + ray // 2 < height))
                        for x, y in reference_order(width, height)]
            ready = False
            while not ready:
                _, _, ready = await ctx.tick().sample(dut.ready)
                # When it is ready, what is left has just been taken.
                assert not ready or sum(map(len, taken)) == len(expected)
            place = {packet: number for number, packet in enumerate(expected)}
            assert sorted(place[packet] for packets in taken for packet in packets) == list(range(len(expected)))
            for packets in taken:
                assert packets == sorted(packets, key=place.get), "a pipeline's packets are out of order"
            pictures.append([len(packets) for packets in taken])
            for packets in taken:
                packets.clear()

    simulate(dut, draw, name="ray_generation", background=tuple(
        drain(port, take(number), rng=rng, gap=gap) for number, port in enumerate(dut.packet)))
    assert len(pictures) == len(sizes)
    most = pictures[-1]
    assert min(most) > sum(most) / num_pipelines * 0.6


@pytest.mark.parametrize("num_pipelines", [2, 4])
def test_one_that_stands_still_holds_up_no_other(num_pipelines):
    dut = RayGeneration(coord_width=COORD_WIDTH, num_pipelines=num_pipelines)
    order = list(packet_order(32, 32))
    taken = []

    async def draw(ctx):
        ctx.set(dut.width, 32)
        ctx.set(dut.height, 32)
        ctx.set(dut.start, 1)
        await ctx.tick()
        ctx.set(dut.start, 0)
        while len(taken) < len(order) - 2:
            await ctx.tick()
        await ctx.tick().repeat(50)
        assert not ctx.get(dut.ready)
        ctx.set(dut.packet[1].ready, 1)
        for _ in range(2):
            _, _, valid, packet = await ctx.tick().sample(dut.packet[1].valid, dut.packet[1].payload)
            assert valid
            taken.append((packet.x, packet.y))
        assert ctx.get(dut.ready)

    simulate(dut, draw, name="ray_generation", background=tuple(
        drain(port, lambda packet: taken.append((packet.x, packet.y))) for number, port in enumerate(dut.packet)
        if number != 1))
    assert sorted(taken) == sorted(order)
