"""Tables 1 and 2 of the paper: what our datapaths are built of, beside the paper's and beside other designs."""

import json
from collections import Counter
from pathlib import Path

from fpu import FloatFormat
from rtl.affine_map import affine_map
from rtl.intersection import unit_triangle
from rtl.layout import PACKET_RAYS
from rtl.stack import worth_visiting
from rtl.traversal import kd_step
from sim.methods.plucker import plucker_test
from sim.methods.projection import projection_test

from .designs import ray_shader

__all__ = ["COLUMNS", "PAPER_COSTS", "PAPER_RATIOS", "cost_tables", "measured_luts"]

#: The columns of Table 2.
COLUMNS = ("add", "mul", "div", "cmp")

#: Table 2: floating-point units of the prototype.
PAPER_COSTS = {"traversal": (4, 0, 4, 13), "transformation": (9, 9, 0, 0), "intersection": (3, 2, 1, 0),
               "total": (16, 11, 5, 13)}

#: Table 1: units of this design over those of another, without the traversal unit and with it.
PAPER_RATIOS = {"static": (0.66, 0.75), "dyn2": (0.46, 0.57), "dyn3": (0.23, 0.32)}

_OPERATORS = {"add": "Adder", "mul": "Multiplier", "div": "Divider", "cmp": "Comparator", "sqrt": "SquareRoot"}


def measured_luts(path, *, fmt, grade=6):
    """LUTs of one unit of each kind at its default depth, from the operators' results.

    Parameters
    ----------
    path : path
        ``docs/results/fpu.json``.
    fmt : FloatFormat
    grade : int
        Speed grade of the ECP5.

    Raises
    ------
    ValueError
        If the operators were not measured in that format.
    """
    rows = {row["operator"]: row["lut"] for row in json.loads(Path(path).read_text())["operators"]
            if row["default"] and row["format"] == str(fmt) and row["grade"] == grade
            and row["rounding"] == "nearest-even"}
    if missing := [name for name in _OPERATORS.values() if name not in rows]:
        raise ValueError(f"{path}: no {', '.join(missing)} of format {fmt}, grade {grade}; measure them with "
                         "dynrt fpu-report")
    return {kind: rows[name] for kind, name in _OPERATORS.items()}


def _cost(*datapaths):
    total = Counter()
    for datapath, times in datapaths:
        for kind, number in datapath.cost().items():
            total[kind] += times * number
    return total


def _weighed(cost, weights):
    return sum(number * weights[kind] for kind, number in cost.items())


def cost_tables(*, fmt=None, luts=None):
    """Rows of both tables.

    Counted are adders (with subtracters), multipliers, dividers, comparators and square roots, all alike; comparisons
    with 0 and 1, multiplexers and tables count nothing. Each design takes in one ray a clock in the intersection and
    four in the traversal. K: four of :func:`~rtl.traversal.kd_step` and of :func:`~rtl.stack.worth_visiting`;
    T: :func:`~rtl.affine_map.affine_map`; I: :func:`~rtl.intersection.unit_triangle`, without t_near;
    I_w, I_p: :mod:`sim.methods`; S: :mod:`tools.designs`. The paper does not say what its I_w, I_p and S are, so there
    are variants: S with refraction rays, I_p that stores nothing but vertices.

    Parameters
    ----------
    fmt : FloatFormat, optional
        Default 7.16; the numbers of units do not depend on it.
    luts : dict from str to int, optional
        LUTs of each kind of unit, see :func:`measured_luts`; then Table 1 is also given by LUTs, multipliers without
        their multiplier block.

    Returns
    -------
    dict
        ``table2``: rows of ``unit``, the four :data:`COLUMNS`, and the ``paper``'s four or None. ``parts``: the
        letters above with their counts and ``units`` (and ``luts``). ``table1``: rows of ``design``, ``variant``,
        what it is the ``sum`` of, ``by`` ("units" or "luts"), ``without_traversal`` and ``full``: our cost over
        the design's; and the ``paper``'s two.
    """
    fmt = fmt or FloatFormat(7, 16)
    traversal = _cost((kd_step(fmt), PACKET_RAYS), (worth_visiting(fmt), PACKET_RAYS))
    transformation, intersection = _cost((affine_map(fmt), 1)), _cost((unit_triangle(fmt), 1))
    units = {"traversal": traversal, "transformation": transformation, "intersection": intersection,
             "total": traversal + transformation + intersection,
             "intersection, rays with t_near": _cost((unit_triangle(fmt, near=True), 1))}
    table2 = [{"unit": name, **{column: cost[column] for column in COLUMNS},
               "paper": dict(zip(COLUMNS, PAPER_COSTS[name], strict=True)) if name in PAPER_COSTS else None}
              for name, cost in units.items()]

    parts = {"K": traversal, "T": transformation, "I": intersection, "I_w": _cost((projection_test(fmt), 1)),
             "I_p": _cost((plucker_test(fmt), 1)), "I_p from vertices": _cost((plucker_test(fmt, stored=False), 1)),
             "S": _cost((ray_shader(fmt), 1)), "S with refraction": _cost((ray_shader(fmt, refraction=True), 1))}
    ways = {"units": dict.fromkeys(_OPERATORS, 1), **({"luts": luts} if luts else {})}
    sizes = {by: {name: _weighed(cost, weights) for name, cost in parts.items()} for by, weights in ways.items()}
    designs = [(design, variant, ["K", *(["T"] if design != "static" else []), shader, test])
               for shader, variant in (("S", ""), ("S with refraction", "refraction"))
               for design, test in (("static", "I_w"), ("dyn2", "I_w"), ("dyn3", "I_p"))]
    designs.append(("dyn3", "from vertices", ["K", "T", "S", "I_p from vertices"]))
    table1 = []
    for by, size in sizes.items():
        ours = size["T"] + size["I"]
        for design, variant, letters in designs:
            other = sum(size[letter] for letter in letters[1:])
            table1.append({"design": design, "variant": variant, "sum": letters, "by": by,
                           "without_traversal": ours / other, "full": (ours + size["K"]) / (other + size["K"]),
                           "paper": dict(zip(("without_traversal", "full"), PAPER_RATIOS[design], strict=True))})
    return {"format": str(fmt), "table2": table2, "table1": table1, "luts_of_units": luts,
            "parts": [{"part": name, **dict(cost), **{by: size[name] for by, size in sizes.items()}}
                      for name, cost in parts.items()]}
