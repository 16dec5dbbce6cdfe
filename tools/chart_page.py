"""Charts and tables of accuracy over formats."""

from .figure import drawn_figure
from .page import filled_page, markdown_table

__all__ = ["draw_charts", "filled"]

_COLORS = {"separate": "#1f5fa8", "fused": "#2f8f4e", "truncated": "#c2571a", "reciprocal": "#8a5fb0",
           "tolerant 2": "#9a9a3a", "tolerant 4": "#b0357a", "tolerant 8": "#50b0b0"}
_PAPER = "7.16"
_PANELS = {"wrong_percent": "pixels that show another triangle, %", "psnr": "PSNR of the picture, dB",
           "cracks": "cracks, pixels", "t_err_p999": "relative error of t, 99.9 %"}
_IS_LOGARITHMIC = {"wrong_percent", "cracks", "t_err_p999"}


def _series(rows, scene, variant, column):
    """Formats, and what rows of a scene and variant have; zeros and infinities are left out of curves."""
    points = [(row["format"], row[column]) for row in rows
              if row["scene"] == scene and row["variant"] == variant and column in row]
    return [(fmt, value) for fmt, value in points if 0 < value < float("inf")]


def draw_charts(rows, folder):
    """Writes ``chart-formats.png``: a column for each scene, a row for each measure, formats across."""
    scenes = list(dict.fromkeys(row["scene"] for row in rows))
    formats = list(dict.fromkeys(row["format"] for row in rows))
    if not rows:
        return
    size = 2.5 * len(scenes) + 0.6, 2.3 * len(_PANELS) + 0.6
    with drawn_figure(folder / "chart-formats.png", figsize=size) as figure:
        _draw(figure, rows, scenes, formats)


def _draw(figure, rows, scenes, formats):
    grid = figure.subplots(len(_PANELS), len(scenes), sharex=True, sharey="row", squeeze=False)
    for line, (column, title) in zip(grid, _PANELS.items(), strict=True):
        line[0].set_ylabel(title, fontsize=8)
        for axes, scene in zip(line, scenes, strict=True):
            if column in _IS_LOGARITHMIC:
                axes.set_yscale("log")
            if _PAPER in formats:
                axes.axvline(formats.index(_PAPER), color="#bbbbbb", linewidth=4, alpha=0.5)
            for variant, color in _COLORS.items():
                points = _series(rows, scene, variant, column)
                axes.plot([formats.index(fmt) for fmt, _ in points], [value for _, value in points], ".-", color=color,
                          linewidth=1, markersize=4, label=variant)
            axes.grid(axis="y", color="#e4e4e4", linewidth=0.8)
            axes.tick_params(labelsize=7, length=2)
            axes.set_xticks(range(len(formats)), formats, rotation=90)
    for axes, scene in zip(grid[0], scenes, strict=True):
        axes.set_title(scene, fontsize=9)
    grid[0][0].legend(fontsize=7, frameon=False)


def _cell(row):
    if row is None:
        return "–"
    if "error" in row:
        return "does not fit"
    return f"{row['wrong_percent']:.3f}, {row['cracks']}, {row['phantoms']}, {row['psnr']:.1f}"


def _accuracy(rows):
    scenes = list(dict.fromkeys(row["scene"] for row in rows))
    found = {(row["scene"], row["format"], row["variant"]): row for row in rows}
    variants = [variant for variant in _COLORS if any(row["variant"] == variant for row in rows)]
    formats = list(dict.fromkeys(row["format"] for row in rows))
    tables = []
    for variant in variants:
        tables.append(markdown_table(
            [f"{variant}: wrong %, cracks, phantoms, PSNR", *scenes],
            [[fmt, *(_cell(found.get((scene, fmt, variant))) for scene in scenes)] for fmt in formats]))
    return "\n".join(tables) if tables else markdown_table([], [])


_PARTS = {"accuracy": _accuracy}


def filled(page, rows):
    """See :func:`~tools.page.filled_page`."""
    return filled_page(page, _PARTS, rows)
