"""Quadratic Bézier patches as triangles."""

import numpy as np

__all__ = ["bezier_rows", "grid_triangles", "tessellate"]


def bezier_rows(num_points, level):
    """Weights float64[S·level + 1, 2S + 1] of control points at the steps of S = (num_points − 1)/2 quadratic curves.

    A curve through P0, P1, P2 is (1 − t)²·P0 + 2t(1 − t)·P1 + t²·P2, at t = k/level; neighbours share a point.
    """
    t = np.arange(level + 1) / level
    weights = np.stack([(1 - t) ** 2, 2 * t * (1 - t), t**2], axis=1)
    num_curves = (num_points - 1) // 2
    rows = np.zeros((num_curves * level + 1, num_points))
    for curve in range(num_curves):
        rows[curve * level:(curve + 1) * level + 1, 2 * curve:2 * curve + 3] = weights
    return rows


def grid_triangles(height, width):
    """Corners int64[2(height − 1)(width − 1), 3] of triangles over a grid of points, numbered row by row.

    Their front is where (along a row) × (along a column) points.
    """
    first = (np.arange(height - 1)[:, None] * width + np.arange(width - 1)).reshape(-1, 1)
    pair = np.array([(0, 1, width), (1, width + 1, width)])
    return (first[:, None] + pair).reshape(-1, 3)


def tessellate(control, level):
    """Points float64[N, H′, W′, K] on patches with control points float64[N, H, W, K], H and W odd.

    Between two joints of a patch there are ``level`` steps each way.
    """
    rows, columns = (bezier_rows(control.shape[axis], level) for axis in (1, 2))
    return np.einsum("ai,bj,nijk->nabk", rows, columns, control, optimize=True)
