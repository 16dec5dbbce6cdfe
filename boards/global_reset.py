"""Where a reset enters a global network."""

import json

__all__ = ["PLACE", "lead_reset"]

#: Near the corner where nextpnr says that wires of global networks are. Without threads, as in WebAssembly, its router2
#: looks for a net's way only in the part of the device that the net is in, and stops if there is none.
PLACE = "X3/Y5/SLICEA.FF0"


def lead_reset(text):
    """The netlist with the flip-flop that drives a ``DCCA`` at :data:`PLACE`, by which the ``DCCA`` is on that side.

    Parameters
    ----------
    text : str or bytes
        JSON as ``write_json`` of Yosys writes it, before nextpnr adds the ``DCCA`` of clocks.
    """
    netlist = json.loads(text)
    for module in netlist["modules"].values():
        cells = module["cells"].values()
        entered = [cell["connections"]["CLKI"] for cell in cells if cell["type"] == "DCCA"]
        for cell in cells:
            if cell["type"] == "TRELLIS_FF" and cell["connections"]["Q"] in entered:
                cell["attributes"]["BEL"] = PLACE
    return json.dumps(netlist)
