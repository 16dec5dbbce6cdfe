"""What scenes are compiled to: parts, each with its tree and its triangles' matrices."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from .error import SceneError
from .facing import facing
from .kdtree import build_kdtree
from .srgb import encode
from .triangles import turned, unit_triangle_maps

__all__ = ["INSTANCE_COST", "Part", "color_words", "make_part", "tree_over"]

# Bounds are widened by so many units in the last place of 1, the order of all coordinates: the error of
# t = (split − O) / D for rays that come from about as far as the scene is wide.
_PAD_ULP = 2

# Cost of one more primitive in a leaf when a kd-step costs 1. The units work side by side, so what counts is that
# none waits for another, not the five cycles that a triangle takes in the transformation.
_TRIANGLE_COST = 2.0
INSTANCE_COST = 25.0

# Part of the cost taken off a split that cuts off empty space: the best of 0.05…0.4 over room, simple room and
# conference; greater ones give fewer but far fuller leaves.
_EMPTY_BONUS = 0.1


@dataclass(frozen=True, eq=False)
class Part:
    """A mesh, or all meshes of a flattened scene, in coordinates of order 1.

    Parameters
    ----------
    name : str
    corners : float64[T, 3, 3]
        Of its triangles, members of the chip's format, as :func:`~sim.scene.triangles.turned` has them.
    first : int8[T]
        Which of each triangle's corners in its mesh comes first here.
    sign : int8[T]
        −1 where the normal is turned, see :func:`~sim.scene.facing.facing`.
    instance : int32[T]
        The scene's instance of each; −1 if the part is a mesh.
    prim : int32[T]
        Its number in its mesh.
    material : int32[T]
    rows, centers : float64[T, 3, 3], float64[T, 3]
        Its matrix.
    tree : KdTree
    """

    name: str
    corners: np.ndarray
    first: np.ndarray
    sign: np.ndarray
    instance: np.ndarray
    prim: np.ndarray
    material: np.ndarray
    rows: np.ndarray
    centers: np.ndarray
    tree: object

    @cached_property
    def box(self):
        """float64[2, 3]: lower and upper bounds."""
        return np.array([self.corners.min(axis=(0, 1)), self.corners.max(axis=(0, 1))])


def color_words(materials):
    """uint32[M]: materials' colours, encoded, as simple shading reads them."""
    encoded = encode([material.base_color for material in materials])
    red, green, blue = np.rint(255 * encoded).astype(np.uint32).T
    return red << 16 | green << 8 | blue


def tree_over(lower, upper, *, fmt, cost, max_depth, triangles=None):
    """The chip's kd-tree over boxes of ``cost`` each; the rest as of :func:`~sim.scene.kdtree.build_kdtree`."""
    return build_kdtree(lower, upper, triangles=triangles, frac_width=fmt.frac_width, min_normal=fmt.min_normal,
                        pad=_PAD_ULP * 2.0 ** -fmt.frac_width, intersection_cost=cost, empty_bonus=_EMPTY_BONUS,
                        max_depth=max_depth)


def make_part(name, corners, instance, prim, material, normal_scale, *, fmt, stack_depth, warnings, solid):
    """A part of triangles in coordinates of order 1.

    Parameters
    ----------
    name : str
    corners : float64[T, 3, 3]
    instance, prim, material : int32[T]
        As of :class:`Part`.
    normal_scale : float
        See :func:`~sim.scene.triangles.unit_triangle_maps`.
    fmt : FloatFormat
    stack_depth : int
        Bound of its tree's depth.
    warnings : list of str
        Receives what was dropped.
    solid : bool[M]
        Materials whose sides do not differ: their triangles may face the other way.

    Returns
    -------
    Part or None
        None if no triangle is left.

    Raises
    ------
    SceneError
        If a triangle's matrix does not fit the format.
    """
    corners, first = turned(fmt.quantize(corners))
    rows, centers, usable = unit_triangle_maps(corners, normal_scale=normal_scale)
    if not usable.all():
        warnings.append(f"mesh '{name}': {np.count_nonzero(~usable)} triangles dropped that have no area once their "
                        f"vertices are rounded to format {fmt}")
    corners, first, instance, prim, material, rows, centers = (
        array[usable] for array in (corners, first, instance, prim, material, rows, centers))
    if not len(corners):
        return None
    sign = facing(corners, solid[material])
    rows[:, 2] *= sign[:, None]
    overflow = ~np.isfinite(fmt.quantize(rows)).all(axis=(1, 2))
    if overflow.any():
        worst = np.flatnonzero(overflow)[0]
        raise SceneError(f"mesh '{name}', triangle {prim[worst]}: its transform has values up to "
                         f"{np.abs(rows[worst]).max():.3g}, beyond {fmt.max:.3g}, the largest of format {fmt}; "
                         f"choose a format with more exponent bits ({overflow.sum()} such triangles)")
    tree = tree_over(corners.min(axis=1), corners.max(axis=1), triangles=corners, fmt=fmt, cost=_TRIANGLE_COST,
                     max_depth=stack_depth)
    return Part(name, corners, first, sign, instance, prim, material, rows, centers, tree)
