"""Vectors of three float64 as tuples."""

import math

from .compiled import compiled

__all__ = ["along", "dot", "largest", "minus", "scaled", "unit"]


@compiled()
def dot(a, b):
    """a·b."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


@compiled()
def along(a, s, b):
    """a + s·b."""
    return a[0] + s * b[0], a[1] + s * b[1], a[2] + s * b[2]


@compiled()
def minus(a, b):
    """a − b."""
    return a[0] - b[0], a[1] - b[1], a[2] - b[2]


@compiled()
def scaled(a, s):
    """s·a."""
    return a[0] * s, a[1] * s, a[2] * s


@compiled()
def largest(a):
    """max |aᵢ|."""
    return max(abs(a[0]), abs(a[1]), abs(a[2]))


@compiled()
def unit(a):
    """a / |a|; scaled first, so that no square over- or underflows; zero stays zero."""
    size = largest(a)
    if size == 0.0:
        return a
    a = a[0] / size, a[1] / size, a[2] / size
    length = math.sqrt(dot(a, a))
    return a[0] / length, a[1] / length, a[2] / length
