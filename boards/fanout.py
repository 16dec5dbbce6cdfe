"""Copies of what drives many, so that each copy can be near those it drives."""

import re
from collections import defaultdict
from copy import deepcopy
from itertools import count

__all__ = ["MAX_READERS", "split_fanout"]

#: Pins that one cell drives. What drives hundreds, such as the choice of a wide register, has ways of 11 ns after
#: routing, as each of its pins is led to the nearest branch that there is, however long the way to that has been.
MAX_READERS = 48
#: By kind of cell that is copied, its output
_OUTPUTS = {"LUT4": "Z", "TRELLIS_FF": "Q"}
_CLOCKS = {"CLK", "WCK", "CLKA", "CLKB"}
#: A copy makes one reader more of what it reads itself, which may then have too many.
_PASSES = 4


def _natural(name):
    return [int(part) if part.isdigit() else part for part in re.split(r"(\d+)", name)]


def _readers(module):
    """Of each bit, its pins by cell, ``(port, place)``; bits that are clocks or ports of the module are not there."""
    readers = defaultdict(lambda: defaultdict(list))
    never = {bit for port in module["ports"].values() for bit in port["bits"]}
    for name, cell in module["cells"].items():
        for port, bits in cell["connections"].items():
            if cell["port_directions"][port] == "output":
                continue
            if port in _CLOCKS:
                never.update(bits)
            for place, bit in enumerate(bits):
                readers[bit][name].append((port, place))
    return {bit: cells for bit, cells in readers.items() if bit not in never and isinstance(bit, int)}


def _groups(cells, limit):
    """The cells in as few groups as ``limit`` pins in each ask for, about as large as each other; a cell stays whole.

    Neighbours by name, as bits of one register are, stay together.
    """
    names = sorted(cells, key=_natural)
    total = sum(len(cells[name]) for name in names)
    size = -(-total // -(-total // limit))
    groups, pins = [[]], 0
    for name in names:
        if groups[-1] and pins + len(cells[name]) > size:
            groups.append([])
            pins = 0
        groups[-1].append(name)
        pins += len(cells[name])
    return groups


def split_fanout(netlist, *, limit=MAX_READERS):
    """Copies tables and flip-flops that drive more than ``limit`` pins, for a part of the pins each.

    Parameters
    ----------
    netlist : dict
        What ``write_json`` of Yosys writes; it is changed.
    limit : int
        Pins that one may drive; one cell's stay together, so it may be a few more.
    """
    for module in netlist["modules"].values():
        cells = module["cells"]
        bits = (bit for net in module["netnames"].values() for bit in net["bits"])
        fresh = count(1 + max((bit for bit in bits if isinstance(bit, int)), default=0))
        for _ in range(_PASSES):
            drivers = {cell["connections"][_OUTPUTS[cell["type"]]][0]: name
                       for name, cell in cells.items() if cell["type"] in _OUTPUTS}
            for bit, pins in _readers(module).items():
                if bit in drivers and sum(map(len, pins.values())) > limit:
                    for group in _groups(pins, limit)[1:]:
                        _move(module, drivers[bit], {name: pins[name] for name in group}, next(fresh))


def _move(module, driver, pins, bit):
    """Lets a copy of ``driver`` drive these pins, by a net of its own."""
    name = f"{driver}$copy{bit}"
    copy = deepcopy(module["cells"][driver])
    copy["connections"][_OUTPUTS[copy["type"]]] = [bit]
    module["cells"][name] = copy
    module["netnames"][name] = {"hide_name": 1, "bits": [bit], "attributes": {}}
    for reader, places in pins.items():
        for port, place in places:
            module["cells"][reader]["connections"][port][place] = bit
