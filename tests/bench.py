"""What every testbench needs: a clock, a watchdog, and a waveform when something fails."""

import os
from contextlib import nullcontext
from pathlib import Path

from amaranth.sim import Simulator


class Hang(AssertionError):
    """The unit did not finish within the ticks it was given."""


def simulate(dut, *testbenches, background=(), ticks=20_000, name="test"):
    """Runs ``testbenches`` to their ends, and fails after ``ticks`` clock cycles.

    A failing run is repeated with a waveform in ``build/waves/NAME.vcd``, so testbenches have to be functions
    that start anew; ``DYNRT_WAVES=1`` asks for the waveform at once.
    """
    def run(waves):
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
        if waves:
            Path("build/waves").mkdir(parents=True, exist_ok=True)
        with simulator.write_vcd(f"build/waves/{name}.vcd") if waves else nullcontext():
            simulator.run()

    run(os.environ.get("DYNRT_WAVES") == "1")
