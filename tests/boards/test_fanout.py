"""Copies of what drives many: the same netlist once copies are taken for what they are copies of."""

import random
from collections import Counter
from copy import deepcopy

import pytest

from boards.fanout import split_fanout


def splitted(given, *, limit):
    netlist = deepcopy(given)
    split_fanout(netlist, limit=limit)
    return netlist


def random_netlist(rng, *, num_cells):
    """Tables and flip-flops that read few bits again and again, and distributed memories with one address each."""
    cells = {}
    for number in range(num_cells):
        popular = [rng.randrange(100, 100 + num_cells) if rng.random() < 0.3 else 100 + rng.randrange(4)
                   for _ in range(4)]
        if number % 3 == 0:
            cells[f"a.table{number}"] = {
                "type": "LUT4", "parameters": {"INIT": f"{number:016b}"},
                "port_directions": {**dict.fromkeys("ABCD", "input"), "Z": "output"},
                "connections": {**{port: [bit] for port, bit in zip("ABCD", popular, strict=True)},
                                "Z": [100 + number]}}
        elif number % 3 == 1:
            cells[f"a.flip_flop{number}"] = {
                "type": "TRELLIS_FF", "parameters": {},
                "port_directions": {"CLK": "input", "DI": "input", "CE": "input", "LSR": "input", "Q": "output"},
                "connections": {"CLK": [7], "DI": [popular[0]], "CE": [popular[1]], "LSR": ["0"], "Q": [100 + number]}}
        else:
            cells[f"a.memory{number}"] = {
                "type": "TRELLIS_DPR16X4", "parameters": {},
                "port_directions": {"RAD": "input", "WCK": "input", "DO": "output"},
                "connections": {"RAD": [*popular[:3], "0"], "WCK": [7], "DO": [100 + number]}}
    names = {"clk": [7], **{f"n{bit}": [bit] for bit in range(100, 100 + num_cells)}}
    return {"modules": {"top": {"ports": {"clk": {"direction": "input", "bits": [7]},
                                          "r": {"direction": "output", "bits": [103]}},
                                "cells": cells,
                                "netnames": {name: {"hide_name": 0, "bits": bits, "attributes": {}}
                                             for name, bits in names.items()}}}}


def pins_of(cells):
    """Number of input pins, but for clocks, by bit."""
    return Counter(bit for cell in cells.values() for port, bits in cell["connections"].items()
                   if cell["port_directions"][port] == "input" and port not in ("CLK", "WCK") for bit in bits)


@pytest.mark.parametrize("seed", range(5))
def test_copies_change_nothing(seed):
    given = random_netlist(random.Random(seed), num_cells=300)
    before = given["modules"]["top"]
    after = splitted(given, limit=12)["modules"]["top"]
    output = {"LUT4": "Z", "TRELLIS_FF": "Q"}
    copies = {name: cell for name, cell in after["cells"].items() if name not in before["cells"]}
    assert copies
    # What each copied bit was before: copies of copies lead on.
    was = {}
    for name, cell in copies.items():
        original = before["cells"][name.split("$copy")[0]]
        assert cell["type"] == original["type"]
        assert cell["parameters"] == original["parameters"]
        was[cell["connections"][output[cell["type"]]][0]] = original["connections"][output[cell["type"]]][0]
    for name, cell in after["cells"].items():
        original = before["cells"][name.split("$copy")[0]]
        for port, bits in cell["connections"].items():
            if cell["port_directions"][port] == "input":
                assert [was.get(bit, bit) for bit in bits] == original["connections"][port], (name, port)
    assert len(was) == len(copies)
    assert not was.keys() & {bit for net in before["netnames"].values() for bit in net["bits"]}
    assert after["ports"] == before["ports"]


def test_none_drives_more_than_it_may():
    given = random_netlist(random.Random(1), num_cells=300)
    cells = splitted(given, limit=12)["modules"]["top"]["cells"]
    tables_and_flip_flops = {bit for cell in cells.values() if cell["type"] in ("LUT4", "TRELLIS_FF")
                             for bit in cell["connections"].get("Z", cell["connections"].get("Q"))}
    pins = pins_of(cells)
    # What is at a port of the module stays, as 103 does. A cell's four pins stay together.
    assert max(pins[bit] for bit in tables_and_flip_flops - {103}) <= 12 + 3
    assert pins[103] > 12
    # The memory's output is not copied, nor a clock.
    assert pins[102] == pins_of(given["modules"]["top"]["cells"])[102] > 12
    assert all(cell["connections"].get("CLK", [7]) == [7] for cell in cells.values())


def test_neighbours_by_name_stay_together():
    """A register of 100 bits behind one enable: each copy enables bits in a row."""
    bits = {f"word_{number}": {"type": "TRELLIS_FF", "parameters": {},
                               "port_directions": {"CLK": "input", "CE": "input", "Q": "output"},
                               "connections": {"CLK": [2], "CE": [3], "Q": [10 + number]}} for number in range(100)}
    enable = {"type": "LUT4", "parameters": {}, "port_directions": {"A": "input", "Z": "output"},
              "connections": {"A": [4], "Z": [3]}}
    given = {"modules": {"top": {"ports": {}, "cells": {"enable": enable, **bits}, "netnames": {
        "n": {"bits": list(range(2, 110))}}}}}
    cells = splitted(given, limit=40)["modules"]["top"]["cells"]
    enables = [cells[f"word_{number}"]["connections"]["CE"][0] for number in range(100)]
    changes = [number for number in range(1, 100) if enables[number] != enables[number - 1]]
    assert len(set(enables)) == 3
    assert changes == [34, 68]


def test_what_drives_few_stays():
    given = random_netlist(random.Random(2), num_cells=30)
    assert splitted(given, limit=1000) == given
