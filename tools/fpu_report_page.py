"""The tables of ``docs/fpu.md``, each between two comments in the page's prose."""

from .page import check_places, filled_page, markdown_table

__all__ = ["check_markers", "filled"]

_CLOCK_MHZ = 175
#: Most that an operator at 7.16 and its default depth is to take, in one of these ways; what is not named, none of it.
_TARGETS = {
    "Adder": ({"lut": 330},),
    "Multiplier": ({"lut": 110, "dsp": 1},),
    "Comparator": ({"lut": 40},),
    "Divider": ({"lut": 750}, {"lut": 250, "dsp": 3, "ebr": 1}),
    "TableDivider": ({"lut": 250, "dsp": 3, "ebr": 1},),
}
_RESOURCES = {"lut": "LUT", "ff": "FF", "dsp": "DSP", "ebr": "EBR"}


def _mhz(row):
    return f"{row['fmax_median_mhz']:.0f} / {row['fmax_worst_mhz']:.0f}"


def _ulp(row):
    return "–" if row["max_ulp"] is None else f"{row['max_ulp']:.3f} / {row['mean_ulp']:.3f}"


def _resources(row):
    return [row[name] for name in _RESOURCES]


def _select(rows, **wanted):
    return [row for row in rows if all(row[name] == value for name, value in wanted.items())]


def _nearest(results, **wanted):
    return _select(results["operators"], rounding="nearest-even", **wanted)


def _flow(results):
    flow = results["flow"]
    tools = ", ".join(f"{name} {version}" for name, version in flow["tools"].items())
    return (f"{flow['device']} ({flow['package']}), {tools}; seeds {', '.join(map(str, flow['seeds']))}.\n\n"
            f"    yosys: {flow['synthesis']}\n    nextpnr-ecp5: {flow['place_and_route']} --speed GRADE --seed SEED\n")


def _default(results):
    rows = []
    for row in _nearest(results, format="7.16", grade=6, default=True):
        fast = _nearest(results, format="7.16", grade=8, default=True, operator=row["operator"])
        rows.append([row["operator"], row["latency"], *_resources(row), _mhz(row), _mhz(fast[0]) if fast else "–",
                     _ulp(row)])
    return markdown_table(["operator", "latency", *_RESOURCES.values(), "MHz, grade 6: median / worst",
                   "MHz, grade 8: median / worst", "error in ulp: max / mean"], rows)


def _cost(cost):
    return " + ".join(f"{number} {_RESOURCES[name]}" for name, number in cost.items() if number or name == "lut")


def _targets(results):
    rows = []
    for row in _nearest(results, format="7.16", grade=6, default=True):
        rows.append([row["operator"], f"≥ {_CLOCK_MHZ} MHz, worst", f"{row['fmax_worst_mhz']:.0f} MHz",
                     "yes" if row["fmax_worst_mhz"] >= _CLOCK_MHZ else "no"])
        if ways := _TARGETS.get(row["operator"]):
            took = {name: row[name] for name in ("lut", "dsp", "ebr")}
            met = any(all(took[name] <= way.get(name, 0) for name in took) for way in ways)
            rows.append([row["operator"], " or ".join(f"≤ {_cost(way)}" for way in ways), _cost(took),
                         "yes" if met else "no"])
    return markdown_table(["operator", "target", "measured", "met"], rows)


def _depth(results):
    rows = []
    for row in sorted(_nearest(results, format="7.16", grade=6), key=lambda row: row["latency"]):
        latency = f"**{row['latency']}**" if row["default"] else row["latency"]
        rows.append([row["operator"], latency, *_resources(row), _mhz(row)])
    operators = list(dict.fromkeys(row["operator"] for row in results["operators"]))
    rows.sort(key=lambda row: operators.index(row[0]))
    return markdown_table(["operator", "latency", *_RESOURCES.values(), "MHz: median / worst"], rows)


def _format_order(name):
    exp_width, frac_width = map(int, name.split("."))
    return exp_width + frac_width, frac_width


