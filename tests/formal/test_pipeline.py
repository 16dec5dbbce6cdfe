"""A pipeline neither loses nor reorders: r(t) = f(a(t - latency), b(t - latency)) for all operands in every cycle."""

import pytest
from amaranth.hdl import Assert, Module, Signal

from fpu import Adder, Comparator, Divider, FloatFormat, Multiplier
from tests.formal.prove import Refuted, prove

TINY = FloatFormat(3, 2)
#: One, and so on until every step has a register, and one more.
LATENCIES = [(cls, latency) for cls in (Adder, Multiplier, Divider, Comparator)
             for latency in range(1, len(cls._step_delays(TINY)) + 2)]


def results(operator):
    return [operator.lt, operator.eq, operator.gt] if isinstance(operator, Comparator) else [operator.r.as_value()]


def claim(cls, latency, *, late=0):
    """That the results are those of the operator without registers, ``latency`` + ``late`` cycles before."""
    m = Module()
    ports = [Signal(TINY.width, name=name) for name in "ab"]
    m.submodules.pipelined, m.submodules.combinational = dut, model = cls(TINY, latency=latency), cls(TINY, latency=0)
    delayed = ports
    for _ in range(latency + late):
        earlier, delayed = delayed, [Signal.like(port, reset_less=True) for port in ports]
        m.d.sync += [port.eq(value) for port, value in zip(delayed, earlier, strict=True)]
    # Only what went in after the beginning is to come out.
    cycles = Signal(range(latency + late + 1), reset_less=True)
    with m.If(cycles != latency + late):
        m.d.sync += cycles.eq(cycles + 1)
    for operator, operands in ((dut, ports), (model, delayed)):
        m.d.comb += [operator.a.eq(TINY(operands[0])), operator.b.eq(TINY(operands[1]))]
    for got, want in zip(results(dut), results(model), strict=True):
        m.d.comb += Assert((cycles != latency + late) | (got == want))
    return m, ports


@pytest.mark.parametrize(("cls", "latency"), LATENCIES)
def test_pipeline(cls, latency, tmp_path):
    module, ports = claim(cls, latency)
    prove(module, ports=ports, cycles=latency + 2, by_induction=True, folder=tmp_path)


def test_a_wrong_latency_is_refuted(tmp_path):
    module, ports = claim(Multiplier, 2, late=1)
    with pytest.raises(Refuted, match="model found"):
        prove(module, ports=ports, cycles=5, by_induction=True, folder=tmp_path)
