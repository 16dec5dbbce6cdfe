"""Which triangles can be traced at all."""

import numpy as np

__all__ = ["unusable_warnings", "usable_triangles"]


def usable_triangles(mesh):
    """True where a triangle has finite vertices that do not lie on one line.

    The area test is |e1 × e2| > 4 ulp · |e1|·|e2| with e1, e2 the edges at the first vertex: below it the
    normal is rounding error. Edges are scaled by the largest coordinate first, so that no product over- or
    underflows.

    Parameters
    ----------
    mesh : Mesh

    Returns
    -------
    bool[T]
    """
    corners = mesh.vertices[mesh.triangles]
    finite = np.isfinite(corners).all(axis=(1, 2))
    corners = np.where(finite[:, None, None], corners, 0.0)
    # Halved: the difference of two finite coordinates may exceed the largest float.
    edges = corners[:, 1:] * 0.5 - corners[:, :1] * 0.5
    scale = np.abs(edges).max(axis=(1, 2), initial=0.0)
    edges /= np.where(scale > 0.0, scale, 1.0)[:, None, None]
    lengths = np.linalg.norm(edges, axis=2)
    area = np.linalg.norm(np.cross(edges[:, 0], edges[:, 1]), axis=1)
    return finite & (area > 4 * np.finfo(np.float64).eps * lengths[:, 0] * lengths[:, 1])


def unusable_warnings(meshes):
    """One sentence for each kind of unusable triangle in each mesh, with its count."""
    warnings = []
    for mesh in meshes:
        finite = np.isfinite(mesh.vertices[mesh.triangles]).all(axis=(1, 2))
        num_infinite = np.count_nonzero(~finite)
        num_degenerate = np.count_nonzero(finite & ~mesh.usable)
        for count, kind in ((num_infinite, "non-finite"), (num_degenerate, "degenerate")):
            if count:
                warnings.append(f"mesh '{mesh.name}': {count} {kind} triangle{'s' if count > 1 else ''} dropped")
    return warnings
