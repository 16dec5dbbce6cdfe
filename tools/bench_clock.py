"""At what clock frames a second are stated: what place and route has found, never a figure typed in."""

import json

from .errors import BadInput

__all__ = ["built_clock"]

_GRADE = 6


def _board_rows(report):
    """The chip's clock by each seed, of a report of tools.build_report."""
    return [{"grade": report["grade"], "seed": seed["seed"], "fmax_mhz": seed["mhz"]}
            for seed in report["clocks"]["chip"]["seeds"]]


def built_clock(folder):
    """The slowest seed of the board that is built, or of the chips placed alone: ``(MHz, where that stands)``.

    Parameters
    ----------
    folder : Path
        Of results: ulx3s_85f.json, or else the clocks of pipeline.json, of speed grade 6.

    Raises
    ------
    BadInput
        If neither has a clock.
    """
    for name, rows_of in (("ulx3s_85f.json", _board_rows), ("pipeline.json", lambda found: found.get("clock", []))):
        path = folder / name
        if not path.exists():
            continue
        try:
            found = json.loads(path.read_text())
        except ValueError as error:
            raise BadInput(f"{path}: is not JSON ({error}); measure it anew") from error
        rows = [row for row in rows_of(found) if row.get("grade", _GRADE) == _GRADE]
        if rows:
            slowest = min(rows, key=lambda row: row["fmax_mhz"])
            about = ", ".join(f"{what} {slowest[what]}" for what in ("chip", "grade", "seed") if what in slowest)
            return slowest["fmax_mhz"], f"{name}: {about}"
    raise BadInput(f"{folder}: neither ulx3s_85f.json nor pipeline.json has a clock of speed grade {_GRADE}; measure "
                   "one with dynrt pipeline --only clock")
