"""Carry chains' ends."""

import json

from boards.netlist import free_carry_ends


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
