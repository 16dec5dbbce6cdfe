"""Directions and strengths of mirrored and refracted rays (docs/shading.md, sections 3, 6 and 7)."""

import math

from .compiled import compiled
from .vector import along, largest

__all__ = ["offset", "reflect", "refract", "schlick", "slack"]

# Offsets against self-intersection, in units in the last place of the largest coordinate.
_OFFSET_ULP = 8.0


@compiled()
def slack(a, b):
    """k·ulp of the largest coordinate of two points, k = 8."""
    _, exponent = math.frexp(max(largest(a), largest(b)))
    return math.ldexp(_OFFSET_ULP, exponent - 53)


@compiled()
def offset(point, normal, origin, side):
    """P ± eN with e = k·ulp(max(|Oᵢ|, |Pᵢ|)), the side +1 or −1."""
    return along(point, side * slack(point, origin), normal)


@compiled()
def reflect(direction, normal, c):
    """D − 2cN with c = D·N."""
    return along(direction, -2.0 * c, normal)


@compiled()
def refract(direction, normal, c, length2, eta):
    """``(κ, direction)`` of the refracted ray, as long as D; κ < 0 stands for total reflection.

    κ = √(d² − η²(d² − c²)), T = ηD − (ηc + κ)N, with N against D, c = D·N, d² = |D|², η = n₁/n₂.
    """
    square = length2 - eta * eta * (length2 - c * c)
    if square < 0.0:
        return -1.0, direction
    kappa = math.sqrt(square)
    bend = eta * c + kappa
    return kappa, (eta * direction[0] - bend * normal[0], eta * direction[1] - bend * normal[1],
                   eta * direction[2] - bend * normal[2])


@compiled()
def schlick(facing, cosine):
    """r₀ + (1 − r₀)(1 − cos)⁵."""
    m = 1.0 - min(max(cosine, 0.0), 1.0)
    return facing + (1.0 - facing) * m * m * m * m * m
