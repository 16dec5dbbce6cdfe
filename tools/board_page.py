"""The tables of docs/board.md."""

from boards.catalog import BOARDS

from .page import check_places, filled_page, markdown_table
from .results import earlier_results

__all__ = ["board_page", "check_board_page"]


def _clocks(reports):
    rows = []
    for report in reports:
        for name, clock in report["clocks"].items():
            seeds = ", ".join(f"{seed['mhz']:.1f}" for seed in clock["seeds"])
            rows.append((report["title"], report["grade"], name, f"{clock['needed_mhz']:g}",
                         f"{clock['worst_mhz']:.1f}", f"{clock['best_mhz']:.1f}", seeds))
    return markdown_table(("board", "grade", "clock", "MHz in the bitstream", "MHz, worst seed", "MHz, best seed",
                           "MHz of seeds 1, 2 …"), rows)


def _areas(reports):
    return markdown_table(
        ("board", "LUT", "of the device", "FF", "DSP", "EBR", "of the device"),
        [(report["title"], f"{report['lut']:,}", f"{100 * report['lut_fraction']:.1f} %", f"{report['ff']:,}",
          report["dsp"], report["ebr"], f"{100 * report['ebr_fraction']:.1f} %") for report in reports])


def _units(reports):
    names = dict.fromkeys(name for report in reports for name in report["units"])
    return markdown_table(
        ("unit", *(f"{report['title']}: LUT, EBR" for report in reports)),
        [(name, *(f"{report['units'].get(name, 0):,}, {report['units_ebr'].get(name, 0)}" for report in reports))
         for name in names])


def _paths(reports):
    return markdown_table(("board", "seed", "slowest path of the chip's clock"),
                          [(report["title"], path["seed"], path["words"])
                           for report in reports for path in report["paths"]])


def _tools(reports):
    return markdown_table(("board", "chip", "tools"),
                          [(report["title"], f"`{report['config']}`",
                            ", ".join(f"{name} {version}" for name, version in report["tools"].items()))
                           for report in reports])


_PARTS = {"clocks": _clocks, "areas": _areas, "units": _units, "paths": _paths, "tools": _tools}


def check_board_page(docs):
    """Sees that every table has its place.

    Raises
    ------
    BadInput
        If there is no page, or a place is missing.
    """
    check_places(docs / "board.md", _PARTS)


def board_page(docs, changed):
    """Text of docs/board.md, of the boards that results are of, one of which has just ``changed``."""
    reports = {name: earlier_results(docs / "results" / f"{name}.json") for name in BOARDS}
    reports[changed["board"]] = changed
    return filled_page(docs / "board.md", _PARTS, [report for report in reports.values() if report])
