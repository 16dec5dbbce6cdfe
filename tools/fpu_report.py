"""``dynrt fpu-report``: every operator placed and routed alone, and its error."""

import json
import os
import warnings
from pathlib import Path

import click
from amaranth.hdl import UnusedElaboratable
from rich.console import Console

from boards import ecp5
from boards.toolchain import versions

from .errors import BadInput, clear_errors
from .fpu_operators import OPERATORS
from .fpu_peers import load_peers
from .fpu_plots import draw_plots
from .fpu_report_page import check_markers, filled
from .fpu_sweep import measure, peer_points, sweep
from .options import docs_option
from .results import earlier_results, write_texts

__all__ = ["fpu_report"]

#: Columns of the table that is kept beside the operators.
_COLUMNS = ("operator", "format", "latency", "lut", "ff", "dsp", "ebr", "fmax_worst_mhz")


@click.command("fpu-report")
@docs_option("Where fpu.md is, and results/fpu.json and pictures/ go")
@click.option("--table", type=click.Path(dir_okay=False, path_type=Path), default=Path("fpu/measured.json"),
              show_default=True, help="Where the table goes by which datapaths choose their depth")
@click.option("--only", multiple=True, type=click.Choice(list(OPERATORS)),
              help="Measure only this operator; the others keep their figures")
@click.option("--seeds", type=click.IntRange(1), default=5, show_default=True, help="Placements of each")
@click.option("--jobs", type=click.IntRange(1), default=os.cpu_count() or 1, show_default=True,
              help="Runs of place and route at a time")
@click.option("--peer", type=click.Path(exists=True, dir_okay=False, path_type=Path),
              help="JSON that lists operators of others, in Verilog, to be measured beside ours")
def fpu_report(docs, table, only, seeds, jobs, peer):
    """Place and route every operator alone and fill the tables of docs/fpu.md.

    What has been placed before is not placed again, as long as neither the operator nor a tool has changed: a run that
    was stopped goes on where it was.
    """
    # Some are only asked for their latency.
    warnings.simplefilter("ignore", UnusedElaboratable)
    console = Console(stderr=True, highlight=False)
    page, results_path = docs / "fpu.md", docs / "results" / "fpu.json"
    with clear_errors():
        # Before the long work
        check_markers(page)
        peers = load_peers(peer) if peer else []
        flow = _flow(seeds)
        results = _earlier(results_path, flow, only, peer)
        chosen = [entry for name, entry in OPERATORS.items() if not only or name in only]
        points = list(dict.fromkeys([*(point for entry in chosen for point in sweep(entry)), *peer_points(peers)]))
        rows, peer_rows = measure(points, peers, seeds=flow["seeds"], jobs=jobs, console=console)
        results = {
            "flow": flow,
            "operators": _merged(results.get("operators", []), rows, {entry.name for entry in chosen}),
            "peers": peer_rows if peer else results.get("peers", []),
        }
        for folder in (results_path.parent, docs / "pictures"):
            folder.mkdir(exist_ok=True)
        text = filled(page, results)
        draw_plots(results["operators"], docs / "pictures")
        write_texts({results_path: _json(results), table: _table(results), page: text})
    console.print(f"{len(rows)} points of {len(chosen)} operators and {len(peer_rows)} peers; see {page}",
                  soft_wrap=True)


def _flow(seeds):
    return {"device": ecp5.DEVICE.name, "package": ecp5.DEVICE.package, "tools": versions(),
            "synthesis": ecp5.SYNTHESIS, "synthesis_retimed": ecp5.RETIMING, "place_and_route": " ".join(ecp5.ROUTE),
            "target_mhz": ecp5.TARGET_MHZ, "seeds": list(range(1, seeds + 1))}


def _earlier(path, flow, only, peer):
    """Results of an earlier run that are kept, which must be of the same flow."""
    if not path.exists():
        return {}
    earlier = earlier_results(path)
    if earlier.get("flow") == flow:
        return earlier
    kept = [what for what, stays in (("operators", only), ("peers", not peer and earlier.get("peers"))) if stays]
    if kept:
        remedy = " and ".join({"operators": "without --only", "peers": "with --peer"}[what] for what in kept)
        raise BadInput(f"{path}: its {' and '.join(kept)} were measured with other tools, options or seeds; run "
                       f"{remedy}, or remove it")
    return {}


def _merged(earlier, rows, measured):
    """Earlier rows of operators that were not measured now, and the new ones, in the order of the operators."""
    def key(row):
        return tuple(row[name] for name in ("operator", "format", "grade", "latency", "rounding"))

    order = list(OPERATORS)
    kept = {key(row): row for row in earlier if row["operator"] in order and row["operator"] not in measured}
    return sorted((kept | {key(row): row for row in rows}).values(), key=lambda row: order.index(row["operator"]))


def _json(results):
    """One line for each row, so that a change shows as one."""
    def lines(rows):
        return "[\n  " + ",\n  ".join(map(json.dumps, rows)) + "\n ]" if rows else "[]"

    return (f'{{\n "flow": {json.dumps(results["flow"])},\n "operators": {lines(results["operators"])},\n '
            f'"peers": {lines(results["peers"])}\n}}\n')


def _table(results):
    rows = [[row[column] for column in _COLUMNS] for row in results["operators"]
            if row["grade"] == 6 and row["rounding"] == "nearest-even"]
    return (f'{{\n "columns": {json.dumps(_COLUMNS)},\n "rows": [\n  ' + ",\n  ".join(map(json.dumps, rows)) +
            "\n ]\n}\n")
