"""Tables of docs/benchmarks.md from results, and their CSV."""

import csv
import io

from sim.scene.table3 import TABLE3

from .bench_reasons import reasons, textured_reasons
from .page import filled_page, markdown_table

__all__ = ["csv_text", "filled", "table_rows"]

_PORTS = "nodes", "lists", "matrices"


def _percents(fractions):
    return " / ".join(f"{100 * fraction:.0f}" for fraction in fractions)


def _beside(ours, paper):
    return f"{ours} ({paper})" if paper is not None else ours


def _is(row, chip, size, shading="simple"):
    return (row["chip"], tuple(row["size"]), row["shading"]) == (chip, tuple(size), shading)


def _name(row):
    return row["scene"] if row["real"] else f"{row['scene']} *"


def table_rows(results, *, chip, size, shading="simple"):
    """Published rows of a chip at a size."""
    return [row for row in results.get("rows", []) if _is(row, chip, size, shading)]


#: Head of the table of speed.
_SPEED = ("scene", "triangles (paper)", "objects (paper)", "cycles a ray (paper)", "ratio",
          "frames/s at {mhz} MHz (paper)", "frames/s at 90 MHz", "chip ≠ model", "other triangle than golden")


def _speed(rows):
    if not rows:
        return markdown_table([], [])
    pixels = rows[0]["size"][0] * rows[0]["size"][1]
    head = [column.format(mhz=f"{rows[0]['clock_mhz']:g}") for column in _SPEED]
    return markdown_table(head, [[
        _name(row), _beside(f"{row['triangles']:,}", f"{row['paper']['triangles']:,}"),
        _beside(f"{row['objects']:,}", f"{row['paper']['objects']:,}"),
        _beside(f"{row['cycles_per_ray']:.2f}", row["paper_cycles_per_ray"] and f"{row['paper_cycles_per_ray']:.1f}"),
        f"{row['cycles_ratio']:.2f}" if row["cycles_ratio"] else "–",
        _beside(f"{row['fps']:.1f}", row["paper_fps"]), f"{row['fps_at_paper_clock']:.1f}",
        row["wrong_pixels_vs_model"],
        f"{row['wrong_pixels_vs_golden']} ({100 * row['wrong_pixels_vs_golden'] / pixels:.3f} %)"] for row in rows])


def _work(rows):
    return markdown_table(
        ["scene", "busy %: traversal / list / transformation / intersection (paper)",
         "hit %: nodes / lists / matrices (paper)", "bytes a ray: DynRTC + shading (paper)",
         "MB/s at {}: nodes / lists / matrices / shading".format(f"{rows[0]['clock_mhz']:g} MHz" if rows else "")],
        [[_name(row), _beside(_percents(list(row["busy"].values())[:4]), " / ".join(map(str, row["paper"]["busy"]))),
          _beside(_percents(row["hit"][port] for port in _PORTS), " / ".join(map(str, row["paper"]["hit"]))),
          _beside(_bytes(row), _paper_bytes(row)),
          " / ".join(f"{rate:.0f}" for rate in row["mb_per_s"].values())] for row in rows])


def _bytes(row):
    traced = sum(row["bytes_per_ray_by_port"][port] for port in _PORTS)
    return f"{traced:.1f} + {row['bytes_per_ray'] - traced:.1f}"


def _paper_bytes(row):
    rays = 1024 * 768 * row["paper"]["large_fps"]
    return " + ".join(f"{1e6 * rate / rays:.1f}" for rate in row["paper"]["megabytes"])


def _counted(rows):
    return markdown_table(
        ["scene", "kd-steps (paper)", "leaves", "list entries (paper)", "transformations (paper)",
         "triangle tests (paper)", "instances entered", "stack entries"],
        [[_name(row), *(_beside(f"{row[f'{what}_per_ray']:.2f}", paper and f"{paper:.1f}")
                        for what, paper in (("steps", _paper_work(row, 0)), ("leaves", None),
                                            ("entries", _paper_work(row, 1)), ("transformations", _paper_work(row, 2)),
                                            ("tests", _paper_work(row, 3)), ("instances", None))),
          row["stack_entries"]] for row in rows])


