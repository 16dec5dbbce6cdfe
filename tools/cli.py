"""``dynrt``, the command."""

import click

from sim.garbage import collect_rarely

from .arithmetic import arithmetic
from .bench import bench
from .board_frames import board_frames
from .build import build
from .chart import chart
from .cracks import cracks
from .first_light import first_light
from .fit import fit
from .fpu_report import fpu_report
from .inspect import image
from .load import load
from .pipeline import pipeline
from .render import render
from .simulated import simulated
from .stability import stability
from .units import units
from .view import view

__all__ = ["main"]


@click.group(context_settings={"help_option_names": ["-h", "--help"], "show_default": False})
@click.version_option(package_name="dynrt")
def main():
    """DynRT: a real-time ray tracer in hardware, simulated."""
    collect_rarely()


main.add_command(arithmetic)
main.add_command(bench)
main.add_command(board_frames)
main.add_command(build)
main.add_command(chart)
main.add_command(cracks)
main.add_command(first_light)
main.add_command(fit)
main.add_command(fpu_report)
main.add_command(load)
main.add_command(pipeline)
main.add_command(render)
main.add_command(simulated)
main.add_command(stability)
main.add_command(units)
main.add_command(view)
main.add_command(image)
