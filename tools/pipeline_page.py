"""Tables of docs/pipeline.md from results."""

from .page import filled_page, markdown_table

__all__ = ["filled"]


def _demos(results):
    rows = results.get("demos", [])
    drawn = markdown_table(
        ["demo", "size", "cycles", "rays", "cycles a ray", "instructions a pixel", "chip ≠ model",
         "PSNR, model and golden", "FLIP", "PSNR of golden, moved 1/256 pixel", "another first surface",
         "pixels > 8 levels off", "of which golden shows within 1/64 pixel", "PSNR of the others"],
        [[row["demo"], "×".join(map(str, row["size"])), f"{row['cycles']:,}", f"{row['rays']:,}", row["cycles_per_ray"],
          row["instructions_per_pixel"], row["rtl_wrong_pixels"], f"{row['psnr_db']} dB", row["flip"],
          f"{row['golden_moved_psnr_db']} dB", row["other_surface_pixels"], row["far_pixels"], row["explained_pixels"],
          f"{row['psnr_near_db']} dB"] for row in rows])
    formats = [point["format"] for point in rows[0]["formats"]] if rows else []
    by_format = markdown_table(
        ["demo: PSNR in dB, FLIP", *formats],
        [[row["demo"], *(f"{point['psnr_db']:.1f}, {point['flip']:.4f}" for point in row["formats"])] for row in rows])
    enough = markdown_table(
        ["demo", "narrowest format that is enough", "PSNR", "FLIP", "cycles", "chip ≠ model"],
        [[row["demo"], found["format"], f"{found['psnr_db']} dB", found["flip"], f"{found['cycles']:,}",
          found["rtl_wrong_pixels"]] for row in rows for found in [row.get("enough")] if found])
    kinds = list(rows[0]["rays_by_kind"]) if rows else []
    by_kind = markdown_table(["demo", *kinds], [[row["demo"], *(f"{row['rays_by_kind'][kind]:,}" for kind in kinds)]
                                                for row in rows])
    units = list(rows[0]["busy"]) if rows else []
    caches = list(dict.fromkeys(cache for row in rows for cache in row["hit_rate"]))
    work = markdown_table(
        ["demo", *(f"{unit}, busy" for unit in units), *(f"{cache}, hits" for cache in caches)],
        [[row["demo"], *(f"{row['busy'][unit]:.0%}" for unit in units),
          *(f"{row['hit_rate'][cache]:.1%}" if cache in row["hit_rate"] else "–" for cache in caches)] for row in rows])
    return "\n".join((drawn, by_format, enough, by_kind, work))


def _effects(results):
    return markdown_table(
        ["effect", "switches of its own", "instructions", "rays", "cycles", "chip ≠ model", "PSNR, model and golden",
         "PSNR of golden, moved 1/256 pixel", "FLIP"],
        [[row["effect"], ", ".join(row["switches"]) or "–", row["instructions"], f"{row['rays']:,}",
          f"{row['cycles']:,}", row["rtl_wrong_pixels"], f"{row['psnr_db']} dB",
          f"{row['golden_moved_psnr_db']} dB", row["flip"]]
         for row in results.get("effects", [])])


def _scaling(results):
    rows = results.get("scaling", [])
    sizes = markdown_table(
        ["threads", "pipelines", "shaders each", "rays", "cycles", "cycles a ray", "chip ≠ model", "traversal, busy",
         "transformation, busy", "shader, busy", "busiest memory port"],
        [[row["threads"], row["pipelines"], row["shaders"],
          f"{row['rays']:,}, " + (f"{row['shadow_rays']:,} of them shadow rays" if row["shadows"] else "primary"),
          f"{row['cycles']:,}",
          f"{row['cycles'] / row['rays']:.2f}", row["rtl_wrong_pixels"],
          *(f"{row['busy'][unit]:.0%}" for unit in ("traversal", "transformation", "shader")),
          "{}: {:.0%}".format(*max(row["port_busy"].items(), key=lambda port: port[1]))] for row in rows])
    return f"{sizes}\n{_kinds_of_rays(rows)}"


