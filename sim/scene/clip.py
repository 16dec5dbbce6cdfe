"""Bounds of the part of a triangle that lies in a box."""

import numba
import numpy as np

__all__ = ["clipped_bounds"]


@numba.njit(cache=True)
def clipped_bounds(triangle, box_lower, box_upper, pad, polygon, clipped, lower, upper):
    """Bounds of {x in the box: x within ``pad`` of the triangle in every coordinate}; False if that is empty.

    Those points lie within ``pad`` of the triangle clipped to the box widened by ``pad`` (Sutherland, Hodgman
    1974).

    Parameters
    ----------
    triangle : float64[3, 3]
    box_lower, box_upper : float64[3]
    pad : float
    polygon, clipped : float64[9, 3]
        Work space.
    lower, upper : float64[3]
        On entry, bounds already known; on return, narrowed to the result.
    """
    num_corners = 3
    for i in range(3):
        for k in range(3):
            polygon[i, k] = triangle[i, k]
    for side in range(6):
        k = side >> 1
        if side & 1:
            plane, sign = box_upper[k] + pad, -1.0
        else:
            plane, sign = box_lower[k] - pad, 1.0
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
        lower[k] = max(lower[k], least - pad - slack)
        upper[k] = min(upper[k], most + pad + slack)
        if lower[k] > upper[k]:
            return False
    return True
