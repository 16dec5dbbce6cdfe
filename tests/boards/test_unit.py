"""Units of a chip are what they are alone."""

import json

import pytest
from amaranth.hdl import Module, signed
from amaranth.lib import data, stream, wiring
from amaranth.lib.wiring import In, Out

from boards.design import design_of, synthesise
from boards.packing import pack
from boards.unit import Units
from rtl.queue import Queue

SHAPE = data.StructLayout({"a": 5, "b": 3})


class Pair(wiring.Component):
    """Two queues in a row."""

    def __init__(self):
        super().__init__({"i": In(stream.Signature(SHAPE)), "o": Out(stream.Signature(SHAPE))})

    def elaborate(self, platform):
        m = Module()
        m.submodules.first = first = Queue(SHAPE, depth=20)
        m.submodules.second = second = Queue(SHAPE, depth=4)
        wiring.connect(m, wiring.flipped(self.i), first.i)
        wiring.connect(m, first.o, second.i)
        wiring.connect(m, second.o, wiring.flipped(self.o))
        return m


@pytest.fixture(autouse=True)
def cache(tmp_path, monkeypatch):
    monkeypatch.setenv("DYNRT_CACHE", str(tmp_path / "cache"))


def kinds(design):
    """What it is made of, but for the harness."""
    return sorted(cell["type"] for name, cell in json.loads(synthesise(design))["modules"]["top"]["cells"].items()
                  if not name.startswith("harness"))


@pytest.mark.parametrize(("path", "depth"), [("chip.first", 20), ("chip.second", 4)])
def test_a_unit_is_what_it_is_alone(path, depth):
    alone = Queue(SHAPE, depth=depth)
    # As what connects it to others does: not all its outputs are registers.
    alone.latency = 0
    # `level` is used by nobody in a pair.
    unit, whole = Units(Pair()).design(path), design_of(alone, name="alone")
    assert pack(unit).ebr == pack(whole).ebr
    assert kinds(unit).count("TRELLIS_DPR16X4") == kinds(whole).count("TRELLIS_DPR16X4") > 0
    assert pack(unit).ff <= pack(whole).ff


def test_all_units_have_paths():
    assert Units(Pair()).paths[:2] == ["chip", "chip.first"]
    assert "chip.second" in Units(Pair()).paths


class Doubler(wiring.Component):
    """2·i of a signed number."""

    def __init__(self):
        super().__init__({"i": In(signed(6)), "o": Out(signed(7))})

    def elaborate(self, platform):
        m = Module()
        m.submodules.shift = shift = Shift()
        m.d.comb += [shift.i.eq(self.i), self.o.eq(shift.o)]
        return m


class Shift(wiring.Component):
    def __init__(self):
        super().__init__({"i": In(signed(6)), "o": Out(signed(7))})

    def elaborate(self, platform):
        m = Module()
        m.d.sync += self.o.eq(self.i << 1)
        return m


def test_signed_ports_are_ports():
    # A bit for each of the six that a register takes, and the harness before and behind.
    assert pack(Units(Doubler()).design("chip.shift")).ff == 6


def test_no_such_unit():
    with pytest.raises(KeyError, match="third"):
        Units(Pair()).design("chip.third")
