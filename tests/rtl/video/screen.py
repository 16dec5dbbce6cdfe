"""A monitor at the pins of a simulated transmitter."""

import numpy as np
from amaranth.hdl import Value
from amaranth.sim import Simulator

from rtl.video.mode import VideoMode
from sim.machine.dvi_receiver import DviReceiver, unpacked

__all__ = ["TINY", "expected_bars", "received"]

#: As little as there can be of a screen
TINY = VideoMode(name="tiny", pixel_mhz=25.0, width=48, h_front=3, h_sync=5, h_back=16, height=20, v_front=2, v_sync=3,
                 v_back=4, h_positive=True)


def received(dut, *, clocks, phase=0.0, sync=None, testbenches=(), keep=False):
    """What a monitor receives in so many pixel clocks; ``phase`` is the shift clock's, in its periods.

    With ``sync``, that many nanoseconds are the period of a domain of that name; with ``keep``, bits are returned.
    """
    pairs, taken = Value.cast(dut.pairs), []
    simulator = Simulator(dut)
    simulator.add_clock(40e-9, domain="pixel")
    simulator.add_clock(8e-9, phase=8e-9 * phase, domain="shift")
    if sync is not None:
        simulator.add_clock(sync * 1e-9, domain="sync")

    async def monitor(ctx):
        tick = ctx.tick("shift").sample(pairs)
        async for _, _, value in tick:
            taken.append(value)
            if len(taken) == 5 * clocks:
                return

    simulator.add_testbench(monitor)
    for testbench in testbenches:
        simulator.add_testbench(testbench, background=True)
    simulator.run()
    return unpacked(taken) if keep else DviReceiver(unpacked(taken))


def expected_bars(width, height):
    """The test picture as its description has it."""
    y, x = np.mgrid[:height, :width]
    bar = sum((x >= number * width // 8).astype(int) for number in range(1, 8))
    bars = 255 * np.stack([1 - (bar >> 1 & 1), 1 - (bar >> 2 & 1), 1 - (bar & 1)], axis=-1)
    which = y // 32 % 4
    ramps = np.stack([np.where((which == 0) | (which == number), x % 256, 0) for number in (1, 2, 3)], axis=-1)
    picture = np.where((y >= height // 2)[..., None], ramps, bars)
    picture[[0, -1]] = 255
    picture[:, [0, -1]] = 255
    return picture.astype(np.uint8)
