"""The model's compiled functions, which have the datapaths' kernels and the image's layout inlined."""

from ..compiled import compiler

__all__ = ["compiled"]

compiled = compiler("model", "fpu", "rtl", "sim/model", "sim/scene")
