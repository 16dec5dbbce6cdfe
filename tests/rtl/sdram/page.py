"""The tables of docs/memory.md, from docs/results/sdram.json, sdram-room.json and the chips' times."""

from pathlib import Path

import click

from rtl.sdram.timing import AS4C16M16SA_6, AS4C16M16SA_7, MT48LC16M16A2_75, SLOWEST, SdramTiming
from tools.errors import BadInput
from tools.page import filled_page, markdown_table
from tools.results import earlier_results, write_texts

__all__ = ["PARTS", "page_text"]

#: Clocks whose cycles are shown
_CLOCKS = (100, 125, 133)


def _times(results):
    chips = {"AS4C16M16SA-6": AS4C16M16SA_6, "AS4C16M16SA-7": AS4C16M16SA_7, "MT48LC16M16A2-75": MT48LC16M16A2_75,
             "slowest": SLOWEST}
    timings = [SdramTiming(SLOWEST, clock_mhz=clock) for clock in _CLOCKS]
    rows = [(label, *(f"{getattr(chip, f't_{name}'):g}" for chip in chips.values()),
             *(2 * getattr(timing, name) + offset for timing in timings))
            for label, name, offset in (
                ("tRCD, row to column", "rcd", 1), ("tRP, precharge to row", "rp", 0),
                ("tRAS, row to precharge", "ras", 0), ("tRC, row to row of a bank", "rc", 0),
                ("tRRD, row to row of another", "rrd", 0), ("tRFC, refresh", "rfc", 0), ("tMRD, mode", "mrd", 0))]
    rows.insert(5, ("tWR, last half written to precharge", *(f"{chip.t_wr:g}" for chip in chips.values()),
                    *(2 * timing.write_to_precharge - 2 for timing in timings)))
    rows.append(("between refreshes", *(f"{chip.t_refresh / 8192:g}" for chip in chips.values()),
                 *(2 * timing.refresh for timing in timings)))
    rows.append(("CAS latency, cycles", *["2 to 100 MHz, then 3"] * len(chips), *(t.cas_latency for t in timings)))
    head = ("time", *(f"{name}, ns" for name in chips), *(f"cycles at {clock} MHz" for clock in _CLOCKS))
    return markdown_table(head, rows)


def _speed(results):
    speed = results.get("speed")
    if not speed:
        return markdown_table((), ())
    return markdown_table(
        ("traffic", "read", "written", "shown", "all, MB/s", "data lines busy", "rows opened an access",
         "words late on the display"),
        [(name, row["read_mb_s"], row["written_mb_s"], row["shown_mb_s"], row["mb_s"], f"{100 * row['busy']:.1f} %",
          row["activations_per_access"], row["underruns"]) for name, row in speed["traffic"].items()])


def _soak(results):
    soak = results.get("soak")
    if not soak:
        return markdown_table((), ())
    return markdown_table(("accesses", "cycles", "wrong words", "violations", "refreshes", "rows opened", "words read",
                           "words written", "words shown"),
                          [[f"{soak[name]:,}" for name in (
                              "accesses", "cycles", "errors", "violations", "refreshes", "activations", "read_words",
                              "written_words", "shown_words")]])


def _area(results):
    area = results.get("ecp5")
    if not area:
        return markdown_table((), ())
    return markdown_table(("device", "grade", "LUT", "FF", "EBR", "DSP", "seeds", "MHz, worst", "MHz, best"),
                          [[area["device"], area["grade"], area["lut"], area["ff"], area["ebr"], area["dsp"],
                            ", ".join(map(str, area["seeds"])), f"{area['worst_mhz']:.1f}", f"{area['best_mhz']:.1f}"]])


def _room(results):
    room = results.get("room")
    if not room:
        return markdown_table((), ())
    sdram = room["sdram"]
    return markdown_table(
        ("picture", "cycles a ray", "bytes a ray", "data lines busy", "rows opened a ray", "refreshes",
         "pixels unlike the model's"),
        [[" × ".join(map(str, room["size"])), f"{room['cycles_per_ray']:.2f}", f"{sdram['bytes'] / room['rays']:.2f}",
          f"{100 * sdram['busy']:.1f} %", f"{sdram['activations'] / room['rays']:.2f}", sdram["refreshes"],
          room["wrong_pixels_vs_model"]]])


#: Of each table of the page what makes it.
PARTS = {"times": _times, "speed": _speed, "soak": _soak, "area": _area, "room": _room}


def page_text(docs):
    """The page with its tables filled."""
    folder = docs / "results"
    results = earlier_results(folder / "sdram.json")
    if not results:
        raise BadInput(f"{folder / 'sdram.json'}: is not there; run python -m tests.rtl.sdram.soak first")
    return filled_page(docs / "memory.md", PARTS, {**results, "room": earlier_results(folder / "sdram-room.json")})


@click.command()
@click.option("--docs", default="docs", show_default=True, type=click.Path(file_okay=False, path_type=Path))
def main(docs):
    """Fill the tables of docs/memory.md."""
    write_texts({docs / "memory.md": page_text(docs)})


if __name__ == "__main__":
    main()
