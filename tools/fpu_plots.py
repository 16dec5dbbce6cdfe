"""Plots of the operators' characterisation."""

from .figure import drawn_figure

__all__ = ["draw_plots"]

_TARGET_MHZ = 175
_CLOCK, _LUT, _FF = "#1f5fa8", "#c2571a", "#8a8a8a"
_COLUMNS = 4


def draw_plots(operators, folder):
    """Write ``fpu-depth.png`` and ``fpu-formats.png``.

    Parameters
    ----------
    operators : list of dict
        Rows of ``fpu.json``.
    folder : Path
        Where to.
    """
    rows = [row for row in operators if row["grade"] == 6 and row["rounding"] == "nearest-even"]
    for name, draw in (("depth", _depth), ("formats", _formats)):
        with drawn_figure(folder / f"fpu-{name}.png") as figure:
            draw(figure, rows)


def _by_operator(rows):
    operators = {}
    for row in rows:
        operators.setdefault(row["operator"], []).append(row)
    return operators


def _plain(axes):
    axes.spines[["top", "right"]].set_visible(False)
    axes.grid(axis="y", color="#e4e4e4", linewidth=0.8)
    axes.set_axisbelow(True)
    axes.tick_params(labelsize=8, length=2)


def _depth(figure, rows):
    """For each operator its clock above what it takes, against latency."""
    operators = _by_operator(row for row in rows if row["format"] == "7.16")
    columns = min(_COLUMNS, len(operators))
    lines = -(-len(operators) // columns)
    figure.set_size_inches(2.9 * columns + 0.4, 3.4 * lines + 0.4)
    highest = max(row["fmax_median_mhz"] for own in operators.values() for row in own)
    for panel, (name, own) in zip(figure.subfigures(lines, columns, squeeze=False).flat, operators.items(),
                                  strict=False):
        own = sorted(own, key=lambda row: row["latency"])
        latency = [row["latency"] for row in own]
        clock, cost = panel.subplots(2, 1, sharex=True, gridspec_kw={"height_ratios": (3, 2)})
        clock.fill_between(latency, [row["fmax_worst_mhz"] for row in own], [row["fmax_median_mhz"] for row in own],
                           color=_CLOCK, alpha=0.25, linewidth=0)
        clock.plot(latency, [row["fmax_worst_mhz"] for row in own], color=_CLOCK, linewidth=1.6)
        clock.axhline(_TARGET_MHZ, color="#555555", linewidth=0.8, linestyle=(0, (4, 3)))
        clock.plot(*zip(*((row["latency"], row["fmax_worst_mhz"]) for row in own if row["default"]), strict=True),
                   "o", color=_CLOCK, markersize=6)
        clock.set_title(name, fontsize=10, fontweight="bold", loc="left")
        clock.set_ylim(0, 1.05 * highest)
        clock.set_ylabel("MHz", fontsize=8, color=_CLOCK)
        cost.plot(latency, [row["lut"] for row in own], color=_LUT, linewidth=1.4)
        cost.plot(latency, [row["ff"] for row in own], color=_FF, linewidth=1.4)
        top = 1.15 * max(1, *(row[name] for row in own for name in ("lut", "ff")))
        cost.set_ylim(0, top)
        for name, color in (("lut", _LUT), ("ff", _FF)):
            cost.annotate(name.upper(), (latency[-1], own[-1][name]), (3, 0), textcoords="offset points", fontsize=7,
                          color=color, va="center", annotation_clip=False)
        cost.set_xlim(right=latency[-1] + 0.06 * max(latency[-1], 1))
        cost.set_xlabel("latency in clocks", fontsize=8)
        cost.xaxis.get_major_locator().set_params(integer=True)
        for axes in (clock, cost):
            _plain(axes)


def _formats(figure, rows):
    """What operators take, and their clock, at the default depth of each format."""
    figure.set_size_inches(11, 4.6)
    rows = [row for row in rows if row["default"]]
    formats = sorted({row["format"] for row in rows}, key=lambda name: sum(map(int, name.split("."))))
    panels = figure.subplots(1, 2)
    for axes, column, title in zip(panels, ("lut", "fmax_worst_mhz"), ("LUT", "MHz, worst seed"), strict=True):
        for index, (name, own) in enumerate(_by_operator(rows).items()):
            own = {row["format"]: row[column] for row in own}
            known = [fmt for fmt in formats if fmt in own]
            axes.plot([formats.index(fmt) for fmt in known], [own[fmt] for fmt in known], marker="o", markersize=3.5,
                      linewidth=1.4, label=name, color=f"C{index % 10}", linestyle=("-", "--")[index // 10 % 2])
        axes.set_xticks(range(len(formats)), formats)
        axes.set_ylim(bottom=0)
        axes.set_title(title, fontsize=10, fontweight="bold", loc="left")
        axes.set_xlabel("format", fontsize=8)
        _plain(axes)
    panels[1].axhline(_TARGET_MHZ, color="#555555", linewidth=0.8, linestyle=(0, (4, 3)))
    figure.legend(*panels[0].get_legend_handles_labels(), loc="outside right center", fontsize=8, frameon=False)
