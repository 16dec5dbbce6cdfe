"""Instruction fetch: which instruction, of which ray, with which operands, in which cycle."""

import random
from collections import deque

import pytest

from fpu import FloatFormat
from rtl.instruction_fetch import InstructionFetch
from rtl.layout import PACKET_RAYS
from rtl.microcode import NUM_REGISTERS, Condition, Lane, Mode, Op, Program, Store, lane_width
from tests.bench import Packed, simulate, until, watch
from tests.rtl.test_register_file import LITERALS, constants_of, random_camera

FMT = FloatFormat(5, 8)
STACK_DEPTH = 3
#: From the cycle in which an instruction is taken up to that in which it is out, if it is not wide.
LATENCY = 5


def random_program(rng, length):
    def register():
        return rng.choice([rng.randrange(6), NUM_REGISTERS + rng.randrange(5 + len(LITERALS))])

    return Program(tuple({
        "op": rng.choice(list(Op)), "mode": rng.choice(list(Mode)),
        "condition": rng.choice(list(Condition)), "store": rng.choice(list(Store)), "bit": rng.randrange(32),
        "mask": rng.randrange(8), "dst": rng.randrange(NUM_REGISTERS), "a": register(), "b": register(),
        "c": register(), "x": register(), "select": [rng.choice(list(Lane)).value for _ in range(3)],
        "negate": rng.randrange(8), "target": rng.randrange(length),
        "is_wide": int(counter % 3 == 0)} for counter in range(length)), LITERALS)


class Rays:
    """Rays, each with a random instruction under way or none, their registers, and what is to come out, in order."""

    def __init__(self, rng, *, num_threads, bank=0, bank_bits=0):
        self.rng = rng
        threads = range(bank, num_threads, 1 << bank_bits)
        self.program = random_program(rng, 40)
        self.camera = random_camera(rng)
        self.constants = constants_of(FMT, self.camera)
        self.registers = {(thread, ray, number): [0] * 3 for thread in threads
                          for ray in range(PACKET_RAYS) for number in range(NUM_REGISTERS)}
        self.idle = [(thread, ray) for thread in threads for ray in range(PACKET_RAYS)]
        self.expected = deque()
        self.num_done = self.num_wide = 0

    def read(self, thread, ray, number):
        return self.constants[number - NUM_REGISTERS] if number >= NUM_REGISTERS else \
            self.registers[thread, ray, number]

    def begin(self, thread, ray):
        """Its token; what it reads is known."""
        rng = self.rng
        counter = rng.randrange(len(self.program.instructions))
        instruction = self.program.instructions[counter]
        token = {"thread": thread, "ray": ray, "counter": counter, "sp": rng.randrange(STACK_DEPTH + 1),
                 "hit": rng.randrange(2)}
        operands = {name: list(self.read(thread, ray, instruction[name])) for name in "abcx"}
        source = [*operands["x"], 0, int(FMT.encode(1.0))]
        operands["x"] = [source[choice] ^ (instruction["negate"] >> lane & 1) << FMT.width - 1
                         for lane, choice in enumerate(instruction["select"])]
        if not instruction["is_wide"]:
            operands["b"] = operands["c"] = [0] * 3
        self.expected.append((token, instruction, operands))
        return token

    def check(self, out):
        token, instruction, operands = self.expected.popleft()
        assert {name: out.token[name] for name in token} == token
        assert out.instruction.op == instruction["op"]
        for name in ("bit", "mask", "dst", "negate", "target", "store", "condition", "mode", "is_wide"):
            assert out.instruction[name] == instruction[name]
        for name, lanes in operands.items():
            assert list(out[name]) == lanes, name
        self.num_done += 1
        self.num_wide += instruction["is_wide"]
        self.idle.append((token["thread"], token["ray"]))


def set_camera(ctx, dut, camera):
    ctx.set(dut.camera, {"rows": [dict(zip("xyz", row, strict=True)) for row in camera[:3]],
                         "origin": dict(zip("xyz", camera[3], strict=True))})


def build(rays, *, num_threads, bank_bits=0):
    return InstructionFetch(fmt=FMT, num_threads=num_threads, program=rays.program, stack_depth=STACK_DEPTH,
                            bank_bits=bank_bits)


@pytest.mark.parametrize(("seed", "num_threads", "gap", "pause", "bank_bits"), [
    (0, 1, 0.0, 0.0, 0), (1, 3, 0.0, 0.3, 0), (2, 8, 0.5, 0.0, 1), (3, 8, 0.0, 0.8, 2), (4, 2, 0.2, 0.1, 1)])
