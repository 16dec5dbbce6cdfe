"""Tables of docs/pipeline.md from results."""

from .page import filled_page, markdown_table

__all__ = ["filled"]


def _demos(results):
    rows = results.get("demos", [])
    drawn = markdown_table(
        ["demo", "size", "cycles", "rays", "cycles a ray", "instructions a pixel", "chip ≠ model",
         "PSNR, model and golden", "FLIP", "another first surface", "pixels > 8 levels off", "PSNR of the others"],
        [[row["demo"], "×".join(map(str, row["size"])), f"{row['cycles']:,}", f"{row['rays']:,}", row["cycles_per_ray"],
          row["instructions_per_pixel"], row["rtl_wrong_pixels"], f"{row['psnr_db']} dB", row["flip"],
          row["other_surface_pixels"], row["far_pixels"], f"{row['psnr_near_db']} dB"] for row in rows])
    kinds = list(rows[0]["rays_by_kind"]) if rows else []
    by_kind = markdown_table(["demo", *kinds], [[row["demo"], *(f"{row['rays_by_kind'][kind]:,}" for kind in kinds)]
                                                for row in rows])
    units = list(rows[0]["busy"]) if rows else []
    caches = list(dict.fromkeys(cache for row in rows for cache in row["hit_rate"]))
    work = markdown_table(
        ["demo", *(f"{unit}, busy" for unit in units), *(f"{cache}, hits" for cache in caches)],
        [[row["demo"], *(f"{row['busy'][unit]:.0%}" for unit in units),
          *(f"{row['hit_rate'][cache]:.1%}" if cache in row["hit_rate"] else "–" for cache in caches)] for row in rows])
    return "\n".join((drawn, by_kind, work))


def _scaling(results):
    rows = results.get("scaling", [])
    return markdown_table(
        ["threads", "pipelines", "shaders each", "rays", "cycles", "cycles a ray", "chip ≠ model", "traversal, busy",
         "transformation, busy", "shader, busy"],
        [[row["threads"], row["pipelines"], row["shaders"],
          f"{row['rays']:,}" + (", half of them shadow rays" if row["shadows"] else ", primary"), f"{row['cycles']:,}",
          f"{row['cycles'] / row['rays']:.2f}", row["rtl_wrong_pixels"],
          *(f"{row['busy'][unit]:.0%}" for unit in ("traversal", "transformation", "shader"))] for row in rows])


def _operators(results):
    tables = results.get("operators", {})
    columns = "add", "mul", "div", "cmp"

    def counts(cost):
        return "/".join(str(cost[column] or "–") for column in columns) if cost else "–"

    units = markdown_table(["unit", "add/mul/div/cmp", "paper"],
                           [[row["unit"], counts(row), counts(row["paper"])] for row in tables.get("table2", [])])
    ratios = markdown_table(
        ["this design over", "", "counted by", "without traversal", "paper", "full", "paper"],
        [[" + ".join(row["sum"]), row["design"], row["by"], f"{row['without_traversal']:.0%}",
          f"{row['paper']['without_traversal']:.0%}", f"{row['full']:.0%}", f"{row['paper']['full']:.0%}"]
         for row in tables.get("table1", [])])
    return "\n".join((units, ratios))


_PARTS = {"demos": _demos, "scaling": _scaling, "operators": _operators}


def filled(page, results):
    """See :func:`~tools.page.filled_page`."""
    return filled_page(page, _PARTS, results)
