"""``dynrt chart``: what fewer bits and cheaper arithmetic do to pictures."""

import csv

import click
from rich.console import Console

from fpu import FloatFormat
from rtl.arithmetic import NUMBERS

from .chart_page import draw_charts, filled
from .chart_truth import Truth
from .errors import clear_errors, written_whole
from .options import docs_option, scenes_option
from .real_scenes import SCENES, real_scenes
from .results import code_version, earlier_results, json_text, write_texts

__all__ = ["chart"]

SIZE = 384, 288
FORMATS = ("5.8", "5.10", "6.10", "6.12", "7.12", "6.14", "7.14", "7.16", "7.18", "7.20", "7.23", "8.23")
#: Parameters of chips that differ in their pictures, by name.
VARIANTS = {**{name: {"arithmetic": NUMBERS[name], "edge_tolerance": 0}
               for name in ("separate", "fused", "truncated", "reciprocal")},
            **{f"tolerant {ulp}": {"edge_tolerance": ulp} for ulp in (2, 4, 8)}}
#: What a picture depends on.
_CODE = "fpu/**/*.py", "rtl/**/*.py", "sim/**/*.py", "tools/chart*.py"
_SCENES = (*SCENES, ("sunflowers", None, None))


@click.command()
@scenes_option
@docs_option("Where accuracy.md is, and results/accuracy.json, .csv and pictures/ go")
@click.option("--only", multiple=True, type=click.Choice([name for name, _, _ in _SCENES]),
              help="Only this scene; the others keep their figures")
@click.option("--format", "formats", multiple=True, type=click.Choice(FORMATS), help="Only this format  [default: all]")
def chart(scenes, docs, only, formats):
    """Draw scenes by the model in each format and arithmetic, and chart how far they are from float64.

    What has been measured with the same code is not measured again, so a run that was stopped goes on.
    """
    console = Console(stderr=True, highlight=False)
    page, path, version = docs / "accuracy.md", docs / "results" / "accuracy.json", code_version(*_CODE)
    with clear_errors():
        # Before the long work
        filled(page, [])
        rows = earlier_results(path).get("rows", [])
        known = {(row["scene"], row["format"], row["variant"]): row for row in rows}
        for name, scene, camera in real_scenes(scenes, only=only, scenes=_SCENES):
            truth = None
            for fmt in formats or FORMATS:
                missing = [variant for variant in VARIANTS
                           if known.get((name, fmt, variant), {}).get("version") != version]
                if not missing:
                    continue
                truth = truth or Truth(scene, camera, SIZE)
                measured = truth.measure(FloatFormat.parse(fmt), {variant: VARIANTS[variant] for variant in missing})
                for variant, figures in measured.items():
                    known[name, fmt, variant] = {"scene": name, "format": fmt, "variant": variant, **figures,
                                                 "version": version}
                rows = [known[place] for place in ((scene, one, variant) for scene, _, _ in _SCENES
                                                   for one in FORMATS for variant in VARIANTS) if place in known]
                _write(path, rows)
                console.print(f"{name}, {fmt}: " + ", ".join(
                    f"{variant} {figures['wrong_percent']} %" if "wrong_percent" in figures else figures["error"]
                    for variant, figures in measured.items()), soft_wrap=True, markup=False)
        _write(path, rows)
        draw_charts(rows, docs / "pictures")
        write_texts({page: filled(page, rows)})


def _write(path, rows):
    for folder in (path.parent, path.parent.parent / "pictures"):
        folder.mkdir(exist_ok=True)
    write_texts({path: json_text({"size": list(SIZE), "rows": rows})})
    columns = list(dict.fromkeys(column for row in rows for column in row if column != "version"))
    with written_whole(path.with_suffix(".csv")) as whole, open(whole, "w", newline="") as file:
        table = csv.DictWriter(file, columns, extrasaction="ignore")
        table.writeheader()
        table.writerows(rows)