def _paper_work(row, unit):
    """Cycles that a unit of the paper works for a ray: its busy part of all."""
    return row["paper_cycles_per_ray"] and row["paper"]["busy"][unit] / 100 * row["paper_cycles_per_ray"]


def _largest(results, chip):
    """Of each scene the row of the largest picture, as the paper's Table 4 has."""
    found = {}
    for row in results["rows"]:
        if (row["chip"], row["shading"]) == (chip, "simple"):
            found[row["scene"]] = max(row, found.get(row["scene"], row), key=lambda other: other["size"])
    return list(found.values())


def _tables(chip):
    def make(results):
        if not results.get("rows"):
            return markdown_table([], [])
        parts = []
        for size, number in (((512, 384), 3), ((1024, 768), 4)):
            rows = table_rows(results, chip=chip, size=size)
            parts.append(f"{size[0]}×{size[1]} (Table {number}):\n\n{_speed(rows)}")
        rows = _largest(results, chip)
        sizes = " and ".join(dict.fromkeys("×".join(map(str, row["size"])) for row in rows))
        parts += [f"Units, caches and memories, {sizes}:\n", _work(rows)] if rows else []
        return "\n".join(parts + ([f"Work of a ray, {sizes}:\n", _counted(rows)] if chip == "paper" and rows else []))
    return make


def _textured(results):
    rows = table_rows(results, chip="paper", size=(512, 384), shading="textured")
    simple = {row["scene"]: row for row in table_rows(results, chip="paper", size=(512, 384))}
    table = markdown_table(
        ["scene", "cycles a ray (paper)", "simple shading", "frames/s at 90 MHz (paper)",
         "busy %: traversal / list / transformation / intersection / shader", "hit %: records / texels",
         "bytes a ray: DynRTC + shading", "chip ≠ model", "PSNR against golden"],
        [[_name(row), _beside(f"{row['cycles_per_ray']:.2f}", f"{row['paper_cycles_per_ray']:.1f}"),
          f"{simple[row['scene']]['cycles_per_ray']:.2f}" if row["scene"] in simple else "–",
          _beside(f"{row['fps_at_paper_clock']:.1f}", row["paper_fps"]), _percents(row["busy"].values()),
          _percents(row["hit"][name] for name in ("shading", "textures") if name in row["hit"]), _bytes(row),
          row["wrong_pixels_vs_model"], f"{row['psnr_vs_golden']:.1f} dB"] for row in rows])
    return "\n".join([table, *(f"- {line}" for line in textured_reasons(results.get("rows", [])))])


def _embree(results):
    cpu = results.get("cpu")
    if not cpu:
        return markdown_table([], [])
    about = (f"{cpu['model']}, one core at {cpu['clock_mhz']:.0f} MHz, at most {cpu['flops_per_cycle']} operations a "
             f"cycle: {cpu['flops_why']}; embreex {cpu['embreex']}. Ours: {results['operators']} operators a "
             "pipeline.\n")
    return f"{about}\n" + markdown_table(
        ["scene", "Mray/s, ours", "ours at 90 MHz", "Embree", "rays a 1,000 clocks, ours", "Embree", "ratio",
         "rays a 1,000,000 operations, ours", "Embree", "ratio"],
        [[row["scene"], f"{row['mrays']:.2f}", f"{row['mrays_at_paper_clock']:.2f}", f"{row['embree_mrays']:.2f}",
          f"{1e3 * row['rays_per_clock']:.1f}", f"{1e3 * row['embree_rays_per_clock']:.2f}",
          f"{row['clocks_ratio']:.0f}", f"{1e6 * row['rays_per_flop']:.0f}", f"{1e6 * row['embree_rays_per_flop']:.1f}",
          f"{row['flops_ratio']:.0f}"] for row in results.get("efficiency", [])])


