"""The golden tracer's compiled functions."""

from ..compiled import compiler

__all__ = ["compiled"]

compiled = compiler("golden", "sim/golden")
