"""The simulated machine: the Verilated chip and the memories round it."""

from .bench import HangError, SimulationError
from .build import BuildError, chip_library
from .machine import render_rtl
from .moving import render_frames
from .pysim import render_pysim

__all__ = ["BuildError", "HangError", "SimulationError", "chip_library", "render_frames", "render_pysim", "render_rtl"]
