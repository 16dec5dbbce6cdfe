"""The table of fitted chips in docs/accuracy.md, from their files."""

import json

from .errors import BadInput
from .page import check_places, filled_page, markdown_table

__all__ = ["check_page", "fitted_page"]

_PLACE = "fit"


def check_page(docs):
    """Sees that the table has its place.

    Raises
    ------
    BadInput
        If there is no page, or no place.
    """
    check_places(docs / "accuracy.md", [_PLACE])


def fitted_page(docs, added):
    """Text of the page with a row for each docs/results/fit-….json, and for ``added``: texts by path.

    Raises
    ------
    BadInput
        If the page has no place for the table, or a file is no fitted chip's.
    """
    texts = {path: path.read_text() for path in sorted((docs / "results").glob("fit-*.json"))} | added
    rows = []
    for path, text in sorted(texts.items()):
        try:
            rows.append(_row(json.loads(text)))
        except (ValueError, KeyError, TypeError) as error:
            raise BadInput(f"{path}: is not what dynrt fit writes; fit that scene anew, or remove it") from error
    return filled_page(docs / "accuracy.md", {_PLACE: lambda rows: markdown_table(_HEAD, rows)}, rows)


_HEAD = ("scene", "size", "format", "arithmetic, tolerance", "shader", "threads", "stack", "picture", "tables",
         "of the full chip's", "flip-flops", "multipliers", "block RAMs", "memory image, KB", "cycles a frame",
         "MHz", "frames a second")


def _row(chip):
    about = chip["about"]
    because = {reason["what"]: reason["value"] for reason in about["because"]}
    figures = about.get("figures", {})
    picture, shader = about["picture"], chip["shader"]

    def figure(name):
        return f"{figures[name]['chip']:,}" if name in figures else "–"

    switches = [name.replace("_", " ") for name, on in (shader or {}).items() if on is True]
    part = f"{figures['tables']['chip'] / figures['tables']['full']:.0%}" if "tables" in figures else "–"
    return [about["scene"], "×".join(map(str, about["size"])), chip["fmt"],
            f"{because['arithmetic']}, {chip['edge_tolerance']}",
            "none" if shader is None else f"{', '.join(switches)}; depth {shader['depth']}",
            chip["num_threads"], chip["stack_depth"], f"{picture['wrong']:.3f} % wrong, {picture['cracks']} cracks",
            figure("tables"), part, figure("flip-flops"), figure("multipliers"), figure("block RAMs"),
            f"{about['image_bytes'] / 1024:.0f}", figure("cycles a frame"), figure("MHz"), figure("frames a second")]
