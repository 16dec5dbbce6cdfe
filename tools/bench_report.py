"""The benchmarks on one page that stands alone."""

import base64
import html
import io

from PIL import Image

from sim.scene.table3 import TABLE3

from .bench_page import table_rows
from .bench_reasons import reasons

__all__ = ["report_html"]

_PICTURE, _QUALITY = (256, 192), 80
_STYLE = """
body { font: 15px/1.45 system-ui, sans-serif; max-width: 70rem; margin: 2rem auto; padding: 0 1rem; color: #222; }
table { border-collapse: collapse; margin: 1rem 0; font-size: 13px; }
th, td { padding: .3rem .6rem; border-bottom: 1px solid #ddd; text-align: right; }
th:first-child, td:first-child { text-align: left; }
.better { color: #1d7a34; } .worse { color: #b3361b; }
figure { display: inline-block; margin: 0 .6rem .8rem 0; font-size: 12px; } img { max-width: 100%; }
"""


def _inlined(path, *, size=None):
    """A picture in the page: scaled down as a JPEG, or as it is."""
    if size is None:
        kind, data = "png", path.read_bytes()
    else:
        file = io.BytesIO()
        with Image.open(path) as picture:
            picture.convert("RGB").resize(size, Image.Resampling.LANCZOS).save(file, "JPEG", quality=_QUALITY)
        kind, data = "jpeg", file.getvalue()
    return f'<img alt="{html.escape(path.stem)}" src="data:image/{kind};base64,{base64.b64encode(data).decode()}">'


def _table(head, rows):
    lines = ["".join(f"<th>{html.escape(str(cell))}</th>" for cell in head)]
    lines += ["".join(f"<td>{cell}</td>" for cell in row) for row in rows]
    return "<table>" + "".join(f"<tr>{line}</tr>\n" for line in lines) + "</table>"


def _ratio(ratio):
    if ratio is None:
        return "–"
    return f'<span class="{"better" if ratio <= 1 else "worse"}">{ratio:.2f}</span>'


def _speed(results, chip, size):
    rows = table_rows(results, chip=chip, size=size)
    if not rows:
        return ""
    table = _table(
        ["scene", "triangles", "objects", "cycles a ray", "paper", "ratio", f"frames/s at {rows[0]['clock_mhz']:g} MHz",
         "at 90 MHz", "paper at 90 MHz", "kd-steps", "transformations", "tests", "bytes a ray", "Embree, Mray/s",
         "chip ≠ model"],
        [[html.escape(row["scene"] + ("" if row["real"] else " *")), f"{row['triangles']:,}", f"{row['objects']:,}",
          f"{row['cycles_per_ray']:.2f}", f"{row['paper_cycles_per_ray']:.1f}", _ratio(row["cycles_ratio"]),
          f"{row['fps']:.1f}", f"{row['fps_at_paper_clock']:.1f}", row["paper_fps"], f"{row['steps_per_ray']:.1f}",
          f"{row['transformations_per_ray']:.1f}", f"{row['tests_per_ray']:.1f}", f"{row['bytes_per_ray']:.1f}",
          "–" if row["embree_mrays"] is None else f"{row['embree_mrays']:.1f}", row["wrong_pixels_vs_model"]]
         for row in rows])
    about = results["chips"][chip]
    return (f"<h2>{html.escape(chip)}, {size[0]}×{size[1]}</h2><p>{html.escape(about['about'])}: "
            f"{about['num_pipelines']} × {about['num_threads']} threads; {html.escape(about['memory'])}. Clock by "
            f"{html.escape(rows[0]['clock_source'])}.</p>{table}")


def _sources():
    return "".join(f"<li>{html.escape(f'{name}: {row.source}.')}</li>" for name, row in TABLE3.items())


def report_html(results, pictures):
    """The page as text.

    Parameters
    ----------
    results : dict
        As in ``bench.json``.
    pictures : Path
        Folder with the pictures and plots; those that are missing are left out.
    """
    found = []
    for row in table_rows(results, chip="paper", size=(512, 384)):
        path = pictures / f"bench-{row['scene']}.png"
        if path.exists():
            found.append(f"<figure>{_inlined(path, size=_PICTURE)}<br>{html.escape(row['scene'])}</figure>")
    plots = [_inlined(pictures / f"bench-{name}.png") for name in ("cycles", "sweeps")
             if (pictures / f"bench-{name}.png").exists()]
    tables = [_speed(results, chip, size) for chip in results.get("chips", {}) for size in ((512, 384), (1024, 768))]
    why = "".join(f"<li>{html.escape(line)}</li>" for line in reasons(results.get("rows", [])))
    return (f"<!doctype html><html lang=\"en\"><meta charset=\"utf-8\"><title>DynRT: benchmarks</title>"
            f"<style>{_STYLE}</style><h1>The paper's tables, measured again</h1>"
            "<p>Primary rays by the cycle-accurate simulated chip, beside Schmittler et al. 2004. All figures are in "
            "results/bench.json, written by make bench; docs/benchmarks.md says how they are measured. A scene with * "
            f"is a stand-in.</p>{''.join(found)}<p>{plots[0] if plots else ''}</p>{''.join(tables)}"
            f"<h2>More cycles than the paper</h2><ul>{why}</ul>"
            f"<h2>Chips of many sizes</h2><p>{plots[1] if len(plots) > 1 else ''}</p>"
            f"<h2>Scenes</h2><ul>{_sources()}</ul></html>\n")
