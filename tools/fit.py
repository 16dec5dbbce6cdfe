"""``dynrt fit``: the smallest chip that draws a scene well enough."""

from pathlib import Path

import click
from rich.console import Console
from rich.table import Table

from sim.golden import MAX_DEPTH, SHADINGS
from sim.scene import load_scene

from .chip_file import chip_text
from .engines import progress_on
from .errors import check_folders, clear_errors
from .fit_chip import Fitting
from .fit_page import check_page, fitted_page
from .options import CAMERA, QUALITY, SIZE, camera_of
from .quality import Quality
from .results import write_texts

__all__ = ["fit"]


@click.command()
@click.argument("scene")
@click.option("-o", "--output", type=click.Path(dir_okay=False, path_type=Path),
              help="Chip's file to write, for render --chip  [default: the scene's name + -chip.json]")
@click.option("--docs", type=click.Path(exists=True, file_okay=False, path_type=Path),
              help="Write the chip's file to results/ in this folder instead, as fit-NAME.json, and a row of the table "
              "in its accuracy.md")
@click.option("--quality", type=QUALITY, help="What a picture may have: wrong=PER CENT of pixels with "
              "another triangle than golden, cracks=NUMBER, phantoms=NUMBER, and must have: psnr=DB  "
              "[default: wrong=0.1,cracks=0]")
@click.option("--size", type=SIZE, default="512x384", show_default=True)
@click.option("--camera", type=CAMERA, help="As for render")
@click.option("--view", type=click.IntRange(min=0), help="As for render")
@click.option("--frames", type=click.IntRange(min=1), default=4, show_default=True,
              help="Times at which an animated scene is drawn")
@click.option("--shading", type=click.Choice(SHADINGS), help="As for render  [default: simple if the scene has nothing "
              "but colours, else full]")
@click.option("--depth", type=click.IntRange(0, MAX_DEPTH), default=4, show_default=True,
              help="Generations of secondary rays that are wanted")
@click.option("--flatten/--instances", default=None, help="As for render")
@click.option("--engine", type=click.Choice(["model", "rtl"]), default="rtl", show_default=True,
              help="rtl: threads and more are fitted by cycles of the simulated chip; model: quickly, without cycles")
@click.option("--slower", type=click.FloatRange(min=1), default=2.0, show_default=True,
              help="How many times the cycles of a chip with 64 threads it may take")
@click.option("--latency", type=click.IntRange(1, 1000), default=4, show_default=True,
              help="Cycles from a memory request to its first word")
@click.option("--area/--no-area", default=True, help="Synthesise the chip and the full one; some minutes each")
@click.option("--place", is_flag=True, help="Place and route both, for the clock and frames a second; takes hours")
def fit(scene, output, docs, quality, size, camera, view, frames, shading, depth, flatten, engine, slower, latency,
        area, place):
    """Find the smallest chip that draws SCENE well enough, say why, and write it to a file."""
    if place and not area:
        raise click.UsageError("--place: what is placed has an area; leave --no-area out")
    name = Path(scene).name.split(".")[0]
    if docs is not None:
        if output is not None:
            raise click.UsageError("-o: with --docs the file has its place; leave one of them out")
        output = docs / "results" / f"fit-{name}{f'-{shading}' if shading else ''}.json"
    output = output or Path(f"{name}-chip.json")
    if output.suffix.lower() != ".json":
        raise click.UsageError(f"-o: {output.name} must end in .json")
    check_folders(output)
    console = Console(stderr=True, highlight=False)

    def tell(text):
        console.print(text, markup=False, soft_wrap=True)

    with clear_errors():
        if docs is not None:
            # Before the long work
            check_page(docs)
        loaded = load_scene(scene)
        for warning in loaded.warnings:
            tell(f"warning: {warning}")
        times = [loaded.duration * k / frames for k in range(frames)] if loaded.is_animated else [0.0]
        poses = [(posed, camera_of(posed, camera, view)) for posed in map(loaded.at_time, times)]
        with progress_on(console, f"fitting a chip to {scene}") as progress:
            fitting = Fitting(loaded, poses, size=size, quality=quality or Quality(), shading=shading, depth=depth,
                              flatten=flatten, slower=slower, latency=latency, tell=tell, progress=progress)
            fitting.fit(has_clock=engine == "rtl", has_area=area, is_placed=place)
        about = {"scene": name if docs else str(scene), "size": list(size), "engine": engine, "slower": slower,
                 "latency": latency, **fitting.about()}
        texts = {output: chip_text(fitting.config, about)}
        if docs is not None:
            texts[docs / "accuracy.md"] = fitted_page(docs, dict(texts))
        write_texts(texts)
        _print(fitting)
        click.echo(f"{output}: draw with it by dynrt render {scene} --chip {output}")


def _print(fitting):
    console = Console(highlight=False)
    table = Table("parameter", "value", "because")
    for reason in fitting.reasons:
        table.add_row(reason.what, str(reason.value), reason.why)
    console.print(table)
    if fitting.figures:
        table = Table("", *("this chip", "full chip"))
        for name, pair in fitting.figures.items():
            table.add_row(name, *(f"{value:,}" if value is not None else "–" for value in pair))
        console.print(table)
