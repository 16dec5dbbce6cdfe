"""Tests by the unit triangle without a tolerance: the paper's, the chip's, and the chip's with fused sums."""

import numpy as np

from fpu import Datapath
from rtl.affine_map import affine_map
from rtl.arithmetic import ARITHMETICS
from rtl.intersection import unit_triangle

from ..scene.triangles import turned, unit_triangle_maps
from .method import Method
from .parts import dot, named

__all__ = ["FIRM", "FUSED", "PRINTED", "printed_map", "stored_matrix"]

_FUSED = next(arithmetic for arithmetic in ARITHMETICS if arithmetic.name == "fused")


def printed_map(fmt, *, latencies=None):
    """``result`` = m·X + N for a point, m·X for a direction, as paper §2.1.1 prints it, each operation rounded.

    Datapath: 9 adders, 9 multipliers.
    """
    dp = Datapath(fmt, latencies=latencies)
    is_point, vector, offset = dp.flag("is_point"), dp.vector("vector"), dp.vector("offset")
    for row, axis in enumerate("xyz"):
        shift = dp.select(is_point, getattr(offset, axis), dp.const(0.0))
        dp.output(f"result_{axis}", dp.add(dot(dp, dp.vector(f"row{row}"), vector), shift))
    return dp


def stored_matrix(corners):
    """Rows and C of the scene compiler's matrices, of triangles as it turns them; NaN where there is none."""
    return _matrix(turned(corners)[0])


def _matrix(corners):
    rows, centers, usable = unit_triangle_maps(corners, normal_scale=1.0)
    rows[~usable] = np.nan
    stored = named("center", centers)
    for row in range(3):
        stored |= named(f"row{row}", rows[:, row])
    return stored


def _stored_offset(corners):
    stored = _matrix(corners)
    center = [stored.pop(f"center_{axis}") for axis in "xyz"]
    for row, axis in enumerate("xyz"):
        stored[f"offset_{axis}"] = -sum(stored[f"row{row}_{k}"] * c for k, c in zip("xyz", center, strict=True))
    return stored


def _fused_map(fmt):
    return affine_map(fmt, arithmetic=_FUSED)


PRINTED = Method("printed", _stored_offset, unit_triangle, point_map=printed_map, needs_area=True)
FIRM = Method("firm edges", stored_matrix, unit_triangle, point_map=affine_map, needs_area=True)
FUSED = Method("fused", stored_matrix, unit_triangle, point_map=_fused_map, needs_area=True)
