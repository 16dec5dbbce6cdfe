"""``dynrt stability``: where ray/triangle tests fail, the chip's and others', and from where on."""

import json
import os
from concurrent.futures import ThreadPoolExecutor

import click
from rich.console import Console
from rich.progress import MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn

from sim.methods import METHODS
from sim.stability.cases import CASES, DECIDED, bounds_of, limits_of
from sim.stability.truth import BLUR

from .costs import measured_luts
from .errors import BadInput, clear_errors
from .options import FORMAT, docs_option
from .page import check_places, filled_page
from .results import write_texts
from .stability_page import PARTS
from .stability_plots import draw_plots

__all__ = ["measured", "stability"]

_NUM_RAYS = 10_000


def _row(method, case, value, probe, verdict):
    truth = getattr(probe, "probe", probe).truth
    return {"method": method, "case": case.name, "parameter": value, "rays": probe.num_rays,
            "failures": int(verdict.is_failure.sum()), "cracks": int(verdict.is_crack.sum()),
            "phantoms": int(verdict.is_phantom.sum()), "distances": int(verdict.is_distance.sum()),
            "odd": int(verdict.is_odd.sum()), "decided": int(truth.is_decided.sum())}


def measured(case, value, *, fmt, num_rays, jobs=1):
    """Rows of a value of a case: what fails of ``num_rays`` rays, for each method.

    Parameters
    ----------
    case : Case
    value : float
    fmt : FloatFormat
    num_rays : int
    jobs : int
        Methods at a time.
    """
    probe = case.probe(value, num_rays, fmt=fmt, rng=case.rng(value))
    if case.is_of_chip:
        return [_row("default", case, value, probe, probe.verdict())]
    # Once, for all of them
    probe.truth, probe.pairs, probe.rays  # noqa: B018
    with ThreadPoolExecutor(jobs) as pool:
        verdicts = pool.map(probe.verdict, METHODS.values())
        return [_row(name, case, value, probe, verdict) for name, verdict in zip(METHODS, verdicts, strict=True)]


def _limits(rows):
    """By case and method, between which values nothing fails; None if it does at the easiest."""
    found = {}
    for case in CASES.values():
        of_case = [row for row in rows if row["case"] == case.name]
        for method in dict.fromkeys(row["method"] for row in of_case):
            failures = {row["parameter"]: row["failures"] or row["decided"] < DECIDED * row["rays"]
                        for row in of_case if row["method"] == method}
            found.setdefault(case.name, {})[method] = limits_of(case, failures)
    return found


def _bounds(rows):
    """By case and method, between which values hardly more fails than at the easiest."""
    return {name: {method: bounds_of(case, [row for row in rows if row["case"] == name and row["method"] == method])
                   for method in dict.fromkeys(row["method"] for row in rows if row["case"] == name)}
            for name, case in CASES.items()}


def _methods(fmt, luts):
    rows = []
    for name, method in METHODS.items():
        cost, per_ray = method.cost(fmt)
        rows.append({"method": name, "cost": cost, "per_ray": per_ray,
                     "luts": sum(number * luts[kind] for kind, number in cost.items()
                                 if kind in luts) if luts and "dot" not in cost else None})
    return rows


@click.command()
@docs_option("Where accuracy.md is, and results/stability.json and pictures/ go")
@click.option("--only", type=click.Choice(list(CASES)), multiple=True, metavar="CASE",
              help=f"Measure this case, keep the others: {', '.join(CASES)}  [default: all]")
@click.option("--rays", type=click.IntRange(16), default=_NUM_RAYS, show_default=True,
              help="Rays for each value of a case")
@click.option("--format", "fmt", type=FORMAT, default="7.16", show_default=True,
              help="Float format, EXPONENT.FRACTION")
@click.option("--jobs", type=click.IntRange(1), default=os.cpu_count() or 1, show_default=True,
              help="Methods at a time")
def stability(docs, only, rays, fmt, jobs):
    """Try ray/triangle tests where they fail, and fill the tables of docs/accuracy.md."""
    console = Console(stderr=True)
    page, path = docs / "accuracy.md", docs / "results" / "stability.json"
    with clear_errors():
        # Before the long work
        check_places(page, PARTS)
        results = _known(path, fmt) if only else {"rows": []}
        chosen = [case for case in CASES.values() if not only or case.name in only]
        rows = [row for row in results["rows"] if row["case"] not in {case.name for case in chosen}]
        with Progress(TextColumn("{task.description}"), *Progress.get_default_columns()[1:3], MofNCompleteColumn(),
                      TimeElapsedColumn(), console=console) as progress:
            task = progress.add_task("", total=sum(len(case.values) for case in chosen))
            for case in chosen:
                for value in case.values:
                    progress.update(task, description=f"{case.name} {value:g}")
                    rows += measured(case, value, fmt=fmt, num_rays=rays, jobs=jobs)
                    progress.advance(task)
        order = {name: number for number, name in enumerate(CASES)}
        rows.sort(key=lambda row: order[row["case"]])
        luts = measured_luts(docs / "results" / "fpu.json", fmt=fmt) if str(fmt) == "7.16" else None
        results = {"format": str(fmt), "blur": BLUR, "methods": _methods(fmt, luts), "limits": _limits(rows),
                   "bounds": _bounds(rows), "rows": rows}
        text = filled_page(page, PARTS, results)
        for folder in (path.parent, docs / "pictures"):
            folder.mkdir(exist_ok=True)
        draw_plots(results, docs / "pictures")
        write_texts({path: _json(results), page: text})


def _known(path, fmt):
    """Results that are there, of which some cases are kept."""
    if not path.exists():
        return {"rows": []}
    try:
        results = json.loads(path.read_text())
        known = results["format"]
        results["rows"] = [row for row in results["rows"] if row["case"] in CASES]
    except (ValueError, KeyError, TypeError) as error:
        raise BadInput(f"{path}: is not what this command writes; measure all cases anew, without --only") from error
    if known != str(fmt):
        raise BadInput(f"{path}: has results of format {known}, which cannot stand beside those of {fmt}; leave out "
                       "--only, or name another folder with --docs")
    return results


def _json(results):
    """One line a row."""
    head = {name: value for name, value in results.items() if name != "rows"}
    lines = ",\n ".join(json.dumps(row, ensure_ascii=False) for row in results["rows"])
    return json.dumps(head, indent=1, ensure_ascii=False)[:-2] + f',\n "rows": [\n {lines}]\n}}\n'
