"""The golden ray tracer: float64 throughout, sharing nothing with the chip's arithmetic or its spatial index."""

from .compare import Comparison, compare, psnr
from .full import MAX_DEPTH, shade_full
from .picture import SHADINGS, render_golden
from .tracer import Hits, render, trace

__all__ = ["MAX_DEPTH", "SHADINGS", "Comparison", "Hits", "compare", "psnr", "render", "render_golden", "shade_full",
           "trace"]
