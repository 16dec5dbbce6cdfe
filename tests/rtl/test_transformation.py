"""Transformation against 3×4 maps in rounded float64: what it writes, sends and announces, and in which order."""

import random
from collections import deque

import pytest

from fpu import FloatFormat
from rtl.layout import PACKET_RAYS, IntervalSource
from rtl.ray_store import RayStore
from rtl.transformation import Transformation
from tests.bench import drain, feed, memory, simulate, until, watch
from tests.rtl.packets import fields, random_token, rays_of
from tests.rtl.rounded import Rounded, same

FMT = FloatFormat(5, 8)
LATENCIES = {"add": 3, "mul": 2}
NUM_THREADS, STACK_DEPTH, INDEX_WIDTH, COORD_WIDTH = 6, 3, 9, 7
ROOT = 77


def as_vector(values):
    return dict(zip("xyz", values, strict=True))


def reference_map(arithmetic, rows, center, vector):
    vector = [arithmetic.sub(x, c) for x, c in zip(vector, center, strict=True)]
    products = ([arithmetic.mul(m, x) for m, x in zip(row, vector, strict=True)] for row in rows)
    return [arithmetic.add(arithmetic.add(x, y), z) for x, y, z in products]


class World:
    """Jobs, the vectors that the store has for them, and what is to come out, in order."""

    def __init__(self, *, seed, masks=range(1, 16)):
        self.rng = random.Random(seed)
        self.masks = masks
        self.arithmetic = Rounded(FMT)
        self.camera_rows, self.camera_origin = self.matrix()[0], self.vector()
        self.stored = {(thread, level, is_origin, ray): self.vector() for thread in range(NUM_THREADS)
                       for level in range(2) for is_origin in range(2) for ray in range(PACKET_RAYS)}
        self.primaries, self.matrices = deque(), deque()
        # By job, told apart by thread and node or index: its vectors, and how it starts.
        self.jobs = {}
        self.num_vectors = 0

    def scalar(self):
        rng = self.rng
        return rng.choice([0.0, -0.0, 1.0, rng.randrange(-40, 41) / 16, rng.randrange(-40, 41) / 16,
                           self.arithmetic.any(rng)])

    def vector(self):
        return [self.scalar() for _ in range(3)]

    def matrix(self):
        return [self.vector() for _ in range(3)], self.vector()

    def token(self, **known):
        return random_token(self.rng, thread=self.rng.randrange(NUM_THREADS), stack_depth=STACK_DEPTH,
                            mask=self.rng.choice(self.masks), **known)

    def add_primary(self):
        rng, token = self.rng, self.token()
        x, y = (rng.randrange(-(1 << COORD_WIDTH), 1 << COORD_WIDTH) for _ in range(2))
        self.primaries.append({"token": token, "x": x, "y": y})
        mapped = [(0, self.camera_origin)]
        for ray in rays_of(token["mask"]):
            screen = [self.arithmetic.round(float(x + 2 * (ray & 1))), self.arithmetic.round(float(y - 2 * (ray >> 1)))]
            mapped.append((ray, reference_map(self.arithmetic, self.camera_rows, [0.0] * 3, [*screen, 1.0])))
        start = token | {"level": 0, "hit": 0, "sp": 0, "interval": IntervalSource.FRESH}
        self.expect("camera", token, None, mapped, start, ROOT)

    def add_matrix(self, *, instance):
        # Indices tell jobs apart.
        index = len(self.matrices)
        token = self.token(**({"level": 0} if instance else {}))
        rows, center = self.matrix()
        item = sum(int(FMT.encode(value)) << FMT.width * place
                   for place, value in enumerate(value for vector in (*rows, center) for value in vector))
        self.matrices.append({"item": item, "payload": {"token": token, "index": index, "instance": instance}})
        read = [self.stored[token["thread"], token["level"], is_origin, ray if not is_origin else 0]
                for is_origin, ray in [(1, 0), *((0, ray) for ray in rays_of(token["mask"]))]]
        centers = [center] + [[0.0] * 3] * (len(read) - 1)
        mapped = [(ray, reference_map(self.arithmetic, rows, center, vector)) for ray, center, vector
                  in zip([0, *rays_of(token["mask"])], centers, read, strict=True)]
        start = token | {"level": 1, "sp": 0, "interval": IntervalSource.FRESH}
        self.expect("instance" if instance else "triangle", token, index, mapped, start, index)

    def expect(self, kind, token, index, mapped, start, node):
        self.num_vectors += len(mapped)
        key = index if index is not None else ("camera", len(self.primaries) - 1)
        self.jobs[key] = kind, token, mapped, start, node

    def read_stored(self, at):
        return as_vector(self.stored[at.thread, at.level, at.is_origin, at.ray])


