"""Bytes over a wire, at rates that are a little off."""

import random
from collections import deque

import pytest
from amaranth.hdl import Elaboratable, Module

from rtl.host.uart import UartReceiver, UartTransmitter, uart_divisor
from tests.bench import drain, feed, simulate, until


def line(bits, period):
    """Levels of a wire, a cycle each, on which each bit takes a period that is no whole number."""
    levels, time = [], 0.0
    for bit in bits:
        time += period
        levels += [bit] * (round(time) - len(levels))
    return levels


def framed(byte, stop=1):
    return [0, *(byte >> place & 1 for place in range(8)), stop]


def received(levels, divisor):
    dut, found = UartReceiver(divisor=divisor), []

    async def wire(ctx):
        for level in [1] * 5 + levels + [1] * 12 * divisor:
            ctx.set(dut.rx, level)
            await ctx.tick()

    simulate(dut, wire, background=[drain(dut.o, found.append)], ticks=len(levels) + 13 * divisor + 10, name="uart")
    return found


@pytest.mark.parametrize(("divisor", "off"), [(4, 0.0), (5, 0.02), (8, -0.02), (41, 0.025), (42, -0.025), (434, 0.0)])
def test_receiver(divisor, off):
    rng = random.Random(divisor)
    sent = [rng.randrange(256) for _ in range(60 if divisor < 100 else 6)] + [0, 255, 0xC0]
    bits = []
    for byte in sent:
        bits += framed(byte) + [1] * rng.choice((0, 0, 0, 1, 7))
    assert received(line(bits, divisor * (1 + off)), divisor) == sent


def test_a_byte_without_a_stop_bit_is_dropped():
    # The wire stays low for long: cable pulled, or a break.
    bits = framed(0x55) + framed(0x0F, stop=0) + [0] * 35 + [1] * 3 + framed(0xA5)
    assert received(line(bits, 8), 8) == [0x55, 0xA5]


def test_a_spike_is_no_start_bit():
    assert received([0] * 3 + [1] * 40 + line(framed(0x3C), 16), 16) == [0x3C]


class Loop(Elaboratable):
    def __init__(self, divisor):
        self.transmitter, self.receiver = UartTransmitter(divisor=divisor), UartReceiver(divisor=divisor)

    def elaborate(self, platform):
        m = Module()
        m.submodules += [self.transmitter, self.receiver]
        m.d.comb += self.receiver.rx.eq(self.transmitter.tx)
        return m


@pytest.mark.parametrize(("divisor", "gap"), [(4, 0.0), (5, 0.99), (9, 0.0)])
def test_transmitter(divisor, gap):
    rng = random.Random(divisor)
    sent = [rng.randrange(256) for _ in range(50)]
    dut, found = Loop(divisor), []
    simulate(dut, until(lambda: len(found) == len(sent), quiet=20 * divisor), name="uart_loop", background=[
        feed(dut.transmitter.i, deque(sent), rng=rng, gap=gap), drain(dut.receiver.o, found.append)])
    assert found == sent


def test_bytes_follow_each_other_at_once():
    dut, levels = UartTransmitter(divisor=4), []

    async def watch(ctx):
        for _ in range(4 * 10 * 3 + 6):
            levels.append(ctx.get(dut.tx))
            await ctx.tick()

    simulate(dut, watch, name="uart_tx", background=[feed(dut.i, deque([0x81, 0x7E, 0xFF]), rng=random.Random(1))])
    start = levels.index(0)
    expected = [bit for byte in (0x81, 0x7E, 0xFF) for bit in framed(byte) for _ in range(4)]
    assert (levels[start:] + [1] * 10)[:len(expected)] == expected


def test_divisors():
    assert uart_divisor(clock_hz=125e6, baud=3e6) == 42
    assert uart_divisor(clock_hz=100e6, baud=3e6) == 33
    assert uart_divisor(clock_hz=25e6, baud=115200) == 217
    with pytest.raises(ValueError, match=r"^3e\+06 baud at 25 MHz: 8 clocks a bit are \+4\.2% off; it must be "
                                         r"within 2%, and at least 4 clocks$"):
        uart_divisor(clock_hz=25e6, baud=3e6)
    with pytest.raises(ValueError, match="3 clocks a bit"):
        uart_divisor(clock_hz=9e6, baud=3e6)
