"""A kd-tree over boxes or triangles, built for the chip by the surface-area heuristic.

Wald, Havran: On building fast kd-trees for ray tracing, and on doing that in O(N log N), RT 2006 (perfect
splits, empty cut-off); here with candidate planes rounded to the chip's format before anything is classified
by them.
"""

from dataclasses import dataclass, field

import numpy as np

from .kdbuild import build
from .kdsplit import LEAF

__all__ = ["LEAF", "KdTree", "build_kdtree"]


@dataclass(frozen=True, eq=False)
class KdTree:
    """A kd-tree whose root stands for all of space: there is no bounding box to clip rays against.

    The root is node 0 and node 1 is unused; siblings are the pair of nodes at an even index, laid out depth
    first.

    Parameters
    ----------
    split : float64[N]
        Position of the splitting plane; 0 in a leaf.
    axis : uint8[N]
        0, 1, 2 for a split along x, y, z; 3 for a leaf.
    child : int32[N]
        Inner node: index of the lower child, the upper child follows it. Leaf: offset of its first item.
    count : int32[N]
        Leaf: number of items, 0 if empty. Inner node: 0.
    items : int32[M]
        Primitive numbers, leaves in depth-first order, ascending within a leaf.
    max_depth : int
        Edges from the root to the deepest leaf.
    stats : dict
        ``num_nodes, num_leaves, num_empty, num_items, num_dropped`` and ``expected_cost``, the cycles that
        the heuristic expects for a ray that crosses the bounds of all primitives and meets none of them.
    """

    split: np.ndarray
    axis: np.ndarray
    child: np.ndarray
    count: np.ndarray
    items: np.ndarray
    max_depth: int
    stats: dict = field(default_factory=dict)


def build_kdtree(lower, upper, *, triangles=None, frac_width=None, min_normal=0.0, pad=0.0, traversal_cost=1.0,
                 intersection_cost=1.5, empty_bonus=0.15, max_depth=30, surround=0.5, min_gain=3e-5):
    """Kd-tree of the primitives' boxes, each widened by ``pad`` on every side.

    A primitive is in the lower child if its widened box reaches below the plane, in the upper child if above;
    with ``triangles`` the box is that of the triangle clipped to the node widened by ``pad``, so a primitive
    may also be in neither. A box without extent that lies in the plane (only if ``pad`` is 0) goes to the
    cheaper side: a traversal that visits both sides where origin = plane and direction = 0 meets it. A
    primitive with a bound that is not finite or with lower > upper is left out.

    Planes are bounds rounded outward to ``frac_width`` fraction bits, lower bounds down, upper ones up. Space
    around the primitives is cut off by planes like any other: rays are taken to start within the bounds
    widened by ``surround`` times the largest extent.

    Parameters
    ----------
    lower, upper : float64[P, 3]
        Bounds of the primitives.
    triangles : float64[P, 3, 3], optional
        Corners of the primitives.
    frac_width : int, optional
        Fraction bits of a plane's significand, without the hidden bit; float64 if not given.
    min_normal : float
        Least magnitude of a plane that is not zero.
    pad : float
        Absolute widening of bounds, in their unit: the traversal's error bound.
    traversal_cost, intersection_cost : float
        Cost of a step of a packet, and of one primitive in a leaf. The units work side by side, so this is
        not the ratio of their cycles (1 to about 5) but the one that keeps both about equally busy.
    empty_bonus : float
        Fraction of the cost taken off a split with an empty side.
    max_depth : int
        Nodes at this depth are leaves.
    surround : float
        Extent of the space around the primitives where rays are expected, relative to the largest extent.
    min_gain : float
        A split must take at least this off the tree's expected cost: the price, in cycles, of two more nodes.

    Raises
    ------
    ValueError
        If shapes do not agree or a parameter is out of range.
    """
    lower, upper = (np.ascontiguousarray(bound, dtype=np.float64) for bound in (lower, upper))
    if lower.ndim != 2 or lower.shape[1] != 3 or lower.shape != upper.shape:
        raise ValueError(f"lower and upper must both be of shape (P, 3), not {lower.shape} and {upper.shape}")
    if triangles is None:
        triangles = np.empty((0, 3, 3))
    else:
        triangles = np.ascontiguousarray(triangles, dtype=np.float64)
        if triangles.shape != (len(lower), 3, 3):
            raise ValueError(f"triangles must be of shape ({len(lower)}, 3, 3), not {triangles.shape}")
    if frac_width is not None and not 1 <= frac_width <= 52:
        raise ValueError(f"frac_width must be within 1…52, not {frac_width}")
    if not (min(pad, surround, max_depth, min_gain) >= 0 and min(traversal_cost, intersection_cost) > 0):
        raise ValueError("pad, surround, max_depth and min_gain must not be negative, costs must be positive")
    with np.errstate(invalid="ignore"):
        present = np.flatnonzero((np.isfinite(lower) & np.isfinite(upper) & (lower <= upper)).all(axis=1))
    present = present.astype(np.int32)
    costs = (float(traversal_cost), float(intersection_cost), float(empty_bonus),
             52 if frac_width is None else int(frac_width), float(min_normal))
    (split, axis, child, count), items, deepest, expected_cost = build(
        present, lower, upper, triangles, float(pad), costs, float(min_gain), int(max_depth), float(surround))
    leaves = axis == LEAF
    leaves[1] = False
    stats = dict(num_nodes=len(axis) - 1, num_leaves=int(leaves.sum()),
                 num_empty=int((leaves & (count == 0)).sum()), num_items=len(items),
                 num_dropped=len(lower) - len(present), expected_cost=expected_cost)
    return KdTree(split, axis, child, count, items, deepest, stats)
