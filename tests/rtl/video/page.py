"""The tables of docs/video.md and docs/host.md, from docs/results/dvi.json, dvi_host_ecp5.json and host_faults.json."""

from pathlib import Path

import click

from tools.errors import BadInput
from tools.page import filled_page, markdown_table
from tools.results import earlier_results, write_texts

__all__ = ["PAGES", "page_text"]

_FILES = {"dvi": "tests.rtl.video.picture", "dvi_host_ecp5": "tests.rtl.video.place",
          "host_faults": "tests.sim.host.faults"}


def _unit(name, placed):
    each = placed[name]
    return [name, each["lut"], each["ff"], each["ebr"], f"{each['worst_mhz']:.1f}", each["needed_mhz"]]


_UNIT_HEAD = ("unit", "LUT", "FF", "EBR", "MHz, worst", "MHz needed")


def _modes(results):
    return markdown_table(
        ("mode", "pixel clock, MHz", "shift clock, MHz", "a line's pixels: visible, front porch, sync, back porch",
         "a frame's lines, likewise", "syncs, of lines and frames", "frames a second", "wrong pixels",
         "largest disparity"),
        [[name, f"{mode['pixel_mhz']:g}", f"{5 * mode['pixel_mhz']:g}",
          *(", ".join(str(mode[part]) for part in parts) for parts in (
              ("width", "h_front", "h_sync", "h_back"), ("height", "v_front", "v_sync", "v_back"))),
          ", ".join("high" if mode[f"{way}_positive"] else "low" for way in "hv"), f"{mode['refresh_hz']:.2f}",
          mode["wrong_pixels"], mode["max_disparity"]] for name, mode in results["dvi"].items()])


def _units(results):
    placed = results["dvi_host_ecp5"]
    return markdown_table(_UNIT_HEAD, [_unit(name, placed) for name in placed if name != "HostLink"])


def _host(results):
    return markdown_table(_UNIT_HEAD, [_unit("HostLink", results["dvi_host_ecp5"])])


def _faults(results):
    return markdown_table(
        ("board", "frames damaged", "frames carried", "commands done", "sent again", "given up", "resets noticed",
         "hosts gone", "wrong"),
        [[board, *(f"{each[key]:,}" for key in ("damaged", "frames", "commands", "repeated")),
          *(each["reported"][key] for key in ("NoAnswer", "BoardReset", "hosts gone")), each["wrong"]]
         for board, each in results["host_faults"].items()])


#: Of each table of a page what makes it.
PAGES = {"video.md": {"modes": _modes, "units": _units}, "host.md": {"faults": _faults, "host": _host}}


def page_text(docs, name):
    """A page with its tables filled."""
    results = {}
    for file, command in _FILES.items():
        path = docs / "results" / f"{file}.json"
        results[file] = earlier_results(path)
        if not results[file]:
            raise BadInput(f"{path}: is not there; run python -m {command} first")
    return filled_page(docs / name, PAGES[name], results)


@click.command()
@click.option("--docs", default="docs", show_default=True, type=click.Path(file_okay=False, path_type=Path))
def main(docs):
    """Fill the tables of docs/video.md and docs/host.md."""
    write_texts({docs / name: page_text(docs, name) for name in PAGES})


if __name__ == "__main__":
    main()
