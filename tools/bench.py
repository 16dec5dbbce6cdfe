"""``dynrt bench``: the paper's Tables 3 and 4, measured again, beside the paper and beside Embree."""

import os
import platform
import re
from dataclasses import replace
from pathlib import Path

import click
from rich.console import Console
from rich.progress import MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn

from sim.scene.table3 import LARGE, SIZE, TABLE3

from .bench_area import area_rows
from .bench_chips import CHIPS
from .bench_clock import built_clock
from .bench_embree import core_clock, embree_row, embree_version, peak_flops_per_cycle
from .bench_jobs import run_jobs
from .bench_measure import BenchJob, measure
from .bench_page import csv_text, filled
from .bench_plots import draw_plots
from .bench_report import report_html
from .bench_rows import efficiency_rows, operators_of_pipeline, published
from .bench_secondary import secondary_rows
from .bench_sweeps import sweep_jobs, sweep_order
from .bench_views import view_rows
from .errors import BadInput, clear_errors, written_whole
from .options import SIZE as SIZE_TYPE
from .options import docs_option
from .results import earlier_results, json_text, write_texts

__all__ = ["bench"]

#: Whose scenes have textures.
TEXTURED = ("Castle", "Office", "Quake3", "Quake3-p", "UT2003", "SunCOR")
PARTS = ("embree", "views", "simple", "textured", "sweeps", "area")


def _key(row):
    return row["scene"], row["chip"], tuple(row["size"]), row["shading"]


def _order(row):
    return (list(TABLE3).index(row["scene"]), row["shading"] != "simple", list(CHIPS).index(row["chip"]), row["size"])


def _table_jobs(folder, *, parts, only, chips, sizes, earlier):
    """BenchJobs of the tables; scene by scene and shading by shading, as what follows each other shares a scene."""
    jobs = []
    for scene in only or TABLE3:
        for shading, names, usual in (("simple", list(CHIPS), (SIZE, LARGE)), ("textured", ["paper"], (SIZE,))):
            if shading in parts and (shading == "simple" or scene in TEXTURED):
                jobs += [BenchJob(scene=scene, folder=folder, chip=name, config=CHIPS[name].config,
                                  latency=CHIPS[name].latency, size=size, shading=shading)
                         for name in names if not chips or name in chips for size in sizes or usual]
    return [replace(job, earlier=earlier.get(job.key)) for job in jobs]


def _cpu():
    """The core that Embree runs on."""
    model = re.search(r"^model name\s*: (.*)$", Path("/proc/cpuinfo").read_text(), re.MULTILINE) if Path(
        "/proc/cpuinfo").exists() else None
    flops, why = peak_flops_per_cycle()
    return {"model": model[1] if model else platform.processor(), "clock_mhz": core_clock(), "flops_per_cycle": flops,
            "flops_why": why, "embreex": embree_version()}


def _known(path):
    """What earlier runs have written, without rows of scenes and chips that there are no more."""
    results = {"rows": [], "sweeps": [], "embree": {}} | earlier_results(path)
    try:
        results["rows"] = [row for row in results["rows"] if row["scene"] in TABLE3 and row["chip"] in CHIPS]
        for row in (*results["rows"], *results["sweeps"]):
            _key(row), row["cycles"], row["digest"]
    except (LookupError, TypeError) as error:
        raise BadInput(f"{path}: is not what this command writes; remove it to measure anew") from error
    return results


def _is_shown(row):
    """Whether its picture stands for its scene."""
    shading = "textured" if row["scene"] in TEXTURED else "simple"
    return (row["chip"], tuple(row["size"]), row["shading"]) == ("paper", SIZE, shading)


class _Results:
    """bench.json and all that is made of it."""

    def __init__(self, docs):
        self.docs, self.path = docs, docs / "results" / "bench.json"
        # Before the long work
        filled(docs / "benchmarks.md", {})
        self.clock = built_clock(self.path.parent)
        self.results = _known(self.path)
        self.pictures = docs / "pictures"
        self.pictures.mkdir(exist_ok=True)

    def by_key(self, name):
        return {_key(row): row for row in self.results[name]}

    def add(self, name, row, picture=None):
        """Keeps a row at once: the whole takes a while, and may be stopped."""
        self.results[name] = [other for other in self.results[name] if _key(other) != _key(row)] + [row]
        if picture is not None and name == "rows" and _is_shown(row):
            with written_whole(self.pictures / f"bench-{row['scene']}.png") as path:
                path.write_bytes(picture)
        self.write()

    def write(self):
        results = self.results
        results |= {
            "paper_size": list(SIZE), "operators": operators_of_pipeline(),
            "secondary": secondary_rows(self.path.parent),
            "chips": {name: {"about": chip.about, "latency": chip.latency, "memory": chip.memory,
                             **{field: str(value) if field == "fmt" else value
                                for field, value in vars(chip.config).items()}} for name, chip in CHIPS.items()},
            "rows": sorted((published(row, clock=self.clock, embree=results["embree"]) for row in results["rows"]),
                           key=_order),
            "sweeps": sorted(results["sweeps"], key=sweep_order)}
        if "cpu" in results:
            results["efficiency"] = efficiency_rows(results["rows"], embree=results["embree"], cpu=results["cpu"],
                                                    operators=results["operators"])
        write_texts({self.path: json_text(results)})

    def pages(self):
        """Everything that people read."""
        draw_plots(self.results, self.pictures)
        write_texts({self.path.with_suffix(".csv"): csv_text(self.results),
                     self.docs / "benchmarks.md": filled(self.docs / "benchmarks.md", self.results),
                     self.docs / "benchmarks.html": report_html(self.results, self.pictures)})


