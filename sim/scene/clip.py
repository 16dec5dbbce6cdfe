"""Bounds of the part of a triangle that lies in a box."""

import numba
import numpy as np

__all__ = ["MAX_CORNERS", "clip_bounds"]

# Exact arithmetic makes nine at most; rounded, each of the six planes can cross every edge and so double
# them.
MAX_CORNERS = 3 * 2 ** 6


@numba.njit(cache=True)
def clip_bounds(triangle, box, pad, bounds, polygon, clipped):
    """Narrow ``bounds`` to the points of the box within ``pad`` of the triangle in each coordinate; false if
    none is.

    Those lie within ``pad`` of the triangle clipped to the box widened by ``pad`` (Sutherland, Hodgman 1974).

    Parameters
    ----------
    triangle : float64[3, 3]
    box, bounds : float64[6]
        Lower, then upper x, y, z.
    pad : float
    polygon, clipped : float64[MAX_CORNERS, 3]
        Work space.
    """
    num_corners = 3
    for i in range(3):
        for k in range(3):
            polygon[i, k] = triangle[i, k]
    for side in range(6):
        k = side >> 1
        if side & 1:
            plane, sign = box[3 + k] + pad, -1.0
        else:
            plane, sign = box[k] - pad, 1.0
        num_clipped = 0
        previous = num_corners - 1
        previous_depth = (polygon[previous, k] - plane) * sign
        for i in range(num_corners):
            depth = (polygon[i, k] - plane) * sign
            if (depth < 0.0) != (previous_depth < 0.0):
                s = previous_depth / (previous_depth - depth)
                for m in range(3):
                    clipped[num_clipped, m] = polygon[previous, m] + s * (polygon[i, m] - polygon[previous, m])
                clipped[num_clipped, k] = plane
                num_clipped += 1
            if depth >= 0.0:
                for m in range(3):
                    clipped[num_clipped, m] = polygon[i, m]
                num_clipped += 1
            previous, previous_depth = i, depth
        polygon, clipped = clipped, polygon
        num_corners = num_clipped
        if num_corners == 0:
            return False
    for k in range(3):
        least, most = np.inf, -np.inf
        for i in range(num_corners):
            least = min(least, polygon[i, k])
            most = max(most, polygon[i, k])
        # Corners made by clipping carry up to a few ulp of error per plane; original ones bound them from
        # outside.
        slack = 16 * 2.0 ** -53 * max(abs(least), abs(most))
        bounds[k] = max(bounds[k], least - pad - slack)
        bounds[3 + k] = min(bounds[3 + k], most + pad + slack)
        if bounds[k] > bounds[3 + k]:
            return False
    return True
