"""``dynrt pipeline``: full shading on the simulated chip, its cost, and how it scales."""

import json
from pathlib import Path

import click
from rich.console import Console

from .costs import cost_tables, measured_luts
from .errors import clear_errors, written_whole
from .pipeline_demos import DEPTH, FORMAT, JITTER, LATENCY, demo_rows
from .pipeline_effects import effect_rows
from .pipeline_page import filled
from .pipeline_scaling import SCALING_SIZE, cache_rows, scaling_rows

__all__ = ["pipeline"]


@click.command()
@click.option("--docs", type=click.Path(exists=True, file_okay=False, path_type=Path), default=Path("docs"),
              show_default=True, help="Where pipeline.md is, and results/pipeline.json goes")
@click.option("--only", type=click.Choice(["effects", "demos", "scaling", "caches", "operators"]), multiple=True,
              help="Measure these parts, keep the others  [default: all]")
def pipeline(docs, only):
    """Draw the demos of full shading on the simulated chip, scale it, and fill the tables of docs/pipeline.md."""
    console = Console(stderr=True)
    page, path, pictures = docs / "pipeline.md", docs / "results" / "pipeline.json", docs / "pictures"
    parts = {
        "operators": lambda: cost_tables(fmt=FORMAT, luts=measured_luts(docs / "results" / "fpu.json", fmt=FORMAT)),
        "effects": lambda: effect_rows(pictures / "pipeline-effects.png", console),
        "demos": lambda: demo_rows(pictures, console),
        "scaling": lambda: scaling_rows(console),
        "caches": lambda: cache_rows(console),
    }
    with clear_errors():
        # Before the long work
        filled(page, {})
        results = json.loads(path.read_text()) if path.exists() else {}
        for folder in (path.parent, pictures):
            folder.mkdir(exist_ok=True)
        results["chip"] = {"format": str(FORMAT), "depth": DEPTH, "latency": LATENCY, "jitter": JITTER,
                           "scaling_size": list(SCALING_SIZE)}
        for name, measure in parts.items():
            if not only or name in only:
                results[name] = measure()
                _write(page, path, results)


def _write(page, path, results):
    text = filled(page, results)
    for target, content in ((path, json.dumps(results, indent=1) + "\n"), (page, text)):
        with written_whole(target) as whole:
            whole.write_text(content)