def test_rays_in_turn(seed, num_threads, gap, pause, bank_bits):
    rng = random.Random(seed)
    bank = rng.randrange(1 << bank_bits)
    rays = Rays(rng, num_threads=num_threads, bank=bank, bank_bits=bank_bits)
    dut = build(rays, num_threads=num_threads, bank_bits=bank_bits)
    write, ray = Packed(dut.write.shape()), Packed(dut.ray.payload.shape())

    async def work(ctx):
        """Readies rays that are idle, and writes a register of one that is not ready."""
        set_camera(ctx, dut, rays.camera)
        while rays.num_done < 400:
            valid = bool(rays.idle)
            ctx.set(dut.write.valid, valid)
            starts = False
            if valid:
                thread, number = rays.idle[0]
                register, mask = rng.randrange(NUM_REGISTERS if rng.random() < 0.3 else 6), rng.randrange(8)
                value = [rng.getrandbits(lane_width(FMT)) for _ in range(3)]
                ctx.set(dut.write.as_value(), write.pack({
                    "valid": 1, "thread": thread, "ray": number, "number": register, "mask": mask, "value": value}))
                lanes = rays.registers[thread, number, register]
                lanes[:] = [new if mask >> lane & 1 else old
                            for lane, (old, new) in enumerate(zip(lanes, value, strict=True))]
                # With the last register that is written comes the ray.
                starts = rng.random() >= gap
                if starts:
                    ctx.set(dut.ray.payload.as_value(), ray.pack(rays.begin(*rays.idle.pop(0))))
            ctx.set(dut.ray.valid, starts)
            await ctx.tick()

    async def admit(ctx):
        while True:
            ctx.set(dut.admit, rng.random() >= pause)
            await ctx.tick()

    async def count(ctx):
        async for _, _, under_way in ctx.tick().sample(dut.under_way):
            assert under_way <= dut.capacity

    simulate(dut, work, name="instruction_fetch", background=(watch(dut.out, rays.check), admit, count))
    assert rays.num_wide > 60
    assert rays.num_done - rays.num_wide > 60


def test_an_instruction_a_clock_or_in_two():
    rng = random.Random(7)
    num_threads = 8
    rays = Rays(rng, num_threads=num_threads)
    dut = build(rays, num_threads=num_threads)
    ray = Packed(dut.ray.payload.shape())
    tokens, out_at = [], []

    async def work(ctx):
        set_camera(ctx, dut, rays.camera)
        for thread, number in list(rays.idle):
            tokens.append(rays.begin(thread, number))
            ctx.set(dut.ray.payload.as_value(), ray.pack(tokens[-1]))
            ctx.set(dut.ray.valid, 1)
            await ctx.tick()
        ctx.set(dut.ray.valid, 0)
        await ctx.tick().repeat(10)
        assert not out_at, "an instruction is taken up that was not admitted"
        assert ctx.get(dut.under_way) == 0
        ctx.set(dut.admit, 1)

    async def log(ctx):
        now = 0
        async for _, _, valid, admitted in ctx.tick().sample(dut.out.valid, dut.admit):
            if valid:
                out_at.append(now)
            now += admitted

    simulate(dut, work, until(lambda: len(out_at) == len(tokens), quiet=5), name="instruction_fetch",
             background=(log, watch(dut.out, rays.check)))
    expected, now = [], LATENCY - 1
    for token in tokens:
        now += 1 + rays.program.instructions[token["counter"]]["is_wide"]
        expected.append(now)
    assert out_at == expected
    assert 0 < rays.num_wide < len(tokens)


def test_nothing_more_is_taken_up_once_it_is_not_admitted():
    rng = random.Random(8)
    rays = Rays(rng, num_threads=8)
    dut = build(rays, num_threads=8)
    ray = Packed(dut.ray.payload.shape())

    async def work(ctx):
        set_camera(ctx, dut, rays.camera)
        for thread, number in list(rays.idle):
            ctx.set(dut.ray.payload.as_value(), ray.pack(rays.begin(thread, number)))
            ctx.set(dut.ray.valid, 1)
            await ctx.tick()
        ctx.set(dut.ray.valid, 0)
        while rays.expected:
            ctx.set(dut.admit, 1)
            await ctx.tick().repeat(rng.randrange(1, 5))
            ctx.set(dut.admit, 0)
            await ctx.tick()
            under_way, done = ctx.get(dut.under_way), rays.num_done
            await ctx.tick().repeat(12)
            counted.append((under_way, rays.num_done - done))
            assert ctx.get(dut.under_way) == 0

    counted = []
    simulate(dut, work, name="instruction_fetch", background=(watch(dut.out, rays.check),))
    assert len(counted) > 5
    # An instruction that is out just when it is counted is under way still.
    assert all(under_way - out in (0, 1) for under_way, out in counted)
    assert max(under_way for under_way, _ in counted) > 2