def _sweeps(results):
    rows = results.get("sweeps", [])
    return markdown_table(
        ["sweep", "scene", "chip", "cycles a ray", "busy %: traversal / list / transformation / intersection",
         "hit %: nodes / lists / matrices", "bytes a ray, DynRTC", "chip ≠ model"],
        [[row["sweep"], _name(row), row["chip"], f"{row['cycles_per_ray']:.2f}", _percents(row["busy"].values()),
          _percents(row["hit"][port] for port in _PORTS),
          f"{sum(row['bytes_per_ray_by_port'][port] for port in _PORTS):.1f}", row["wrong_pixels_vs_model"]]
         for row in rows])


def _scenes(results):
    measured = {row["scene"]: row["real"] for row in results.get("rows", [])}
    return markdown_table(
        ["scene", "what it is here", "files below --scenes", "measured on"],
        [[name, row.source, ", ".join(f"`{file}`" for file in row.files) or "–",
          {True: "these", False: "the stand-in", None: "–"}[measured.get(name)]] for name, row in TABLE3.items()])


def _chips(results):
    area, table = results.get("area", {}), []
    for name, chip in results.get("chips", {}).items():
        part = area.get(name)
        table.append([
            name, chip["num_pipelines"], chip["num_threads"],
            f"{chip['node_lines'] * chip['node_line_items']} / {chip['list_lines'] * chip['list_line_items']} / "
            f"{chip['matrix_lines']}", f"{chip['latency']} cycles: {chip['memory']}",
            *(f"{part[place]:,} of {part['of'][place]:,}" if part else "–" for place in ("lut", "dsp", "ebr"))])
    return markdown_table(["chip", "pipelines", "threads of each", "cached nodes / list entries / matrices of each",
                           "memories", "tables", "multipliers", "block RAMs"], table)


def _reasons(results):
    return "\n".join(f"- {line}" for line in reasons(results.get("rows", []))) or "Nothing to explain."


def _secondary(results):
    rows = results.get("secondary", [])
    kinds = list(rows[0]["rays_by_kind"]) if rows else []
    return markdown_table(
        ["demo", "size", *(f"{kind} rays" for kind in kinds), "cycles a ray", "chip ≠ model"],
        [[row["demo"], "×".join(map(str, row["size"])), *(f"{row['rays_by_kind'][kind]:,}" for kind in kinds),
          f"{row['cycles_per_ray']:.1f}", row["rtl_wrong_pixels"]] for row in rows])


def _views(results):
    return markdown_table(
        ["scene, view", "kd-steps", "leaves", "list entries", "transformations", "triangle tests", "instances entered"],
        [[f"{row['scene']}{'' if row['real'] else ' *'}, {row['view']}",
          *(f"{row[f'{what}_per_ray']:.2f}" for what in ("steps", "leaves", "entries", "transformations", "tests",
                                                         "instances"))] for row in results.get("views", [])])


_PARTS = {"scenes": _scenes, "chips": _chips, "paper": _tables("paper"), "ulx3s_85f": _tables("ulx3s_85f"),
          "reasons": _reasons, "views": _views, "textured": _textured, "secondary": _secondary,
          "embree": _embree, "sweeps": _sweeps}


def filled(page, results):
    """See :func:`~tools.page.filled_page`."""
    return filled_page(page, _PARTS, results)


def _flat(row, prefix=""):
    for name, value in row.items():
        if isinstance(value, dict):
            yield from _flat(value, f"{prefix}{name}_")
        elif isinstance(value, (list, tuple)):
            yield f"{prefix}{name}", "x".join(map(str, value)) if name == "size" else "/".join(map(str, value))
        else:
            yield f"{prefix}{name}", value


def csv_text(results):
    """All rows of tables and sweeps, a column for each figure."""
    rows = [dict(_flat(row)) for row in [*results.get("rows", []), *results.get("sweeps", [])]]
    text = io.StringIO()
    table = csv.DictWriter(text, list(dict.fromkeys(column for row in rows for column in row)), lineterminator="\n")
    table.writeheader()
    table.writerows(rows)
    return text.getvalue()
