"""Transformation for a shader: its vectors among the packets, and packets whose rays have origins of their own."""

import random
from collections import Counter, deque

import pytest

from fpu import FloatFormat
from rtl.layout import PACKET_RAYS, IntervalSource
from rtl.microcode import Store
from rtl.ray_store import RayStore
from rtl.transformation import Transformation
from tests.bench import drain, feed, memory, simulate, watch
from tests.rtl.packets import fields, random_token, rays_of
from tests.rtl.rounded import Rounded, same
from tests.rtl.test_transformation import as_vector, reference_map

FMT = FloatFormat(5, 8)
LATENCIES = {"add": 3, "mul": 2}
NUM_THREADS, STACK_DEPTH, INDEX_WIDTH, COORD_WIDTH = 6, 3, 9, 7


class World:
    """Steps and packets, the vectors that the store has, and what is to come out of each, in order."""

    def __init__(self, *, seed):
        self.rng = random.Random(seed)
        self.arithmetic = Rounded(FMT)
        self.steps, self.matrices = deque(), deque()
        self.stored = {(thread, level, is_origin, ray): self.vector() for thread in range(NUM_THREADS)
                       for level in range(2) for is_origin in range(2) for ray in range(PACKET_RAYS)}
        # By tag or index; what comes out is (port, what is to be so, vector).
        self.expected = {}
        self.shared = {}
        self.events = Counter()

    def vector(self):
        rng = self.rng
        return [rng.choice([0.0, -0.0, 1.0, rng.randrange(-40, 41) / 16, rng.randrange(-40, 41) / 16,
                            self.arithmetic.any(rng)]) for _ in range(3)]

    def add_step(self, *, store=None):
        rng = self.rng
        tag = sum(kind == "step" for kind, _ in self.expected)
        step = {"tag": tag, "thread": rng.randrange(NUM_THREADS), "ray": rng.randrange(PACKET_RAYS),
                "store": rng.choice([*Store, Store.NOWHERE]) if store is None else store}
        rows, vector = [self.vector() for _ in range(3)], self.vector()
        self.steps.append(step | {"rows": [as_vector(row) for row in rows], "vector": as_vector(vector)})
        result = reference_map(self.arithmetic, rows, [0.0] * 3, vector)
        out = [("stepped", {"tag": tag}, result)]
        if step["store"] is not Store.NOWHERE:
            out.append(("write", {"own": 1, "thread": step["thread"], "level": 0, "ray": step["ray"],
                                  "is_origin": int(step["store"] is Store.ORIGIN)}, result))
        self.events[step["store"]] += 1
        self.expected["step", tag] = out, None

    def add_matrix(self):
        rng, index = self.rng, sum(kind == "matrix" for kind, _ in self.expected)
        instance, solid, thread = rng.random() < 0.4, rng.randrange(2), rng.randrange(NUM_THREADS)
        token = random_token(rng, thread=thread, stack_depth=STACK_DEPTH, **({"level": 0} if instance else {}))
        level, shared, numbers = token["level"], self.shared[thread], rays_of(token["mask"])
        rows, center = [self.vector() for _ in range(3)], self.vector()
        item = sum(int(FMT.encode(value)) << FMT.width * place
                   for place, value in enumerate(value for vector in (*rows, center) for value in vector))
        self.matrices.append({"item": item, "payload": {"token": token, "index": index, "instance": int(instance),
                                                        "solid": solid}})
        out = []

        def put(ray, is_origin, stored_ray):
            vector = self.stored[thread, level, is_origin, stored_ray]
            mapped = reference_map(self.arithmetic, rows, center if is_origin else [0.0] * 3, vector)
            if instance:
                out.append(("write", {"own": int(not shared), "thread": thread, "level": 1, "is_origin": is_origin,
                                      "ray": 0 if shared and is_origin else ray}, mapped))
            else:
                out.append(("vector", {"is_origin": is_origin, "index": index, "solid": solid, "token": token,
                                       "last": int(ray == numbers[-1] and not is_origin)}
                            | ({} if is_origin else {"ray": ray, "first": int(ray == numbers[0])}), mapped))

        for ray in numbers:
            if not shared:
                put(ray, 1, ray)
            elif ray == numbers[0]:
                # In the scene's space the shader has stored it with each ray; in an instance's there is one.
                put(ray, 1, 0 if level else ray)
            put(ray, 0, ray)
        self.events["instance" if instance else "triangle", "shared" if shared else "own"] += 1
        start = token | {"level": 1, "sp": 0, "interval": IntervalSource.FRESH}
        self.expected["matrix", index] = out, (start, index) if instance else None


