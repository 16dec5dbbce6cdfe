"""A chip without what only a simulation looks at."""

import json

import pytest
from amaranth.hdl import Assert, Module, Signal
from amaranth.lib import data, stream, wiring
from amaranth.lib.wiring import In, Out
from amaranth.sim import Simulator

from boards.chip import OBSERVING, Unobserved, chip_design
from boards.design import design_of, synthesise
from boards.packing import pack
from rtl.config import ChipConfig
from rtl.dynrtc import DynRTC

# Of a chip only the members are looked at.
pytestmark = pytest.mark.filterwarnings("ignore::amaranth.hdl.UnusedElaboratable")


class Observed(wiring.Component):
    """Sums what comes by a stream; counts how often, and asserts of a register that nothing else needs."""

    latency = 1

    def __init__(self, *, is_observed=True):
        self._is_observed = is_observed
        observing = {"counters": Out(data.StructLayout({"cycles": 32})), "probe": Out(1)} if is_observed else {}
        super().__init__({"i": In(stream.Signature(8, always_ready=True)), "o": Out(stream.Signature(8)), **observing})

    def elaborate(self, platform):
        m = Module()
        m.d.comb += self.o.valid.eq(1)
        with m.If(self.i.valid & self.o.ready):
            m.d.sync += self.o.payload.eq(self.o.payload + self.i.payload)
        if self._is_observed:
            m.d.sync += [self.counters.cycles.eq(self.counters.cycles + 1), self.probe.eq(self.i.valid)]
            twice = Signal(9)
            m.d.sync += [twice.eq(self.i.payload << 1), Assert(~twice[0], "an odd double")]
        return m


@pytest.fixture(autouse=True)
def cache(tmp_path, monkeypatch):
    monkeypatch.setenv("DYNRT_CACHE", str(tmp_path / "cache"))


def kinds(design):
    return {cell["type"] for cell in json.loads(synthesise(design))["modules"]["top"]["cells"].values()}


def test_observing_costs_nothing():
    design = chip_design(Observed(), name="observed")
    assert "$check" not in kinds(design)
    plain = Observed(is_observed=False)
    plain.latency = 0
    assert pack(design) == pack(design_of(plain, name="plain"))
    # And would, if it were there.
    whole = design_of(Observed(), name="whole")
    assert "$check" in kinds(whole)
    assert pack(whole).ff > pack(design).ff + 32


def test_members_of_a_chip():
    chip = DynRTC(ChipConfig(num_threads=2))
    members = {*chip.signature.members}
    assert {*Unobserved(chip).signature.members} == members - {*OBSERVING}
    assert members >= {*OBSERVING}


def test_both_directions():
    dut = Unobserved(Observed())
    simulator = Simulator(dut)
    simulator.add_clock(1e-6)

    async def bench(ctx):
        assert ctx.get(dut.i.ready) == 1
        ctx.set(dut.i.payload, 3)
        ctx.set(dut.i.valid, 1)
        await ctx.tick().repeat(2)
        assert ctx.get(dut.o.payload) == 0
        ctx.set(dut.o.ready, 1)
        await ctx.tick().repeat(2)
        assert ctx.get(dut.o.payload) == 6

    simulator.add_testbench(bench)
    simulator.run()
