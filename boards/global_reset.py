"""Where a reset enters a global network, and who reads it there."""

from copy import deepcopy

__all__ = ["PLACE", "lead_reset"]

#: Near the corner where nextpnr says that wires of global networks are. Without threads, as in WebAssembly, its router2
#: looks for a net's way only in the part of the device that the net is in, and stops if there is none.
PLACE = "X3/Y5/SLICEA.FF0"
#: Resets of flip-flops, block RAMs and multipliers; a pin of any other name is logic that reads it.
_RESETS = {"LSR", "RSTA", "RSTB", "RST0", "RST1", "RST2", "RST3"}


def lead_reset(netlist):
    """Puts the flip-flop that drives a ``DCCA`` at :data:`PLACE`, by which the ``DCCA`` is on that side.

    Logic that reads the reset has it from a copy of that flip-flop: nextpnr gives the way from a global network to a
    table's input for certain, before all others, and then has none for what shares those wires.

    Parameters
    ----------
    netlist : dict
        What ``write_json`` of Yosys writes, before nextpnr adds the ``DCCA`` of clocks; it is changed.
    """
    for module in netlist["modules"].values():
        cells = module["cells"]
        buffers = {cell["connections"]["CLKI"][0]: cell["connections"]["CLKO"][0]
                   for cell in cells.values() if cell["type"] == "DCCA"}
        entered = [name for name, cell in cells.items()
                   if cell["type"] == "TRELLIS_FF" and cell["connections"]["Q"][0] in buffers]
        for name in entered:
            spread = buffers[cells[name]["connections"]["Q"][0]]
            cells[name]["attributes"]["BEL"] = PLACE
            _copy_for_logic(module, name, spread)


def _copy_for_logic(module, driver, spread):
    """Lets a copy of ``driver`` drive those pins of the net ``spread`` that are no resets."""
    cells = module["cells"]
    places = [(name, port, place) for name, cell in cells.items() for port, bits in cell["connections"].items()
              if port not in _RESETS and cell["port_directions"][port] == "input"
              for place, bit in enumerate(bits) if bit == spread]
    if not places:
        return
    name = f"{driver}$logic"
    bit = 1 + max(bit for net in module["netnames"].values() for bit in net["bits"] if isinstance(bit, int))
    copy = deepcopy(cells[driver])
    del copy["attributes"]["BEL"]
    copy["connections"]["Q"] = [bit]
    cells[name] = copy
    module["netnames"][name] = {"hide_name": 1, "bits": [bit], "attributes": {}}
    for reader, port, place in places:
        cells[reader]["connections"][port][place] = bit
