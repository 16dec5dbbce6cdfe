"""Netlists of Yosys, made ready for nextpnr."""

import json
import re
from collections import defaultdict

from .harness import is_of_harness

__all__ = ["absorb_registers", "free_carry_ends"]

_NEVER, _ALWAYS = ["0"], ["1"]


def _readers(module):
    """Of each bit, who takes it: cell and port by their names, None for a port of the module."""
    readers = defaultdict(list)
    for port in module["ports"].values():
        for bit in port["bits"]:
            readers[bit].append(None)
    for name, cell in module["cells"].items():
        for port, bits in cell["connections"].items():
            if cell["port_directions"][port] != "output":
                for bit in bits:
                    readers[bit].append((name, port))
    return readers


def _passes_no_carry(cell):
    # The upper half of a place's initial value is its table, with the fourth input set, as it is when it adds.
    return int(cell["parameters"]["INIT0"], 2) >> 8 == 0


def free_carry_ends(text):
    """The netlist without what nextpnr would put at the ends of carry chains for nothing, two places each.

    It leads a carry out of a chain that somebody gave a name, though nobody takes it, as all that synthesis makes; and
    it leads a zero into a chain whose first place lets no carry pass, so that it does not matter what comes in.

    Parameters
    ----------
    text : str
        JSON as ``write_json`` writes it.
    """
    netlist = json.loads(text)
    for module in netlist["modules"].values():
        readers = _readers(module)
        for cell in module["cells"].values():
            if cell["type"] != "CCU2C":
                continue
            ends = cell["connections"]
            if not any(readers[bit] for bit in ends.get("COUT", [])):
                ends["COUT"] = ["x"]
            if ends["CIN"] == ["0"] and _passes_no_carry(cell):
                ends["CIN"] = ["x"]
    return json.dumps(netlist)


def absorb_registers(text):
    """The netlist with the registers behind block RAMs moved into them, where their outputs come 4 ns earlier.

    A read port takes its register only whole: all flip-flops behind it, each alone behind its bit, without enable or
    reset, on the port's clock, and with a port that reads in every cycle. Those that a harness holds stay.

    Parameters
    ----------
    text : str
        JSON as ``write_json`` writes it.
    """
    netlist = json.loads(text)
    for module in netlist["modules"].values():
        cells = module["cells"]
        readers = _readers(module)
        for memory in [cell for cell in cells.values() if cell["type"] == "DP16KD"]:
            for side, outputs in _read_ports(memory).items():
                registers = _registers_behind(cells, readers, memory, side, outputs)
                if registers:
                    _absorb(cells, memory, side, outputs, registers)
    return json.dumps(netlist)


def _read_ports(memory):
    """Sides of a block RAM that are read, with the names of their outputs; one 36 bits wide reads with both halves."""
    outputs = defaultdict(list)
    is_wide = int(memory["parameters"]["DATA_WIDTH_A"], 2) == 36
    for port in memory["connections"]:
        if (found := re.fullmatch(r"DO([AB])\d+", port)) and memory["connections"][port]:
            outputs["B" if is_wide else found[1]].append(port)
    return outputs


def _registers_behind(cells, readers, memory, side, outputs):
    """Names of the flip-flops behind a read port, one for each output that is used; none if they must stay."""
    ends = memory["connections"]
    # A memory that is only read has parameters of one side.
    is_inverted = memory["parameters"].get(f"CLK{side}MUX") == "INV"
    if ends.get(f"CE{side}") != _ALWAYS or ends.get(f"RST{side}", _NEVER) != _NEVER or is_inverted:
        return {}
    registers = {}
    for output in outputs:
        behind = readers[ends[output][0]]
        if not behind:
            continue
        if len(behind) > 1 or behind[0] is None:
            return {}
        (name, port), = behind
        cell = cells[name]
        on_its_clock = cell["connections"].get("CLK") == ends[f"CLK{side}"]
        if port != "DI" or is_of_harness(name) or not on_its_clock or not _only_delays(cell):
            return {}
        registers[output] = name
    return registers


def _only_delays(cell):
    """Whether a cell is a flip-flop that neither waits nor is reset."""
    parameters, ends = cell["parameters"], cell["connections"]
    # A string of digits alone has a space behind it in this JSON.
    return (cell["type"] == "TRELLIS_FF" and parameters.get("CEMUX", "").strip() == "1"
            and parameters.get("CLKMUX", "CLK") == "CLK" and ends.get("LSR", _NEVER) == _NEVER)


def _absorb(cells, memory, side, outputs, registers):
    ends = memory["connections"]
    for output in outputs:
        if output in registers:
            ends[output] = cells.pop(registers[output])["connections"]["Q"]
    # Of one 36 bits wide the lower half goes through the other side's register.
    for half in {side, *(output[2] for output in outputs)}:
        memory["parameters"][f"REGMODE_{half}"] = "OUTREG"
        ends[f"OCE{half}"] = _ALWAYS
