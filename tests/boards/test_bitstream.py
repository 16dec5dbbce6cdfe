"""A board's design, before it is synthesised: its pins and clocks, and that it is the same each time."""

import hashlib
import json
import os
import re
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import pytest

from boards import bitstream
from boards.bitstream import Routed, board_design
from boards.catalog import BOARDS
from boards.design import Design
from boards.toolchain import ToolError
from rtl.config import ChipConfig

#: Quick to elaborate
TINY = ChipConfig(num_threads=2, mailbox_entries=0, stack_depth=4, edge_tolerance=0)
#: Ports of an SDRAM of 16 bits, 13 rows and 2 of banks; of a screen; of a serial cable and a clock
SDRAM_PINS = {"clk": 1, "clk_en": 1, "cs": 1, "ras": 1, "cas": 1, "we": 1, "ba": 2, "a": 13, "dq": 16, "dqm": 2}


@pytest.mark.parametrize("name", BOARDS)
def test_every_pin_has_a_place(name):
    board = BOARDS[name]
    design, clocks = board_design(board, config=TINY, clock_mhz=board.clock_mhz)
    places = dict(re.findall(r'^LOCATE COMP "(\S+)" SITE "(\w+)";$', design.files["top.lpf"], re.MULTILINE))
    assert len(set(places.values())) == len(places), "two ports at one pin"
    for port, width in SDRAM_PINS.items():
        found = [place for place in places if re.fullmatch(rf"sdram_0__{port}__io(\[\d+\])?", place)]
        assert len(found) == width, port
    assert {"hdmi_0__clk__p", "uart_0__rx__io", "uart_0__tx__io"} <= set(places)
    assert len(re.findall(r"^ *cell \\DCCA ", design.files["top.il"], re.MULTILINE)) == 1, "the chip's reset is global"
    assert clocks["shift"] == pytest.approx(5 * clocks["pixel"])
    assert clocks["sync"] == clocks["sdram"] == pytest.approx(board.clock_mhz)
    assert f"FREQUENCY PORT \"clk{board.oscillator_mhz:g}_0__io\" {board.oscillator_mhz * 1e6:.1f} HZ;" in \
        design.files["top.lpf"]


def test_a_design_is_the_same_each_time():
    """Else nothing that was synthesised would be found again."""
    program = ("import hashlib; from boards.bitstream import board_design; from boards.catalog import BOARDS; "
               "from tests.boards.test_bitstream import TINY; "
               "design, _ = board_design(BOARDS['ulx3s_85f'], config=TINY, clock_mhz=50); "
               "print(hashlib.sha256(repr(design.files).encode()).hexdigest())")
    found = {subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True,
                            env={**os.environ, "PYTHONHASHSEED": seed}).stdout for seed in ("1", "2")}
    here, _ = board_design(BOARDS["ulx3s_85f"], config=TINY, clock_mhz=50)
    assert found == {hashlib.sha256(repr(here.files).encode()).hexdigest() + "\n"}


def test_what_cannot_be():
    board = BOARDS["ulx3s_85f"]
    with pytest.raises(ValueError, match=r"^the clock is 160 MHz; the SDRAM takes up to 133\.3$"):
        board_design(board, config=TINY, clock_mhz=160)
    with pytest.raises(ValueError, match=r"^3e\+06 baud at 10 MHz: "):
        board_design(board, config=TINY, clock_mhz=10)
    with pytest.raises(ValueError, match=r"^no PLL makes 1000, 200 MHz of 25 "):
        board_design(replace(board, mode=replace(board.mode, pixel_mhz=200)), config=TINY, clock_mhz=50)


@pytest.mark.parametrize(("net", "domain"), [
    ("$glbnet$clk", "sync"), ("clk", "sync"), ("$glbnet$pixel_clk", "pixel"), ("shift_clk", "shift"),
    ("$glbnet$component.clk", "sync"), ("$glbnet$component.display.bars.pixel_clk", "pixel")])
def test_nets_of_clocks(net, domain):
    assert bitstream._domain(net) == domain


