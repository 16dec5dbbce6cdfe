"""The simulated machine: the Verilated chip and the memories round it."""

from .bench import HangError, SimulationError
from .build import BuildError
from .machine import render_rtl

__all__ = ["BuildError", "HangError", "SimulationError", "render_rtl"]
