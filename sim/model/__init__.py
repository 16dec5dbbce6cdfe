"""The chip without a clock: its arithmetic and the order of its decisions, bit for bit."""

from .full import render_full
from .model import render_model

__all__ = ["render_full", "render_model"]
