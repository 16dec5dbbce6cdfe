"""Ray/triangle tests, the chip's and those of others, each a datapath with its emulation in any format."""

from .closest import Answers, Pairs, closest_hits, near_pairs
from .method import Method
from .moller_trumbore import MOLLER_TRUMBORE
from .plucker import PLUCKER, PLUCKER_RELATIVE
from .projection import PROJECTION
from .tolerant import DEFAULT, TOLERANCES, tolerant
from .unit_triangle import FIRM, FUSED, PRINTED
from .watertight import WATERTIGHT

__all__ = ["DEFAULT", "METHODS", "Answers", "Method", "Pairs", "closest_hits", "near_pairs"]

#: All of them by name.
METHODS = {method.name: method for method in (
    PRINTED, FIRM, FUSED, DEFAULT, *map(tolerant, TOLERANCES), tolerant(8, bound="products"),
    tolerant(8, bound="terms"), MOLLER_TRUMBORE, PLUCKER, PLUCKER_RELATIVE, PROJECTION, WATERTIGHT)}
