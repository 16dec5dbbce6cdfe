"""Plots of the benchmarks."""

import numpy as np

from .bench_page import table_rows
from .figure import drawn_figure

__all__ = ["draw_plots"]

_OURS, _PAPER, _OTHER = "#1f5fa8", "#8a8a8a", "#c2571a"


def draw_plots(results, folder):
    """Write ``bench-cycles.png``, cycles a ray beside the paper's, and ``bench-sweeps.png``, chips of many sizes.

    Parameters
    ----------
    results : dict
        As in ``bench.json``.
    folder : Path
        Where to.
    """
    with drawn_figure(folder / "bench-cycles.png", figsize=(9, 3.6)) as figure:
        _cycles(figure.subplots(), results)
    with drawn_figure(folder / "bench-sweeps.png", figsize=(11, 3.4)) as figure:
        _sweeps(figure, results.get("sweeps", []))


def _plain(axes, title):
    axes.set_title(title, fontsize=10, fontweight="bold", loc="left")
    axes.spines[["top", "right"]].set_visible(False)
    axes.grid(axis="y", color="#e4e4e4", linewidth=0.8)
    axes.set_axisbelow(True)
    axes.tick_params(labelsize=8, length=2)


def _cycles(axes, results):
    rows = {chip: {row["scene"]: row for row in table_rows(results, chip=chip, size=(512, 384))}
            for chip in ("paper", "ulx3s_85f")}
    scenes = list(rows["paper"])
    places = np.arange(len(scenes))
    bars = (("paper, 2004", _PAPER, [rows["paper"][scene]["paper_cycles_per_ray"] for scene in scenes]),
            ("ours, the paper's memory", _OURS, [rows["paper"][scene]["cycles_per_ray"] for scene in scenes]),
            ("ours, LFE5U-85F", _OTHER, [rows["ulx3s_85f"].get(scene, {}).get("cycles_per_ray", 0)
                                         for scene in scenes]))
    for number, (label, color, heights) in enumerate(bars):
        axes.bar(places + 0.27 * (number - 1), heights, 0.25, color=color, label=label)
    axes.set_xticks(places, scenes)
    _plain(axes, "Cycles a ray, 512×384, primary rays")
    axes.legend(fontsize=8, frameon=False)


def _number(row, word):
    """The figure that a chip of a sweep is named by."""
    words = row["chip"].replace(",", "").split()
    return float(words[words.index(word) + 1].lstrip("×") if word == "caches" else words[0])


def _curve(axes, rows, word, value, **style):
    points = sorted((_number(row, word), value(row)) for row in rows)
    axes.plot(*zip(*points, strict=True), marker="o", markersize=3.5, linewidth=1.4, **style)
    axes.set_xticks([place for place, _ in points], [f"{place:g}" for place, _ in points])


def _sweeps(figure, rows):
    threads, pipelines, traffic, cycles = figure.subplots(1, 4)
    for axes, word in ((threads, "threads"), (pipelines, "pipelines")):
        of = [row for row in rows if row["sweep"] == word]
        if of:
            if word == "threads":
                axes.set_xscale("log", base=2)
                axes.set_yscale("log", base=2)
            alone = max(row["cycles_per_ray"] for row in of)
            _curve(axes, of, word, lambda row, alone=alone: alone / row["cycles_per_ray"], color=_OURS)
            if word == "pipelines":
                axes.set_ylim(bottom=0)
        _plain(axes, f"times as fast, over {word}")
    for axes, title in ((traffic, "bytes a ray, over cache size ×"), (cycles, "cycles a ray")):
        for (scene, latency), color, style in zip(
                ((scene, latency) for scene in ("Quake3", "Conference") for latency in (4, 20)),
                (_OURS, _OURS, _OTHER, _OTHER), ("-", "--", "-", "--"), strict=True):
            of = [row for row in rows
                  if row["sweep"] == "caches" and (row["scene"], row["latency"]) == (scene, latency)]
            if of and not (axes is traffic and latency == 20):
                axes.set_xscale("log", base=2)
                _curve(axes, of, "caches", (lambda row: row["bytes_per_ray"] - row["bytes_per_ray_by_port"]["shading"])
                       if axes is traffic else (lambda row: row["cycles_per_ray"]), color=color, linestyle=style,
                       label=scene if axes is traffic else f"{scene}, latency {latency}")
        if axes.lines:
            axes.set_ylim(bottom=0)
            axes.legend(fontsize=7, frameon=False)
        _plain(axes, title)