def run(world, jobs, *, seed, gap=0.0):
    """What goes in in which order, what comes out at which port in which cycle, and starts with their cycles.

    ``jobs`` are functions that add jobs; before each, the rays of each thread get one origin or one each.
    """
    rng = random.Random(1000 + seed)
    dut = Transformation(fmt=FMT, num_threads=NUM_THREADS, stack_depth=STACK_DEPTH, index_width=INDEX_WIDTH,
                         coord_width=COORD_WIDTH, latencies=LATENCIES, tag=9, solid=True)
    accepted, outputs, starts, entered = [], [], [], []
    now = [0]

    def out(port):
        return lambda result: outputs.append((now[0], port, result))

    async def work(ctx):
        for add in jobs:
            for thread in range(NUM_THREADS):
                world.shared[thread] = rng.randrange(2)
                ctx.set(dut.shared, {"valid": 1, "thread": thread, "shared": world.shared[thread]})
                await ctx.tick()
            ctx.set(dut.shared.valid, 0)
            add()
            while len(accepted) < len(world.expected):
                await ctx.tick()
            await ctx.tick().repeat(40)

    async def log(ctx):
        num_steps = 0
        async for _, _, step, matrix, index, enters in ctx.tick().sample(
                dut.step.valid & dut.step.ready, dut.matrix.valid & dut.matrix.ready, dut.matrix.payload.payload.index,
                dut.entered):
            assert step + matrix <= 1
            if step:
                accepted.append(("step", num_steps))
                num_steps += 1
            if matrix:
                accepted.append(("matrix", index))
            if enters.valid:
                entered.append((enters.thread, enters.index))
            now[0] += 1

    simulate(dut, work, name="transformation", background=(
        memory(dut.vector_address, dut.stored_vector, lambda at: as_vector(
            world.stored[at.thread, at.level, at.is_origin, at.ray])),
        watch(dut.stepped, out("stepped")), watch(dut.write, out("write")), drain(dut.vector, out("vector")),
        drain(dut.start, lambda start: starts.append((now[0], start))), log,
        feed(dut.step, world.steps, rng=rng, gap=gap), feed(dut.matrix, world.matrices, rng=rng, gap=gap)))
    return accepted, outputs, starts, entered


def check(world, accepted, outputs, starts, entered):
    outputs, starts, entered = deque(outputs), deque(starts), deque(entered)
    assert len(accepted) == len(world.expected) == len(set(accepted))
    for job in accepted:
        expected, start = world.expected[job]
        for port, members, vector in expected:
            now, came_out_at, result = outputs.popleft()
            assert came_out_at == port
            for name, value in members.items():
                assert (fields(result.token) if name == "token" else result[name]) == value, name
            got = result.vector
            assert all(map(same, (got.x, got.y, got.z), vector))
        if start is not None:
            began_at, began = starts.popleft()
            assert began_at == now + RayStore.write_latency
            assert (fields(began.token), began.node) == start
            # It is said with each origin.
            for _ in range(sum(members["is_origin"] for _, members, _ in expected)):
                assert entered.popleft() == (start[0]["thread"], start[1])
    assert not outputs
    assert not starts
    assert not entered


def check_spacing(outputs):
    """What the store asks for: three cycles between vectors for the same bank."""
    latest = {}
    for now, port, vector in outputs:
        if port != "write":
            continue
        rays = [vector.ray] if vector.own or not vector.is_origin else range(PACKET_RAYS)
        for bank in [(vector.is_origin, ray) for ray in rays]:
            assert now - latest.get(bank, -3) >= 3
            latest[bank] = now


@pytest.mark.parametrize(("seed", "gap"), [(0, 0.0), (1, 0.3), (2, 0.9)])
def test_steps_among_packets(seed, gap):
    world = World(seed=seed)

    def add():
        for _ in range(45):
            if world.rng.random() < 0.6:
                world.add_step()
            else:
                world.add_matrix()

    results = run(world, [add] * 3, seed=seed, gap=gap)
    check(world, *results)
    check_spacing(results[1])
    assert min(world.events[store] for store in Store) > 5
    assert min(world.events[kind, origins] for kind in ("instance", "triangle") for origins in ("shared", "own")) > 3


def test_steps_of_one_ray_leave_the_store_its_time():
    world = World(seed=5)

    def add():
        for _ in range(20):
            world.add_step(store=Store.ORIGIN)
            world.steps[-1]["thread"] = world.expected["step", len(world.steps) - 1][0][1][1]["thread"] = 2
            world.steps[-1]["ray"] = world.expected["step", len(world.steps) - 1][0][1][1]["ray"] = 3

    results = run(world, [add], seed=5)
    check(world, *results)
    check_spacing(results[1])
    cycles = [now for now, port, _ in results[1] if port == "write"]
    assert cycles == [cycles[0] + 3 * number for number in range(20)]


def test_a_step_a_clock():
    world = World(seed=6)

    def add():
        for _ in range(50):
            world.add_step(store=Store.NOWHERE)

    results = run(world, [add], seed=6)
    check(world, *results)
    cycles = [now for now, _, _ in results[1]]
    assert cycles == list(range(cycles[0], cycles[0] + 50))
