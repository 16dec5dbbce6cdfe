"""What is reported of a board's bitstream."""

from collections import Counter

from boards.packing import Area

__all__ = ["CHIP", "built", "missed", "unit_of", "words"]

#: The clock of chip and SDRAM, in reports
CHIP = "chip"
_NAMES = {"sync": CHIP}
#: Modules of a :class:`~rtl.top.Top` and of its memory system, by what they are called in reports.
_PARTS = {("system", "memory"): "SDRAM", ("display",): "display", ("link",): "host link"}


def unit_of(path):
    """The unit that a module belongs to, by its path from the :class:`~rtl.top.Top`."""
    parts = tuple(path.split("."))
    for prefix, name in _PARTS.items():
        if parts[:len(prefix)] == prefix:
            return name
    if parts[:2] == ("system", "chip") and len(parts) > 2:
        inner = parts[3:] if parts[2].startswith("pipeline") else parts[2:]
        return inner[0].replace("_", " ") if inner else "pipeline"
    return "rest"


def missed(routed, clocks):
    """Why none of the placements will do, "" if one will."""
    if not all(each.too_slow(clocks) for each in routed):
        return ""
    best = max(routed, key=lambda each: min(each.mhz[domain] / clocks[domain] for domain in each.mhz))
    slow = [f"{_NAMES.get(domain, domain)} reaches {mhz:.1f} of {clocks[domain]:g} MHz"
            for domain, mhz in best.too_slow(clocks).items()]
    return f"timing is not met by {len(routed)} placement{'s' if len(routed) > 1 else ''}: {', '.join(slow)}"


def words(each, clocks):
    """A placement in a line."""
    return f"seed {each.seed}: " + ", ".join(f"{_NAMES.get(domain, domain)} {mhz:.1f} MHz ({clocks[domain]:g} needed)"
                                             for domain, mhz in sorted(each.mhz.items()))


def built(board, config, clocks, routed, tools):
    """The report as JSON has it.

    Parameters
    ----------
    board : Board
    config : ChipConfig
    clocks : dict from str to float
        MHz of each domain.
    routed : list of Routed
        One for each seed.
    tools : dict from str to str
        Their versions.
    """
    # Areas differ by a few tables from seed to seed, as nextpnr lets routes go through some.
    areas = routed[0].areas
    whole = sum(areas.values(), start=Area(lut=0, ff=0, dsp=0, ebr=0))
    units = {kind: Counter() for kind in ("lut", "ebr")}
    for path, area in areas.items():
        for kind, counts in units.items():
            counts[unit_of(path)] += getattr(area, kind)
    return {
        "board": board.name, "title": board.title, "device": board.device.name, "grade": board.grade,
        "config": repr(config), "size": list(board.size), "screen": board.mode.name,
        "clocks": {_NAMES.get(domain, domain): {
            "needed_mhz": round(clocks[domain], 3),
            "worst_mhz": min(each.mhz[domain] for each in routed),
            "best_mhz": max(each.mhz[domain] for each in routed),
            "seeds": [{"seed": each.seed, "mhz": round(each.mhz[domain], 2)} for each in routed]}
            for domain in sorted(routed[0].mhz)},
        "lut": whole.lut, "lut_fraction": round(whole.lut / board.device.lut, 4), "ff": whole.ff, "dsp": whole.dsp,
        "ebr": whole.ebr, "ebr_fraction": round(whole.ebr / board.device.ebr, 4),
        "units": dict(units["lut"].most_common()), "units_ebr": {name: count for name, count
                                                                 in units["ebr"].most_common() if count},
        "paths": [{"seed": each.seed, "words": each.path.words, "through": each.path.through} for each in routed],
        "tools": tools,
    }
