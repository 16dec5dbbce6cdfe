"""``dynrt pipeline``: full shading on the simulated chip, its cost, and how it scales."""


import click
from rich.console import Console

from .costs import cost_tables, measured_luts
from .errors import clear_errors
from .options import docs_option
from .pipeline_area import measure_area, measure_clock
from .pipeline_chips import CHIPS, CLOCKED
from .pipeline_demos import DEPTH, FORMAT, JITTER, LATENCY, demo_rows
from .pipeline_effects import effect_rows
from .pipeline_page import filled
from .pipeline_scaling import SCALING_SIZE, cache_rows, scaling_rows
from .results import earlier_results, json_text, write_texts

__all__ = ["pipeline"]


@click.command()
@docs_option("Where pipeline.md is, and results/pipeline.json goes")
@click.option("--only", multiple=True,
              type=click.Choice(["effects", "demos", "scaling", "caches", "operators", "area", "clock"]),
              help="Measure these parts, keep the others  [default: all]")
@click.option("--chip", "chips", type=click.Choice(list(CHIPS)), multiple=True, metavar="NAME",
              help="Measure area and clock of this chip of docs/pipeline.md; the others keep their figures")
@click.option("--jobs", type=click.IntRange(1), default=2, show_default=True,
              help="Runs of synthesis, or of place and route, at a time: 1 to 3 GB each")
@click.option("--seeds", type=click.IntRange(1), default=1, show_default=True,
              help="Placements of each chip whose clock is measured")
def pipeline(docs, only, chips, jobs, seeds):
    """Draw the demos of full shading on the simulated chip, scale it, and fill the tables of docs/pipeline.md.

    Whole chips are synthesised for their area, two minutes each, and some placed and routed for their clock, half an
    hour each. These are not done again, as long as neither the chip nor a tool has changed: a run that was stopped goes
    on where it was.
    """
    console = Console(stderr=True)
    page, path, pictures = docs / "pipeline.md", docs / "results" / "pipeline.json", docs / "pictures"
    parts = {
        "operators": lambda: cost_tables(fmt=FORMAT, luts=measured_luts(docs / "results" / "fpu.json", fmt=FORMAT)),
        "effects": lambda: effect_rows(pictures / "pipeline-effects.png", console),
        "demos": lambda: demo_rows(pictures, console),
        "scaling": lambda: scaling_rows(console),
        "caches": lambda: cache_rows(console),
        "area": lambda: measure_area(names=chips or list(CHIPS), earlier=results.get("area", {}), jobs=jobs,
                                     console=console),
        "clock": lambda: measure_clock(names=chips or CLOCKED, earlier=results.get("clock", []),
                                       seeds=range(1, seeds + 1), jobs=jobs, console=console),
    }
    with clear_errors():
        # Before the long work
        filled(page, {})
        results = earlier_results(path)
        for folder in (path.parent, pictures):
            folder.mkdir(exist_ok=True)
        results["chip"] = {"format": str(FORMAT), "depth": DEPTH, "latency": LATENCY, "jitter": JITTER,
                           "scaling_size": list(SCALING_SIZE)}
        for name, measure in parts.items():
            if not only or name in only:
                results[name] = measure()
                # Kept after each part: this takes a while, and may be stopped.
                write_texts({path: json_text(results), page: filled(page, results)})
