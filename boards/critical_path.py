"""The slowest path of a design, from what nextpnr reports."""

import re
from dataclasses import dataclass

__all__ = ["CriticalPath", "slowest"]

#: What synthesis and packing add to the name of a signal: a cell's kind, the pin by which it is next to it, a number.
_ADDED = re.compile(r"(_(TRELLIS_FF|LUT4|CCU2C|DPR16X4|DP16KD|MULT18X18D)_|\$[A-Z]|_D[IO][AB]?\d*_).*$")


@dataclass(frozen=True, kw_only=True)
class CriticalPath:
    """A path from register to register.

    Attributes
    ----------
    start, end : str
        Path in the component of the signal that its first and its last cell are named after.
    tables : int
        Cells that it goes through between them; two bits of a carry chain are one.
    logic_ns, routing_ns : float
        Its time in cells, with clock-to-output and set-up, and between them.
    through : list of str
        Signals on its way, in order, each once.
    """

    start: str
    end: str
    tables: int
    logic_ns: float
    routing_ns: float
    through: list

    @property
    def words(self):
        """It in a line."""
        return (f"{self.start} to {self.end}: {self.tables} cells between, {self.logic_ns:.1f} ns in cells, "
                f"{self.routing_ns:.1f} ns between them")


def _signal(cell):
    return _ADDED.sub("", cell.removeprefix("component."))


def slowest(report, clock=None):
    """The slowest path from a rising edge to the next.

    Parameters
    ----------
    report : dict
        As nextpnr's ``--report`` writes it.
    clock : str, optional
        Name of the clock's net, if there are several.
    """
    steps = next(path["path"] for path in report["critical_paths"]
                 if path["from"].startswith("posedge") and path["to"].startswith("posedge")
                 and (clock is None or path["from"] == path["to"] == f"posedge {clock}"))
    spent = {True: 0.0, False: 0.0}
    for step in steps:
        spent[step["type"] == "routing"] += step["delay"]
    signals = [_signal(step["from"]["cell"]) for step in steps if step["type"] == "routing"]
    return CriticalPath(
        start=_signal(steps[0]["from"]["cell"]), end=_signal(steps[-1]["to"]["cell"]),
        tables=sum(step["type"] == "logic" for step in steps), logic_ns=round(spent[False], 2),
        routing_ns=round(spent[True], 2), through=list(dict.fromkeys(signals)))