def _run(jobs, found, *, progress, workers, scheduler):
    """Measures ``jobs``: pairs of what is done with the result, and BenchJob."""
    kinds = {job.key: kind for kind, job in jobs}
    task = progress.add_task("", total=len(jobs))
    for job, (row, picture) in run_jobs(measure, [job for _, job in jobs], num_workers=workers, scheduler=scheduler):
        kind = kinds[job.key]
        found.add("rows" if kind == "rows" else "sweeps", row if kind == "rows" else {"sweep": kind, **row}, picture)
        name = f"{job.scene}, {job.chip}, {job.size[0]}x{job.size[1]}, {job.shading}"
        progress.update(task, advance=1, description=name)
        progress.console.print(
            f"{name}: {row['cycles_per_ray']:.2f} cycles a ray, {row['wrong_pixels_vs_model']} wrong pixels"
            f"{'' if picture else ', as before'}", highlight=False, markup=False, soft_wrap=True)


@click.command()
@click.option("--scenes", type=click.Path(exists=True, file_okay=False, path_type=Path),
              help="Folder with the scenes and cameras.json; built-in ones stand for those that are missing")
@docs_option("Where benchmarks.md is, and results/bench.json, .csv, benchmarks.html and pictures/ go")
@click.option("--only", multiple=True, type=click.Choice(list(TABLE3)), metavar="SCENE",
              help=f"Only this scene; the others keep their figures: {', '.join(TABLE3)}")
@click.option("--chip", "chips", multiple=True, type=click.Choice(list(CHIPS)), help="Only this chip, of the tables")
@click.option("--size", "sizes", multiple=True, type=SIZE_TYPE, help="Pictures of this size  [default: 512x384 and "
              "1024x768, of full shading 512x384]")
@click.option("--part", "parts", multiple=True, type=click.Choice(PARTS), help="Only this part  [default: all]")
@click.option("--jobs", type=click.IntRange(1), default=os.cpu_count() or 1, show_default="all cores",
              help="Pictures at a time")
@click.option("--scheduler", metavar="ADDRESS", help="Of a Dask cluster, whose workers draw in place of this machine")
def bench(scenes, docs, only, chips, sizes, parts, jobs, scheduler):
    """Measure the paper's Tables 3 and 4 on the simulated chip, and fill docs/benchmarks.md.

    What has been measured with the same chip and the same content of its memory is not measured again, so a run that
    was stopped goes on. Embree is timed in every run, before all else, while the other cores are idle.
    """
    console, folder = Console(stderr=True), None if scenes is None else str(scenes.resolve())
    parts = parts or PARTS
    with clear_errors():
        (docs / "results").mkdir(exist_ok=True)
        found = _Results(docs)
        if "embree" in parts:
            found.results["cpu"] = _cpu()
            for name in only or TABLE3:
                loaded = TABLE3[name].load(folder)
                found.results["embree"][name] = embree_row(loaded.scene, loaded.camera, SIZE)
                console.print(f"{name}: Embree {found.results['embree'][name]['embree_mrays']:.2f} Mray/s",
                              highlight=False)
            found.write()
        if "views" in parts:
            found.results["views"] = view_rows(folder, only=only, earlier=found.results.get("views", []),
                                               console=console)
            found.write()
        todo = [("rows", job) for job in _table_jobs(folder, parts=parts, only=only, chips=chips, sizes=sizes,
                                                     earlier=found.by_key("rows"))]
        if "sweeps" in parts:
            todo += sweep_jobs(folder, only=only, earlier=found.by_key("sweeps"))
        with Progress(TextColumn("{task.description}"), *Progress.get_default_columns()[1:3], MofNCompleteColumn(),
                      TimeElapsedColumn(), console=console) as progress:
            _run(todo, found, progress=progress, workers=jobs, scheduler=scheduler)
        if "area" in parts:
            found.results["area"] = area_rows(names=chips or list(CHIPS), earlier=found.results.get("area", {}),
                                              console=console)
        found.write()
        found.pages()
