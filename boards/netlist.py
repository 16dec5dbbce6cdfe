"""Netlists of Yosys, made ready for nextpnr."""

import json
from collections import Counter

__all__ = ["free_carry_ends"]


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
        used = Counter(bit for port in module["ports"].values() for bit in port["bits"])
        for cell in module["cells"].values():
            for port, bits in cell["connections"].items():
                if cell["port_directions"][port] != "output":
                    used.update(bits)
        for cell in module["cells"].values():
            if cell["type"] != "CCU2C":
                continue
            ends = cell["connections"]
            if not any(used[bit] for bit in ends.get("COUT", [])):
                ends["COUT"] = ["x"]
            if ends["CIN"] == ["0"] and _passes_no_carry(cell):
                ends["CIN"] = ["x"]
    return json.dumps(netlist)