def _kinds_of_rays(rows):
    """What a primary and what a shadow ray takes, of chips with and without shadows."""
    cycles = {(row["threads"], row["pipelines"], row["shaders"], row["shadows"]): row["cycles"] for row in rows}
    costs = []
    for row in rows:
        size = row["threads"], row["pipelines"], row["shaders"]
        if row["shadows"] and (*size, False) in cycles:
            alone = cycles[*size, False]
            primary, shadow = alone / (row["rays"] - row["shadow_rays"]), (row["cycles"] - alone) / row["shadow_rays"]
            costs.append([row["shaders"], f"{primary:.2f}", f"{shadow:.2f}", f"{shadow / primary - 1:+.0%}"])
    return markdown_table(["shaders", "cycles a primary ray, shaded, alone", "cycles more a shadow ray", ""], costs)


def _caches(results):
    return markdown_table(
        ["lines of records", "lines of texels", "cycles", "records, hits", "texels, hits", "KB of records",
         "KB of texels"],
        [[row["shading_lines"], row["texture_lines"], f"{row['cycles']:,}", f"{row['shading_hit_rate']:.1%}",
          f"{row['textures_hit_rate']:.1%}",
          *(f"{row[f'{name}_bytes'] / 1024:,.0f}" for name in ("shading", "textures"))]
         for row in results.get("caches", [])])


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


_PLACES = {"lut": "tables", "ff": "flip-flops", "dsp": "multipliers", "ebr": "block RAMs"}


def _change(row, base, place):
    """How much more a row has than another."""
    more = row[place] - base[place]
    return f"{more:+,}" if more else "0"


def _area(results):
    measured = results.get("area", {"device": {}, "chips": []})
    device, rows = measured["device"], measured["chips"]
    by_name = {row["chip"]: row for row in rows}
    table = []
    for row in rows:
        base = by_name.get(row["beside"])
        table.append([row["chip"], row["instructions"] or "–",
                      *(f"{row[place]:,}" for place in _PLACES), f"{row['lut'] / device['lut']:.0%}",
                      *((_change(row, base, place) for place in _PLACES) if base else "––––"), row["beside"] or "–"])
    return markdown_table(["chip", "instructions", *_PLACES.values(), f"tables of an {device.get('name')}",
                           *(f"± {place}" for place in _PLACES.values()), "than"], table)


def _units(results):
    """Units in rows, chips in columns."""
    rows = results.get("area", {"units": []})["units"]
    chips = list(dict.fromkeys(row["chip"] for row in rows))
    found = {(row["unit"], row["chip"]): row for row in rows}
    totals = {chip: {place: sum(row[place] for row in rows if row["chip"] == chip) for place in _PLACES}
              for chip in chips}
    units = sorted(dict.fromkeys(row["unit"] for row in rows),
                   key=lambda unit: -max(found[unit, chip]["lut"] for chip in chips if (unit, chip) in found))
    table = []
    for unit in units:
        line = [unit]
        for chip in chips:
            row = found.get((unit, chip))
            line += ["–"] * 5 if row is None else [
                f"{row['lut']:,}", f"{row['lut'] / totals[chip]['lut']:.0%}",
                *(f"{row[place]:,}" for place in ("ff", "dsp", "ebr"))]
        table.append(line)
    columns = ["tables", "of all", "flip-flops", "multipliers", "block RAMs"]
    return markdown_table(["unit", *(f"{chip}: {column}" for chip in chips for column in columns)], table)


def _clock(results):
    return markdown_table(["chip", "grade", "seed", "MHz", "slowest path"],
                          [[row["chip"], row["grade"], row["seed"], row["fmax_mhz"], row["critical_path"]]
                           for row in results.get("clock", [])])


_PARTS = {"effects": _effects, "demos": _demos, "scaling": _scaling, "caches": _caches, "operators": _operators,
          "area": _area, "units": _units, "clock": _clock}


def filled(page, results):
    """See :func:`~tools.page.filled_page`."""
    return filled_page(page, _PARTS, results)
