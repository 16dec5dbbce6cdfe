"""The ray store against a dictionary with the history of every vector."""

import random

import pytest

from fpu import FloatFormat
from rtl.layout import PACKET_RAYS, Axis
from rtl.ray_store import RayStore
from tests.bench import simulate
from tests.rtl.rounded import Rounded

FMT = FloatFormat(5, 8)


class History:
    """Vectors by place, each with the cycle in which it was written."""

    def __init__(self):
        self.versions = {}

    def write(self, place, now, vector):
        self.versions.setdefault(place, []).append((now, vector))

    def read(self, place, now):
        """What is at a place in cycle ``now``; None if nothing is, or it is not promised which version."""
        versions = self.versions.get(place, [])
        if not versions or versions[-1][0] + RayStore.write_latency > now:
            return None
        return versions[-1][1]


class Writer:
    """Writes packets as the transformation does: origin, then the directions of some rays, then a pause or none."""

    def __init__(self, rng, num_threads, *, cycles):
        self.rng, self.num_threads, self.cycles = rng, num_threads, cycles
        self.arithmetic = Rounded(FMT)
        self.latest = {}

    def packets(self):
        while True:
            rng = self.rng
            thread, level = rng.randrange(self.num_threads), rng.randrange(2)
            yield from self.vector(thread, level, is_origin=1, ray=0)
            for ray in range(PACKET_RAYS):
                if rng.random() < 0.6:
                    yield from self.vector(thread, level, is_origin=0, ray=ray)
            yield from [None] * rng.choice([0, 0, 1, 3])

    def vector(self, thread, level, *, is_origin, ray):
        bank = "origin" if is_origin else ray
        # Three cycles from one vector to the next for the same bank.
        while self.now - self.latest.get(bank, -3) < 3:
            yield None
        self.latest[bank] = self.now
        yield (thread, level, is_origin, ray), [self.arithmetic.any(self.rng) for _ in range(3)]

    def __iter__(self):
        packets = self.packets()
        for now in range(self.cycles):
            self.now = now
            yield next(packets)


@pytest.mark.parametrize(("seed", "num_threads"), [(0, 1), (1, 3), (2, 8)])
def test_reads_what_was_written(seed, num_threads):
    rng = random.Random(seed)
    dut = RayStore(fmt=FMT, num_threads=num_threads)
    history = History()
    num_checked = 0

    async def work(ctx):
        nonlocal num_checked
        pending = []
        for now, write in enumerate(Writer(rng, num_threads, cycles=400)):
            ctx.set(dut.write.valid, write is not None)
            if write is not None:
                place, vector = write
                history.write(place, now, vector)
                names = dict(zip(("thread", "level", "is_origin", "ray"), place, strict=True))
                ctx.set(dut.write, names | {"valid": 1, "vector": dict(zip("xyz", vector, strict=True))})
            thread, level, axis = rng.randrange(num_threads), rng.randrange(2), rng.randrange(3)
            is_origin = rng.randrange(2)
            ray = 0 if is_origin else rng.randrange(PACKET_RAYS)
            ctx.set(dut.step_address, {"thread": thread, "level": level, "axis": Axis(axis)})
            ctx.set(dut.vector_address, {"thread": thread, "level": level, "is_origin": is_origin, "ray": ray})
            origin = history.read((thread, level, 1, 0), now)
            directions = [history.read((thread, level, 0, number), now) for number in range(PACKET_RAYS)]
            pending.append((axis, origin, directions, history.read((thread, level, is_origin, ray), now)))
            if len(pending) > RayStore.read_latency:
                axis, origin, directions, vector = pending.pop(0)
                rays, stored = ctx.get(dut.step_rays), ctx.get(dut.vector)
                for number, direction in enumerate(directions):
                    if origin:
                        assert rays[number].origin == origin[axis]
                    if direction:
                        assert rays[number].direction == direction[axis]
                        num_checked += 1
                if vector:
                    assert [stored.x, stored.y, stored.z] == vector
            await ctx.tick()

    simulate(dut, work, name="ray_store")
    assert num_checked > 100


@pytest.mark.parametrize(("cycles", "is_noticed"), [(1, True), (2, True), (3, False)])
def test_vectors_that_come_too_early_are_noticed(cycles, is_noticed):
    dut = RayStore(fmt=FMT, num_threads=2)

    async def write(ctx):
        for _ in range(2):
            ctx.set(dut.write, {"valid": 1, "thread": 1, "is_origin": 1, "vector": {"x": 1.0, "y": 2.0, "z": 3.0}})
            await ctx.tick()
            ctx.set(dut.write.valid, 0)
            for _ in range(cycles - 1):
                await ctx.tick()
        await ctx.tick()

    if is_noticed:
        with pytest.raises(AssertionError, match="a vector comes before the last one is in"):
            simulate(dut, write, name="ray_store")
    else:
        simulate(dut, write, name="ray_store")


@pytest.mark.parametrize("seed", range(3))
def test_rays_with_origins_of_their_own(seed):
    rng = random.Random(seed)
    num_threads = 3
    dut = RayStore(fmt=FMT, num_threads=num_threads)
    arithmetic = Rounded(FMT)
    # By thread, level and ray as steps see it; by ray, as it was written, as transformation does.
    seen, stored = {}, {}
    num_checked = {"own": 0, "shared": 0}

    async def work(ctx):
        for _ in range(60):
            thread, level, own = rng.randrange(num_threads), rng.randrange(2), rng.random() < 0.7
            for ray in rng.sample(range(PACKET_RAYS), rng.randrange(1, PACKET_RAYS + 1)) if own else [0]:
                vector = [arithmetic.any(rng) for _ in range(3)]
                ctx.set(dut.write, {"valid": 1, "own": own, "thread": thread, "level": level, "is_origin": 1,
                                    "ray": ray, "vector": dict(zip("xyz", vector, strict=True))})
                stored[thread, level, ray] = vector
                for other in [ray] if own else range(PACKET_RAYS):
                    seen[thread, level, other] = vector
                # Origins of different rays go to different banks, and may follow each other at once.
                await ctx.tick()
            ctx.set(dut.write.valid, 0)
            await ctx.tick().repeat(RayStore.write_latency)
            axis = rng.randrange(3)
            ctx.set(dut.step_address, {"thread": thread, "level": level, "axis": Axis(axis)})
            ray = rng.randrange(PACKET_RAYS) if own else 0
            ctx.set(dut.vector_address, {"thread": thread, "level": level, "is_origin": 1, "ray": ray})
            await ctx.tick().repeat(RayStore.read_latency)
            for number in range(PACKET_RAYS):
                if vector := seen.get((thread, level, number)):
                    assert ctx.get(dut.step_rays[number].origin) == vector[axis]
                    num_checked["own" if own else "shared"] += 1
            if vector := stored.get((thread, level, ray)):
                got = ctx.get(dut.vector)
                assert [got.x, got.y, got.z] == vector

    simulate(dut, work, name="ray_store")
    assert num_checked["own"] > 80
    assert num_checked["shared"] > 30
