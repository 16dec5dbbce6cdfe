"""Carry chains' ends, and registers behind block RAMs."""

import json

import pytest

from boards.netlist import absorb_registers, free_carry_ends


def chain(*, first_table, carry_in, taken):
    """A netlist of two cells, the carry out of the second of which goes to a port if it is ``taken``."""
    def cell(table, carry_in, carry_out):
        return {"type": "CCU2C", "parameters": {"INIT0": f"{table:016b}"},
                "port_directions": {"CIN": "input", "COUT": "output", "A0": "input"},
                "connections": {"CIN": [carry_in], "COUT": [carry_out], "A0": [2]}}

    ports = {"a": {"direction": "input", "bits": [2]}, "r": {"direction": "output", "bits": [4 if taken else 2]}}
    cells = {"low": cell(first_table, carry_in, 3), "high": cell(0x960A, 3, 4)}
    return json.dumps({"modules": {"top": {"ports": ports, "cells": cells}}})


def ends(text):
    cells = json.loads(free_carry_ends(text))["modules"]["top"]["cells"]
    return cells["low"]["connections"]["CIN"], cells["low"]["connections"]["COUT"], cells["high"]["connections"]["COUT"]


def test_only_what_does_not_matter_is_freed():
    assert ends(chain(first_table=0x0002, carry_in="0", taken=False)) == (["x"], [3], ["x"])
    assert ends(chain(first_table=0x0002, carry_in="0", taken=True)) == (["x"], [3], [4])
    assert ends(chain(first_table=0x0102, carry_in="0", taken=False)) == (["0"], [3], ["x"])
    assert ends(chain(first_table=0x0002, carry_in="1", taken=False)) == (["1"], [3], ["x"])
    assert ends(chain(first_table=0x0002, carry_in=2, taken=True)) == ([2], [3], [4])


def block_ram(*, width=18, enable="1", harness=False, also_read=False, flip_flop_enable="1 ", clock=9):
    """A netlist of a block RAM whose outputs 0 and 1 go through a flip-flop each to a port, and its last nowhere."""
    first = "harness[q_0]" if harness else "q0"
    memory = {
        "type": "DP16KD",
        "parameters": {"DATA_WIDTH_A": f"{width:032b}", "DATA_WIDTH_B": f"{width:032b}", "REGMODE_A": "NOREG",
                       "REGMODE_B": "NOREG", "CLKAMUX": "CLKA", "CLKBMUX": "CLKB"},
        "port_directions": {"CLKB": "input", "CEB": "input", "RSTB": "input", "OCEA": "input", "OCEB": "input",
                            "DOA0": "output", "DOB0": "output", "DOB1": "output"},
        "connections": {"CLKB": [9], "CEB": [enable], "RSTB": ["0"], "OCEA": ["0"], "OCEB": ["1"],
                        "DOA0": [20] if width == 36 else [], "DOB0": [21], "DOB1": [22]}}

    def flip_flop(value, result):
        return {"type": "TRELLIS_FF", "parameters": {"CEMUX": flip_flop_enable, "CLKMUX": "CLK", "REGSET": "RESET"},
                "port_directions": {"CLK": "input", "DI": "input", "LSR": "input", "Q": "output"},
                "connections": {"CLK": [clock], "DI": [value], "LSR": ["0"], "Q": [result]}}

    cells = {"memory": memory, first: flip_flop(20 if width == 36 else 21, 30)}
    if width == 36:
        cells["q1"] = flip_flop(21, 31)
    ports = {"r": {"direction": "output", "bits": [30, 31, *([21] if also_read else [])]}}
    return json.dumps({"modules": {"top": {"ports": ports, "cells": cells}}})


@pytest.mark.parametrize(("width", "modes", "outputs"), [
    (18, ("NOREG", "OUTREG"), {"DOB0": [30]}), (36, ("OUTREG", "OUTREG"), {"DOA0": [30], "DOB0": [31]})])
def test_registers_go_into_block_rams(width, modes, outputs):
    cells = json.loads(absorb_registers(block_ram(width=width)))["modules"]["top"]["cells"]
    memory = cells.pop("memory")
    assert not cells
    assert (memory["parameters"]["REGMODE_A"], memory["parameters"]["REGMODE_B"]) == modes
    assert {name: memory["connections"][name] for name in outputs} == outputs
    assert memory["connections"]["OCEB"] == ["1"]
    assert memory["connections"]["OCEA"] == (["1"] if width == 36 else ["0"])


@pytest.mark.parametrize("but", [
    {"enable": 3}, {"harness": True}, {"also_read": True}, {"flip_flop_enable": "CE"}, {"clock": 8}])
def test_registers_that_do_more_stay(but):
    given = block_ram(**but)
    assert json.loads(absorb_registers(given)) == json.loads(given)
