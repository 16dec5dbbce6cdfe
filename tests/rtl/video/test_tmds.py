"""Each byte at each running disparity, by a decoder that knows only the specification's other side."""

import random
from itertools import pairwise

import numpy as np
import pytest

from rtl.video.tmds_encoder import TmdsEncoder
from sim.machine.dvi_receiver import _BYTES, DviError, DviReceiver, decode_byte
from tests.bench import simulate


def encoded(inputs):
    """Symbols of a list of (byte or None, control)."""
    dut, symbols = TmdsEncoder(), []

    async def testbench(ctx):
        for number in range(len(inputs) + dut.latency):
            byte, control = inputs[number] if number < len(inputs) else (None, 0)
            ctx.set(dut.active, byte is not None)
            ctx.set(dut.byte, byte or 0)
            ctx.set(dut.control, control)
            await ctx.tick()
            symbols.append(ctx.get(dut.symbol))

    simulate(dut, testbench, ticks=len(inputs) + 10, name="tmds")
    return symbols[dut.latency - 1:][:len(inputs)]


def as_cable(symbols):
    """Bits of three channels that carry the same, and of a clock."""
    bits = np.array([symbol >> place & 1 for symbol in symbols for place in range(10)], np.uint8)
    return np.stack([bits] * 3 + [np.tile(np.repeat(np.array([1, 0], np.uint8), 5), len(symbols))])


def test_lines_of_random_bytes():
    rng = random.Random(1)
    inputs, wanted = [(None, 0)] * 12, []
    for _ in range(100):
        line = [rng.randrange(256) for _ in range(rng.randrange(1, 90))]
        wanted += line
        inputs += [*((byte, 0) for byte in line), *((None, rng.randrange(4)) for _ in range(12))]
    symbols = encoded(inputs)
    receiver = DviReceiver(as_cable(symbols))
    sent = [symbol for (byte, _), symbol in zip(inputs, symbols, strict=True) if byte is not None]
    assert [decode_byte(symbol) for symbol in sent] == wanted
    assert receiver.pixels[receiver.active][:, 0].tolist() == wanted
    assert receiver.max_disparity == max(prefixes())
    disparities, running = set(), 0
    for (byte, _), symbol in zip(inputs, symbols, strict=True):
        running = 0 if byte is None else running + 2 * symbol.bit_count() - 10
        disparities.add(running)
    assert disparities == set(prefixes())


def test_what_disparities_there_are():
    assert set(prefixes()) == set(range(-8, 9, 2))


@pytest.mark.parametrize("start", range(-8, 9, 2))
def test_each_byte_from_a_disparity(start):
    """All 256 bytes right behind a prefix that makes the disparity."""
    prefix = prefixes()[start]
    inputs = []
    for byte in range(256):
        inputs += [*((None, 0) for _ in range(12)), *((each, 0) for each in prefix), (byte, 0)]
    receiver = DviReceiver(as_cable(encoded(inputs)))
    decoded = receiver.pixels[receiver.active][:, 1]
    assert decoded.reshape(256, -1)[:, -1].tolist() == list(range(256))


def prefixes():
    """For each disparity the shortest bytes that lead there, by the symbols that a decoder allows."""
    known, edge = {0: []}, [0]
    while edge:
        following = []
        for running in edge:
            for symbol in range(1024):
                low = 2 * (symbol & 255).bit_count() - 8
                balanced = running == 0 or low == 0
                right = (symbol >> 9) != (symbol >> 8 & 1) if balanced else (low > 0) != (running > 0)
                after = running + 2 * symbol.bit_count() - 10
                if _BYTES[symbol] >= 0 and right and after not in known:
                    known[after] = [*known[running], int(_BYTES[symbol])]
                    following.append(after)
        edge = following
    return known


def test_controls_are_what_syncs_are_read_from():
    inputs = [(None, control) for control in (0, 1, 2, 3) for _ in range(12)]
    receiver = DviReceiver(as_cable(encoded(inputs)))
    assert not receiver.active.any()
    assert (receiver.h_sync + 2 * receiver.v_sync).tolist() == [control for _, control in inputs]


def test_symbols_are_as_printed():
    """From the specification's flow chart, by hand."""
    symbols = encoded([(None, 0), (0x00, 0), (0x00, 0), (0xFF, 0), (None, 0)])
    # q_m of 0x00 is 1 00000000: balanced, then 8 zeros follow a disparity of −8 and are inverted.
    assert symbols == [0b1101010100, 0b0100000000, 0b1111111111, 0b1000000000, 0b1101010100]


def test_wrong_symbols_are_found():
    rng = random.Random(2)
    inputs = [(None, 0)] * 12 + [(rng.randrange(256), 0) for _ in range(100)] + [(None, 0)] * 12
    good = encoded(inputs)
    DviReceiver(as_cable(good))
    found = 0
    for place in range(12, 112):
        bad = list(good)
        # The same byte, inverted when it must not be, or not when it must
        bad[place] ^= 0b10_1111_1111
        with pytest.raises(DviError, match="blue: symbol"):
            DviReceiver(as_cable(bad))
        found += 1
    assert found == 100
    # 0x01 is chained with ⊕, as it has a single one; here with the inverse. Inverted, as the first byte of a line is if
    # it lacks q₈.
    other = 1 << 9 | word_of(0x01, exclusive=False) ^ 255
    assert decode_byte(other) == 0x01
    with pytest.raises(DviError, match="coded with more transitions"):
        DviReceiver(as_cable([*good[:12], other, *good[-12:]]))
    with pytest.raises(DviError, match="no run of 12 controls"):
        DviReceiver(as_cable(good[12:112]))


def word_of(byte, *, exclusive):
    """The eight bits of a byte by the chain that is asked for."""
    bits = [byte & 1]
    for place in range(1, 8):
        bits.append(bits[-1] ^ byte >> place & 1 ^ (not exclusive))
    return sum(bit << place for place, bit in enumerate(bits))


def test_the_clock_is_looked_at():
    cable = as_cable([0b1101010100] * 20)
    cable[3, 73] ^= 1
    with pytest.raises(DviError, match=r"^clock: is not a clock of ten bits$"):
        DviReceiver(cable)


def test_transitions_are_few():
    symbols = encoded([(None, 0), *((byte, 0) for byte in range(256))])[1:]
    for symbol in symbols:
        bits = [symbol >> place & 1 for place in range(8)]
        assert sum(a != b for a, b in pairwise(bits)) <= 4
