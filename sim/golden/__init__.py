"""The golden ray tracer: float64 throughout, sharing nothing with the chip's arithmetic or its spatial index."""

from .compare import Comparison, compare, psnr
from .picture import render_golden
from .tracer import Hits, render, trace

__all__ = ["Comparison", "Hits", "compare", "psnr", "render", "render_golden", "trace"]
