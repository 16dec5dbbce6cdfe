"""Plots of where ray/triangle tests fail."""

import numpy as np

from sim.stability.cases import CASES

from .figure import drawn_figure
from .stability_page import SHOWN, rates

__all__ = ["draw_plots"]

_SWEPT = ("edges", "silhouettes", "grazing", "slivers", "size", "far", "scaled instance", "scale")
_LEAST = 1e-5
_COLORS = ("#8a8a8a", "#c2571a", "#1f5fa8", "#2b8a3e")


def draw_plots(results, folder):
    """Write ``stability.png``, a map of failure rates, and ``stability-sweeps.png``, rates over the parameters.

    Parameters
    ----------
    results : dict
        As in ``stability.json``.
    folder : Path
        Where to.
    """
    for name, draw in (("stability", _map), ("stability-sweeps", _sweeps)):
        with drawn_figure(folder / f"{name}.png") as figure:
            draw(figure, results)


def _map(figure, results):
    from matplotlib.colors import LogNorm

    found = rates(results)
    cases = list(found)
    methods = list(dict.fromkeys(row["method"] for row in results["rows"]))
    values = np.array([[found[case].get(method, np.nan) for method in methods] for case in cases])
    figure.set_size_inches(0.72 * len(methods) + 2.6, 0.36 * len(cases) + 1.8)
    axes = figure.subplots()
    shown = np.ma.masked_invalid(np.maximum(values, _LEAST))
    picture = axes.imshow(shown, norm=LogNorm(_LEAST, 1), cmap="YlOrRd", aspect="auto")
    for (row, column), value in np.ndenumerate(values):
        if not np.isnan(value):
            axes.text(column, row, "0" if value == 0 else f"{100 * value:.2g}", ha="center", va="center", fontsize=7,
                      color="white" if value > 0.1 else "#9a9a9a" if value == 0 else "black")
    axes.set_xticks(range(len(methods)), methods, rotation=40, ha="right", fontsize=8)
    axes.set_yticks(range(len(cases)), cases, fontsize=8)
    axes.set_title(f"Rays that fail, %, format {results['format']}", fontsize=10)
    figure.colorbar(picture, ax=axes, label="part of the rays")


def _sweeps(figure, results):
    cases = [CASES[name] for name in _SWEPT if any(row["case"] == name for row in results["rows"])]
    columns = 4
    lines = max(-(-len(cases) // columns), 1)
    figure.set_size_inches(3.1 * columns, 2.7 * lines + 0.4)
    panels = figure.subplots(lines, columns, squeeze=False).flat
    for axes in panels:
        axes.set_visible(False)
    for axes, case in zip(figure.axes, cases, strict=False):
        axes.set_visible(True)
        for method, color in zip(SHOWN, _COLORS, strict=True):
            of = [row for row in results["rows"] if row["case"] == case.name and row["method"] == method]
            axes.plot([row["parameter"] for row in of],
                      [max(row["failures"] / max(row["rays"], 1), _LEAST) for row in of], color=color, marker="o",
                      markersize=3, linewidth=1.2, label=method)
        if min(case.values) > 0:
            axes.set_xscale("log")
        axes.set_yscale("log")
        axes.set_ylim(_LEAST / 1.5, 1.5)
        axes.set_title(case.name, fontsize=9)
        axes.set_xlabel(case.parameter, fontsize=7)
        axes.tick_params(labelsize=7)
        axes.spines[["top", "right"]].set_visible(False)
        axes.grid(color="#e4e4e4", linewidth=0.8)
    if cases:
        figure.legend(*figure.axes[0].get_legend_handles_labels(), loc="outside lower center", ncols=len(SHOWN),
                      fontsize=8)
        figure.suptitle("Part of the rays that fail; the lowest line is none", fontsize=10)