def test_more_is_worked_for_than_is_wanted():
    """On the net of each clock by one of its names, and on no other."""
    cells = {"chip.pll": {"type": "EHXPLLL", "connections": {"CLKOP": [5], "CLKOS": [6], "CLKOS2": [], "CLKI": [3],
                                                             "LOCK": [7]}},
             "other": {"type": "TRELLIS_FF", "connections": {"CLK": [8]}}}
    names = {"oscillator_clk": [3], "a.b.clk": [5], "a.pixel_clk": [6], "locked": [7], "lost_clk": [8], "wide": [5, 6]}
    netlist = {"modules": {"top": {"cells": cells, "netnames": {name: {"bits": bits} for name, bits in names.items()}}}}
    design = Design(name="small", files={"top.lpf": "BLOCK ASYNCPATHS;"}, script="")
    assert bitstream._constraints(design, netlist, {"sync": 100.0, "pixel": 64.0, "shift": 320.0}).splitlines() == [
        "BLOCK ASYNCPATHS;", 'FREQUENCY NET "a.b.clk" 112.500 MHZ;', 'FREQUENCY NET "a.pixel_clk" 144.000 MHZ;']


def test_placed_and_routed_in_one_run(monkeypatch, tmp_path):
    """What nextpnr reads of what it has placed is another design; and there is no run for what is known."""
    monkeypatch.setenv("DYNRT_CACHE", str(tmp_path))
    calls, settings = [], []

    def run_tool(name, arguments, *, folder, what):
        calls.append(arguments)
        settings.append(json.loads((Path(folder) / "top.json").read_text())["modules"]["top"]["settings"])
        path = [{"type": "clk-to-q", "delay": 0.5, "from": {"cell": "a"}, "to": {"cell": "a"}},
                {"type": "routing", "delay": 9.5, "from": {"cell": "a"}, "to": {"cell": "b"}}]
        (Path(folder) / "report.json").write_text(json.dumps({
            "fmax": {"$glbnet$component.clk": {"achieved": 100.0, "constraint": 108.0}},
            "critical_paths": [{"from": "posedge $glbnet$component.clk", "to": "posedge $glbnet$component.clk",
                                "path": path}]}))
        (Path(folder) / "top.config").write_text("bits")
        (Path(folder) / "routed.json").write_text(json.dumps({"modules": {"top": {"cells": {
            "component.a": {"type": "TRELLIS_COMB"}}}}}))

    empty = json.dumps({"modules": {"top": {"ports": {}, "cells": {}, "netnames": {}}}}).encode()
    monkeypatch.setattr(bitstream, "run_tool", run_tool)
    monkeypatch.setattr(bitstream, "synthesise", lambda design: empty)
    board, design = BOARDS["ulx3s_85f"], Design(name="small", files={"top.lpf": ""}, script="")
    for _ in range(2):
        routed = bitstream.route(board, design, seed=3, clocks={"sync": 72.0})
    assert routed.mhz == {"sync": 100.0}
    assert routed.path.words == "a to b: 0 cells between, 0.5 ns in cells, 9.5 ns between them"
    arguments, = calls
    assert arguments[arguments.index("--seed") + 1] == "3"
    assert arguments[arguments.index("--freq") + 1] == "81.000"
    assert not {"--no-route", "--no-pack", "--no-place"} & set(arguments)
    # As nextpnr writes numbers
    assert settings == [{"router2/bbMargin/x": f"{8:032b}", "router2/bbMargin/y": f"{8:032b}"}]


def test_what_is_too_slow_is_not_packed(monkeypatch):
    """However it was placed: nextpnr itself is told to go on, so that the report has all seeds."""
    board = BOARDS["ulx3s_85f"]
    mhz = {"sync": 49.9, "pixel": 70.0, "shift": 330.0}
    routed = Routed(seed=3, mhz=mhz, path=None, areas={})
    monkeypatch.setattr(bitstream, "route", lambda *arguments, **options: routed)
    clocks = {"sync": 50.0, "sdram": 50.0, "pixel": 65.0, "shift": 325.0}
    assert routed.too_slow(clocks) == {"sync": 49.9}
    assert routed.too_slow(clocks | {"sync": 49.0}) == {}
    with pytest.raises(ToolError, match=r"^small, seed 3: timing is not met in sync; there is no bitstream$"):
        bitstream.pack_bitstream(board, Design(name="small", files={}, script=""), seed=3, clocks=clocks)
