"""What whole chips take of an ECP5, each feature alone, and how fast they may be clocked."""

import threading
from collections import defaultdict
from concurrent.futures import ThreadPoolExecutor
from dataclasses import asdict

from boards.chip import DEVICE, chip_design
from boards.ecp5 import critical_path, is_placed, place
from boards.packing import Area, is_packed, pack, pack_by_module
from rtl.dynrtc import DynRTC

from .pipeline_chips import CHIPS, DETAILED

__all__ = ["measure_area", "measure_clock"]

#: Of the device, what is best and what is bought.
GRADES = (6, 8)
_NOTHING = Area(lut=0, ff=0, dsp=0, ebr=0)
# Amaranth counts what it names, for all threads.
_elaborating = threading.Lock()


def _design(name):
    with _elaborating:
        return chip_design(DynRTC(CHIPS[name].config), name=name)


def _all(measure, subjects, *, jobs, console):
    """Results of ``measure``, which returns one and whether it was there before, for each of ``subjects``, in order."""
    done = 0

    def run(subject):
        nonlocal done
        result, known = measure(subject)
        done += 1
        console.print(f"{done} of {len(subjects)}: {', '.join(map(str, subject))}{', as before' if known else ''}",
                      markup=False, highlight=False, soft_wrap=True)
        return result

    with ThreadPoolExecutor(jobs) as pool:
        futures = [pool.submit(run, subject) for subject in subjects]
        try:
            return [future.result() for future in futures]
        except BaseException:
            pool.shutdown(wait=False, cancel_futures=True)
            raise


def measure_area(*, names, earlier, jobs, console):
    """Rows of chips, and of the units of some of them.

    Parameters
    ----------
    names : list of str
        Which of the chips.
    earlier : dict
        What was returned before, for the others.
    jobs : int
        Runs of synthesis at a time.
    console : rich.console.Console
        For progress.

    Returns
    -------
    dict
        ``device``, what it has; ``chips``, area and number of instructions of each, and what it is ``beside``;
        ``units``, areas of parts of chips, whose sum is the whole.

    Raises
    ------
    ToolError
        If a tool is missing or fails.
    """
    def measure(subject):
        name, = subject
        design = _design(name)
        known = is_packed(design)
        return (asdict(pack(design)), _units(name, pack_by_module(design)) if name in DETAILED else []), known

    found = _all(measure, [(name,) for name in names], jobs=jobs, console=console)
    chips = []
    for name, (area, _) in zip(names, found, strict=True):
        chip = CHIPS[name]
        program = chip.config.program
        chips.append({"chip": name, "beside": chip.beside, **area,
                      "instructions": 0 if program is None else len(program.instructions)})
    return {"device": {name: getattr(DEVICE, name) for name in ("name", "lut", "dsp", "ebr")},
            "chips": _merged(earlier.get("chips", []), chips, names),
            "units": _merged(earlier.get("units", []), [row for _, units in found for row in units], names)}


def _merged(earlier, rows, names):
    """Earlier rows of chips that were not measured now, and the new ones, in the order of the chips."""
    order = list(CHIPS)
    kept = [row for row in earlier if row["chip"] in order and row["chip"] not in names]
    return sorted([*kept, *rows], key=lambda row: order.index(row["chip"]))


def _units(chip, areas):
    """Rows of a chip's units, the largest first: those of its pipeline, all queues between these, and the rest."""
    units = defaultdict(list)
    for path, area in areas.items():
        _, _, unit = path.partition("pipeline0.")
        unit = unit.partition(".")[0].replace("_", " ")
        units["queues" if unit.endswith(" queue") else unit or "rest"].append(area)
    rows = [{"chip": chip, "unit": unit, **asdict(sum(parts, start=_NOTHING))} for unit, parts in units.items()]
    return sorted(rows, key=lambda row: -row["lut"])


def measure_clock(*, names, earlier, seeds, jobs, console):
    """Rows of chips placed and routed: the clock by each grade and seed, and the slowest path.

    Parameters
    ----------
    names : list of str
        Which of the chips.
    earlier : list
        What was returned before, for the others.
    seeds : list of int
        Of the placer.
    jobs : int
        Runs of place and route at a time.
    console : rich.console.Console
        For progress.

    Raises
    ------
    ToolError
        If a tool is missing or fails.
    """
    designs = {name: _design(name) for name in names}

    def measure(subject):
        name, grade, seed = subject
        run = dict(grade=grade, seed=seed)
        known = is_placed(designs[name], **run)
        clock = place(designs[name], **run).fmax_mhz
        path = critical_path(designs[name], **run)
        row = {"chip": name, **run, "fmax_mhz": round(clock, 1), "critical_path": path.words, "through": path.through}
        return row, known

    subjects = [(name, grade, seed) for seed in seeds for name in names for grade in GRADES]
    rows = _all(measure, subjects, jobs=jobs, console=console)
    return _merged(earlier, sorted(rows, key=lambda row: (row["grade"], row["seed"])), names)
