"""Normals of triangles and of their corners."""

import numpy as np

__all__ = ["corner_normals", "flat_normals", "smooth_normals"]


def flat_normals(corners):
    """Unit normals float64[T, 3] along (v1 − v0) × (v2 − v0) of triangles float64[T, 3, 3]; zero if there is none."""
    edges = corners[:, 1:] - corners[:, :1]
    # Scaled first, so that products of tiny or huge edges stay within float64.
    scale = np.abs(edges).max(axis=(1, 2), initial=0.0)
    edges = edges / np.where((scale > 0) & np.isfinite(scale), scale, 1.0)[:, None, None]
    normals = np.cross(edges[:, 0], edges[:, 1])
    lengths = np.linalg.norm(normals, axis=1, keepdims=True)
    return np.divide(normals, lengths, out=np.zeros_like(normals), where=lengths > 0)


def corner_normals(mesh):
    """Unit shading normals float64[T, 3, 3] in object space, as docs/shading.md 3.3 wants them; None for a flat mesh.

    Those of a triangle are turned so that their sum lies on the side of (v1 − v0) × (v2 − v0); zero or infinite ones
    are replaced by the flat normal.
    """
    if mesh.normals is None:
        return None
    flat = flat_normals(np.nan_to_num(mesh.vertices[mesh.triangles]))[:, None]
    with np.errstate(invalid="ignore", over="ignore"):
        lengths = np.linalg.norm(mesh.normals, axis=2, keepdims=True)
    good = (lengths > 0) & np.isfinite(lengths)
    normals = np.where(good, np.where(good, mesh.normals, 0.0) / np.where(good, lengths, 1.0), 0.0)
    against = (normals.sum(axis=1, keepdims=True) * flat).sum(axis=2, keepdims=True) < 0
    return np.where(good, np.where(against, -normals, normals), flat)


def smooth_normals(vertices, triangles, *, crease_deg=180.0):
    """Corner normals float64[T, 3, 3]: at each corner the mean of its vertex's triangles, weighted by area.

    Parameters
    ----------
    vertices : float64[V, 3]
    triangles : int[T, 3]
    crease_deg : float
        A triangle that stands at more than this angle to the mean keeps its flat normal at that corner.
    """
    corners = vertices[triangles]
    areas = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    sums = np.zeros_like(vertices)
    np.add.at(sums, triangles.reshape(-1), np.repeat(areas, 3, axis=0))
    sums /= np.maximum(np.linalg.norm(sums, axis=1, keepdims=True), 1e-300)
    flat = flat_normals(corners)[:, None]
    smooth = sums[triangles]
    keeps = (smooth * flat).sum(axis=2, keepdims=True) < np.cos(np.radians(crease_deg))
    return np.where(keeps, flat, smooth)
