"""``dynrt image``: what the chip reads of a scene."""

import click

from fpu import FloatFormat
from sim.scene import load_scene
from sim.scene.compile import compile_scene
from sim.scene.image import describe

from .errors import clear_errors
from .options import FORMAT

__all__ = ["image"]


@click.command()
@click.argument("scene")
@click.option("--format", "fmt", type=FORMAT, default=str(FloatFormat(7, 16)), show_default=True)
@click.option("--limit", type=click.IntRange(min=1), default=20, show_default=True, help="Items of each memory")
@click.option("--flatten/--instances", default=None, help="As for render")
def image(scene, fmt, limit, flatten):
    """Print the memory image of SCENE: nodes, lists, matrices and shading data (layout in sim/scene/image.py)."""
    with clear_errors():
        compiled = compile_scene(load_scene(scene), fmt=fmt, flatten=flatten)
    for line in describe(compiled, limit=limit):
        click.echo(line)