def _formats(results):
    found = _nearest(results, grade=6, default=True)
    formats = sorted({row["format"] for row in found}, key=_format_order)
    tables = []
    for title, cell in (
            ("LUT + FF, and DSP and EBR if any", lambda row: _cost({name: row[name] for name in _RESOURCES})),
            ("Latency: worst MHz", lambda row: f"{row['latency']}: {row['fmax_worst_mhz']:.0f}"),
            ("Error in ulp: max / mean", _ulp)):
        rows = []
        for operator in dict.fromkeys(row["operator"] for row in found):
            own = {row["format"]: row for row in _select(found, operator=operator)}
            rows.append([operator, *(cell(own[fmt]) if fmt in own else "–" for fmt in formats)])
        tables.append(f"{title}:\n\n{markdown_table(['operator', *formats], rows)}")
    return "\n".join(tables)


def _truncation(results):
    rows = []
    for row in _select(results["operators"], rounding="truncate"):
        same = {name: row[name] for name in ("operator", "format", "grade", "latency")}
        for nearest in _nearest(results, **same):
            rows.append([row["operator"], row["latency"],
                         *(f"{nearest[name]} → {row[name]}" for name in ("lut", "ff")),
                         f"{_mhz(nearest)} → {_mhz(row)}", f"{_ulp(nearest)} → {_ulp(row)}"])
    return markdown_table(["operator", "latency", "LUT", "FF", "MHz: median / worst", "error in ulp: max / mean"], rows)


def _area_time(row):
    """Tables × nanoseconds for a result."""
    return row["lut"] * 1e3 / row["fmax_median_mhz"] * row.get("cycles_per_result", 1)


def _peers(results):
    notes = {}
    parts = []
    for is_iterative, title in ((False, "A result every clock:"), (True, "A result every few clocks:")):
        rows = []
        for row in results["peers"]:
            if (row["cycles_per_result"] > 1) == is_iterative:
                rows += _peer_and_ours(results, row, notes)
        if rows or not is_iterative:
            table = markdown_table(["operator", "format", "latency", *_RESOURCES.values(), "MHz: median / worst",
                            "LUT × ns a result", "theirs ÷ ours"], rows)
            parts.append(f"{title}\n\n{table}")
    parts += [f"[{number}] {note}.\n" for note, number in notes.items()]
    parts += [f"Theirs: {source}.\n" for source in dict.fromkeys(row["source"] for row in results["peers"])]
    return "\n".join(parts)


def _peer_and_ours(results, peer, notes):
    """A peer's row, with the number of its note, and ours to compare it with, if there still is one."""
    mark = f" [{notes.setdefault(peer['note'], len(notes) + 1)}]" if peer["note"] else ""
    latency, same = peer["latency"], {name: peer[name] for name in ("operator", "format", "grade", "latency")}
    if peer["retimed"]:
        latency = f"{latency}, retimed"
    if peer["cycles_per_result"] > 1:
        latency = f"{latency}, a result every {peer['cycles_per_result']}"
        same = {name: peer[name] for name in ("operator", "format", "grade")} | {"default": True}
    ours = _nearest(results, **same)
    quotient = f"{_area_time(peer) / _area_time(ours[0]):.2f}" if ours else "–"
    return [[f"{peer['name']}{mark}", peer["format"], latency, *_resources(peer), _mhz(peer),
             f"{_area_time(peer):,.0f}", quotient],
            *([f"**{row['operator']}**", row["format"], row["latency"], *_resources(row), _mhz(row),
               f"{_area_time(row):,.0f}", ""] for row in ours)]


_PARTS = {"flow": _flow, "default": _default, "targets": _targets, "depth": _depth, "formats": _formats,
          "truncation": _truncation, "peers": _peers}


def check_markers(page):
    """See :func:`~tools.page.check_places`."""
    check_places(page, _PARTS)


def filled(page, results):
    """See :func:`~tools.page.filled_page`."""
    return filled_page(page, _PARTS, results)
