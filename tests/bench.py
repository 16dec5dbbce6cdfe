"""What every testbench needs: a clock, a watchdog, streams with gaps, and a waveform when something fails."""

import os
from contextlib import nullcontext
from enum import Enum
from pathlib import Path

from amaranth.hdl import ShapeCastable, Value
from amaranth.lib import data
from amaranth.sim import Simulator


class Hang(AssertionError):
    """The unit did not finish within the ticks it was given."""


def simulate(dut, *testbenches, background=(), ticks=20_000, name="test"):
    """Runs ``testbenches`` to their ends, and fails after ``ticks`` clock cycles.

    With ``DYNRT_WAVES=1`` in the environment it leaves a waveform in ``build/waves/NAME.vcd``; a test of a unit that
    fails is repeated that way (see ``tests/rtl/conftest.py``).
    """
    async def watchdog(ctx):
        for _ in range(ticks):
            await ctx.tick()
        raise Hang(f"{name}: not finished after {ticks} ticks")

    simulator = Simulator(dut)
    simulator.add_clock(1e-8)
    for testbench in testbenches:
        simulator.add_testbench(testbench)
    for testbench in (*background, watchdog):
        simulator.add_testbench(testbench, background=True)
    waves = os.environ.get("DYNRT_WAVES") == "1"
    if waves:
        Path("build/waves").mkdir(parents=True, exist_ok=True)
    with simulator.write_vcd(f"build/waves/{name}.vcd") if waves else nullcontext():
        simulator.run()


class Packed:
    """A shape's values as bits and back; for layouts many times faster than the simulator's own way."""

    def __init__(self, shape):
        self._shape = shape
        self._fields = None
        if isinstance(shape, data.Layout):
            self._fields = {name: (field.offset, (1 << field.width) - 1, Packed(field.shape)) for name, field in shape}

    def pack(self, value):
        if self._fields is not None:
            items = value.items() if isinstance(value, dict) else enumerate(value)
            fields = ((self._fields[name], item) for name, item in items)
            return sum((packed.pack(item) & mask) << offset for (offset, mask, packed), item in fields)
        if isinstance(value, float):
            return int(self._shape.encode(value))
        return value.value if isinstance(value, Enum) else value

    def unpack(self, bits):
        return self._shape.from_bits(bits) if isinstance(self._shape, ShapeCastable) else bits


def feed(port, queue, *, rng, gap=0.0):
    """Background testbench that offers what is in the deque ``queue`` to a stream, pausing with probability ``gap``."""
    packed, payload = Packed(port.payload.shape()), Value.cast(port.payload)

    async def testbench(ctx):
        offers = False
        async for _, _, ready in ctx.tick().sample(port.ready):
            if offers and not ready:
                continue
            starts = bool(queue) and rng.random() >= gap
            if starts:
                ctx.set(payload, packed.pack(queue.popleft()))
            if starts != offers:
                ctx.set(port.valid, starts)
            offers = starts
    return testbench


def drain(port, take, *, rng=None, gap=0.0):
    """Background testbench that calls ``take`` with what a stream delivers, refusing with probability ``gap``."""
    packed, sampled = Packed(port.payload.shape()), (port.valid, port.ready, Value.cast(port.payload))

    async def testbench(ctx):
        accepts = port.signature.always_ready
        async for _, _, valid, ready, bits in ctx.tick().sample(*sampled):
            if valid and ready:
                take(packed.unpack(bits))
            if not port.signature.always_ready:
                before, accepts = accepts, not gap or rng.random() >= gap
                if accepts != before:
                    ctx.set(port.ready, accepts)
    return testbench


def steady(port):
    """Background testbench that asserts that what a stream offers stays until it is taken."""
    sampled = port.valid, port.ready, Value.cast(port.payload)

    async def testbench(ctx):
        offered = None
        async for _, _, valid, ready, bits in ctx.tick().sample(*sampled):
            assert offered is None or (valid and bits == offered), "an offer is withdrawn"
            offered = bits if valid and not ready else None
    return testbench


def watch(event, take):
    """Background testbench that calls ``take`` with ``event`` in each cycle in which it is ``valid``."""
    packed, sampled = Packed(event.shape()), (event.valid, Value.cast(event))

    async def testbench(ctx):
        async for _, _, valid, value in ctx.tick().sample(*sampled):
            if valid:
                take(packed.unpack(value))
    return testbench


def memory(address, data, read):
    """Background testbench: two cycles after ``address``, ``data`` is what ``read`` has made of it."""
    places, contents = Packed(address.shape()), Packed(data.shape())
    sampled, output = Value.cast(address), Value.cast(data)

    async def testbench(ctx):
        following = None
        async for _, _, at in ctx.tick().sample(sampled):
            if following is not None:
                ctx.set(output, following)
            following = contents.pack(read(places.unpack(at)))
    return testbench


def until(finished, *, quiet=0):
    """Testbench that ends ``quiet`` cycles after ``finished()`` has become true."""
    async def testbench(ctx):
        while not finished():
            await ctx.tick()
        for _ in range(quiet):
            await ctx.tick()
    return testbench
