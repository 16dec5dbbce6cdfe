"""The register file against a dictionary of lanes."""

import random

import pytest

from fpu import FloatFormat
from rtl.layout import PACKET_RAYS
from rtl.microcode import NUM_REGISTERS, lane_width
from rtl.register_file import RegisterFile
from tests.bench import simulate

NARROW, WIDEST = FloatFormat(5, 8), FloatFormat(8, 23)
LITERALS = ((1.5, -2.0, 0.25), (7, (1 << 24) - 1, 0), (0.0, -0.0, 100.0))


def bits(fmt, values):
    return [int(fmt.encode(value)) if isinstance(value, float) else value for value in values]


def constants_of(fmt, camera):
    """By number, counted from the first constant."""
    return [[0, 0, 0], *(bits(fmt, vector) for vector in camera), *(bits(fmt, literal) for literal in LITERALS)]


def random_camera(rng):
    """Three rows, then the origin."""
    return [[rng.randrange(-64, 65) / 16 for _ in range(3)] for _ in range(4)]


@pytest.mark.parametrize("fmt", [NARROW, WIDEST], ids=str)
@pytest.mark.parametrize(("seed", "num_threads", "bank_bits"), [(0, 1, 0), (1, 3, 0), (2, 8, 2)])
def test_reads_what_was_written(fmt, seed, num_threads, bank_bits):
    rng = random.Random(seed)
    dut = RegisterFile(fmt=fmt, num_threads=num_threads, literals=LITERALS, bank_bits=bank_bits)
    threads = range(rng.randrange(1 << bank_bits), num_threads, 1 << bank_bits)
    camera = random_camera(rng)
    constants = constants_of(fmt, camera)
    registers = {}
    num_checked = {"register": 0, "constant": 0, "part of a register": 0}

    def place():
        return rng.choice(threads), rng.randrange(PACKET_RAYS), rng.choice([0, 1, 5, NUM_REGISTERS - 1])

    async def work(ctx):
        ctx.set(dut.camera, {"rows": [dict(zip("xyz", row, strict=True)) for row in camera[:3]],
                             "origin": dict(zip("xyz", camera[3], strict=True))})
        pending = []
        for _ in range(800):
            written = place()
            value = [rng.getrandbits(lane_width(fmt)) for _ in range(3)]
            mask, valid = rng.randrange(8), rng.random() < 0.6
            ctx.set(dut.write, dict(zip(("thread", "ray", "number"), written, strict=True))
                    | {"valid": valid, "mask": mask, "value": value})
            expected = []
            for port in range(2):
                thread, ray, number = place()
                if rng.random() < 0.4:
                    number = NUM_REGISTERS + rng.randrange(len(constants))
                    expected.append(list(constants[number - NUM_REGISTERS]))
                    num_checked["constant"] += 1
                else:
                    lanes = list(registers.get((thread, ray, number), [None] * 3))
                    if valid and (thread, ray, number) == written:
                        # What is read while it is written is anybody's guess.
                        lanes = [None if mask >> lane & 1 else known for lane, known in enumerate(lanes)]
                    expected.append(lanes)
                    num_checked["register"] += None not in lanes
                    num_checked["part of a register"] += None in lanes and lanes != [None] * 3
                ctx.set(dut.read[port], {"thread": thread, "ray": ray, "number": number})
            if valid:
                lanes = registers.setdefault(written, [None] * 3)
                for lane in range(3):
                    if mask >> lane & 1:
                        lanes[lane] = value[lane]
            pending.append(expected)
            if len(pending) > RegisterFile.read_latency:
                for port, lanes in enumerate(pending.pop(0)):
                    for lane, known in enumerate(lanes):
                        assert known is None or ctx.get(dut.value[port][lane]) == known
            await ctx.tick()

    simulate(dut, work, name="register_file")
    assert min(num_checked.values()) >= 20


def test_registers_begin_as_zero_and_lanes_are_apart():
    dut = RegisterFile(fmt=NARROW, num_threads=2, literals=())

    async def work(ctx):
        for mask in (0b010, 0b101):
            ctx.set(dut.write, {"valid": 1, "thread": 1, "ray": 2, "number": 9, "mask": mask,
                                "value": [mask, mask + 16, mask + 32]})
            await ctx.tick()
            ctx.set(dut.write.valid, 0)
            ctx.set(dut.read[1], {"thread": 1, "ray": 2, "number": 9})
            await ctx.tick().repeat(RegisterFile.read_latency)
            seen.append(list(ctx.get(dut.value[1])))

    seen = []
    simulate(dut, work, name="register_file")
    assert seen == [[0, 18, 0], [5, 18, 37]]
