"""Rays and triangles whose hits are known in float64."""

import numpy as np

__all__ = ["aimed_rays"]


def aimed_rays(fmt, count):
    """Rays towards triangles, half of them hitting, and what Cramer's rule says of them.

    Returns
    -------
    corners : float64[N, 3, 3]
    origin, direction : float64[N, 3]
        Members of the format.
    exact : tuple
        t, u, v, and whether it hits.
    clear : bool[N]
        Where rounding cannot decide: nearly edge-on or thin triangles and rays at an edge may go either way.
    """
    rng = np.random.default_rng(5)
    corners = fmt.quantize(rng.uniform(-1, 1, (count, 3, 3)))
    origin = fmt.quantize(rng.uniform(-3, 3, (count, 3)))
    weights = rng.dirichlet((1, 1, 1), count) + rng.uniform(-0.4, 0.4, (count, 3))
    target = np.einsum("ni,nij->nj", weights / weights.sum(axis=1, keepdims=True), corners)
    direction = fmt.quantize((target - origin) * rng.choice((-1, 1), (count, 1), p=(0.2, 0.8)))
    edges = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    t, u, v = np.linalg.solve(np.stack([-direction, *edges], axis=2), (origin - corners[:, 0])[..., None])[..., 0].T
    inside = (t > 0) & (u >= 0) & (v >= 0) & (u + v <= 1)
    normal = np.cross(*edges)
    steep = np.abs((normal * direction).sum(axis=1)) / np.linalg.norm(direction, axis=1) > 0.1
    clear = steep & (np.abs(np.stack([t, u, v, 1 - u - v])).min(axis=0) > 1e-3)
    assert 0.2 < inside[clear].mean() < 0.7
    assert clear.mean() > 0.5
    return corners, origin, direction, (t, u, v, inside), clear
