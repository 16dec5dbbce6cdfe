"""The cheapest depth of an operator for a clock, from what place and route has measured."""

import json
from functools import lru_cache
from pathlib import Path

from .pipeline import stage_delay_at

__all__ = ["cheapest_latency"]

_TABLE = Path(__file__).with_name("measured.json")


@lru_cache
def _measured():
    """Rows of the table that ``dynrt fpu-report`` writes, as dictionaries, by operator and format."""
    table, rows = json.loads(_TABLE.read_text()), {}
    for values in table["rows"]:
        row = dict(zip(table["columns"], values, strict=True))
        rows.setdefault((row["operator"], row["format"]), []).append(row)
    return rows


def cheapest_latency(operator, fmt, *, clock_mhz):
    """Latency at which an operator alone reaches a clock on an ECP5 of grade 6 for the fewest tables and flip-flops.

    Where all depths have been measured, they decide, each by the worst of its placements; of other formats the delays
    that the operators place their registers by. An operator counts as the one that it is made of.

    Parameters
    ----------
    operator : type
        Class of the operator.
    fmt : FloatFormat
        Format of its operands.
    clock_mhz : float
        The clock.

    Raises
    ------
    ValueError
        If no measured depth reaches it; the message tells the highest clock.
    """
    names = [cls.__name__ for cls in operator.__mro__]
    rows = next((found for name in names if (found := _measured().get((name, str(fmt))))), [])
    fast = [row for row in rows if row["fmax_worst_mhz"] >= clock_mhz]
    if fast:
        return min(fast, key=lambda row: (row["lut"] + row["ff"], row["latency"]))["latency"]
    if len(rows) > 1:
        highest = max(row["fmax_worst_mhz"] for row in rows)
        raise ValueError(f"No depth of {operator.__name__} in {fmt} reaches {clock_mhz:g} MHz; the highest clock is "
                         f"{highest:.0f} MHz")
    return operator.default_latency(fmt, stage_delay=stage_delay_at(clock_mhz))