def run(world, *, seed, gap=0.0, latencies=LATENCIES):
    """The jobs it took in order, its vectors and starts each with their cycle, and the instances it entered."""
    rng = random.Random(1000 + seed)
    dut = Transformation(fmt=FMT, num_threads=NUM_THREADS, stack_depth=STACK_DEPTH, index_width=INDEX_WIDTH,
                         coord_width=COORD_WIDTH, latencies=latencies)
    accepted, outputs, results, starts, started, entered = ([] for _ in range(6))
    num_jobs = len(world.jobs)
    num_stored = sum(kind != "triangle" for kind, *_ in world.jobs.values())

    async def set_camera(ctx):
        ctx.set(dut.root, ROOT)
        ctx.set(dut.camera, {"origin": as_vector(world.camera_origin),
                             "rows": [as_vector(row) for row in world.camera_rows]})

    async def log(ctx):
        num_primaries = 0
        now = 0
        async for _, _, primary, matrix, index, write, vector, start, enters in ctx.tick().sample(
                dut.primary.valid & dut.primary.ready, dut.matrix.valid & dut.matrix.ready,
                dut.matrix.payload.payload.index, dut.write.valid, dut.vector.valid, dut.start.valid, dut.entered):
            assert primary + matrix <= 1
            assert write + vector <= 1
            if primary:
                accepted.append(("camera", num_primaries))
                num_primaries += 1
            if matrix:
                accepted.append(index)
            outputs.extend([now] * (write + vector))
            starts.extend([now] * start)
            if enters.valid:
                entered.append((enters.thread, enters.index))
            now += 1

    simulate(dut, set_camera, until(lambda: len(started) == num_stored and len(results) == world.num_vectors, quiet=30),
             ticks=20 * world.num_vectors, name="transformation", background=(
                 log, memory(dut.vector_address, dut.stored_vector, world.read_stored),
                 watch(dut.write, lambda write: results.append(("write", write))),
                 drain(dut.vector, lambda vector: results.append(("vector", vector))),
                 drain(dut.start, started.append),
                 feed(dut.primary, world.primaries, rng=rng, gap=gap),
                 feed(dut.matrix, world.matrices, rng=rng, gap=gap)))
    assert len(accepted) == num_jobs
    return accepted, list(zip(outputs, results, strict=True)), list(zip(starts, started, strict=True)), entered


def check(world, accepted, results, starts, entered):
    results, starts, entered = deque(results), deque(starts), deque(entered)
    for key in accepted:
        kind, token, mapped, start, node = world.jobs[key]
        if kind == "instance":
            assert entered.popleft() == (token["thread"], key)
        for number, (ray, expected) in enumerate(mapped):
            now, (port, result) = results.popleft()
            assert result.is_origin == (number == 0)
            # The store keeps an origin as that of ray 0.
            if number or port == "write":
                assert result.ray == ray
            vector = result.vector
            assert all(map(same, (vector.x, vector.y, vector.z), expected))
            if kind == "triangle":
                assert port == "vector"
                assert fields(result.token) == token
                assert result.index == key
                assert result.last == (number == len(mapped) - 1)
            else:
                assert port == "write"
                assert (result.thread, result.level) == (token["thread"], int(kind == "instance"))
        if kind != "triangle":
            at, began = starts.popleft()
            assert at == now + RayStore.write_latency, "rays start before they are stored, or wait"
            assert fields(began.token) == start
            assert began.node == node
    assert not results
    assert not starts
    assert not entered


def check_spacing(results):
    """What the store asks for: three cycles between vectors for the same bank."""
    latest = {}
    for now, (port, vector) in results:
        if port == "write":
            bank = "origin" if vector.is_origin else vector.ray
            assert now - latest.get(bank, -3) >= 3
            latest[bank] = now


@pytest.mark.parametrize(("seed", "gap"), [(0, 0.0), (1, 0.3), (2, 0.9)])
def test_jobs_of_all_kinds(seed, gap):
    world = World(seed=seed)
    for _ in range(90):
        kind = world.rng.randrange(4)
        if kind == 0:
            world.add_primary()
        else:
            world.add_matrix(instance=int(kind == 1))
    accepted, results, starts, entered = run(world, seed=seed, gap=gap)
    check(world, accepted, results, starts, entered)
    check_spacing(results)


@pytest.mark.parametrize("kind", ["primary", "instance"])
def test_lone_rays_leave_the_store_its_time(kind):
    world = World(seed=5, masks=(1, 2, 4, 8))
    for _ in range(20):
        if kind == "primary":
            world.add_primary()
        else:
            world.add_matrix(instance=1)
    accepted, results, starts, entered = run(world, seed=5)
    check(world, accepted, results, starts, entered)
    check_spacing(results)


def test_a_vector_a_clock():
    world = World(seed=6)
    for _ in range(60):
        world.add_matrix(instance=0)
    _, results, _, _ = run(world, seed=6)
    cycles = [now for now, _ in results]
    assert cycles == list(range(cycles[0], cycles[0] + world.num_vectors))


@pytest.mark.parametrize("latencies", [{"add": 0, "mul": 0}, {"add": 7, "mul": 1}])
def test_latencies_of_operators(latencies):
    world = World(seed=8)
    for number in range(15):
        world.add_primary()
        world.add_matrix(instance=number % 2)
    check(world, *run(world, seed=8, latencies=latencies))
