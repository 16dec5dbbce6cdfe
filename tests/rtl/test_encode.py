"""Encoding against the curve itself."""

import random

from rtl.encode import Encode
from tests.bench import simulate
from tests.rtl import colors


def encode(values):
    """Bytes of colours, three a clock."""
    dut = Encode()
    values = [*values, *[0] * (-len(values) % 3)]
    got = []

    async def testbench(ctx):
        for now in range(len(values) // 3 + dut.latency):
            if now < len(values) // 3:
                ctx.set(dut.color, values[3 * now:3 * now + 3])
            if now >= dut.latency:
                got.extend(ctx.get(dut.encoded[number]) for number in range(3))
            await ctx.tick()

    simulate(dut, testbench, ticks=len(values), name="encode")
    return got


def test_every_place_of_the_tables():
    """All colours of a place of a table have the byte of its middle."""
    rng = random.Random(7)
    places = [(4 * place, 4) for place in range(1024)] + [(64 * place, 64) for place in range(64, 1024)]
    values = [first + within for first, size in places for within in (0, size - 1, rng.randrange(size))]
    want = [colors.encoded_byte(first + size / 2) for first, size in places for _ in range(3)]
    assert encode(values)[:len(want)] == want


def test_from_one_on_it_is_255():
    values = [65535, 65536, 65537, 65536 + 4095, 1 << 17, 1 << 20, 1 << 23, (1 << 24) - 1, 0xff0000, 0]
    assert encode(values)[:len(values)] == [255] * 9 + [0]


def test_it_takes_back_what_decoding_did():
    assert encode([colors.linear_color(byte) for byte in range(256)])[:256] == list(range(256))
