"""The top level of a moving scene: where its instances are in a frame, and the tree over them."""

import math
from dataclasses import dataclass

import numpy as np

from .error import SceneError
from .parts import INSTANCE_COST, tree_over

__all__ = ["TopLevel", "top_level", "unit_box"]


def unit_box(lower, upper, *, center=None):
    """Center, by default the box's, and the power of two that brings the box within [−1, 1]; so scaling is exact."""
    if center is None:
        center = (lower + upper) / 2
    half = float(np.max(np.maximum(upper - center, center - lower)))
    return center, 2.0 ** -math.ceil(math.log2(half)) if half > 0 else 1.0


@dataclass(frozen=True, eq=False)
class TopLevel:
    """A frame's instances.

    Parameters
    ----------
    center : float64[3]
    scale : float
        The chip's scene coordinates are (world − center) · scale.
    maps : float64[I, 4, 3]
        Each instance's matrix from the scene's space into its mesh's: rows and C, in the chip's format.
    tree : KdTree
        Over the instances' boxes.
    is_cut : bool
        It is shallower than it would be with more room.
    """

    center: np.ndarray
    scale: float
    maps: np.ndarray
    tree: object
    is_cut: bool

    @property
    def num_nodes(self):
        """Nodes in memory, an even number."""
        return len(self.tree.axis) + len(self.tree.axis) % 2

    @property
    def num_entries(self):
        """List entries."""
        return len(self.tree.items)


def top_level(scene, *, shown, boxes, spaces, fmt, max_depth, center=None, room=None):
    """The top level of a scene as it stands.

    Instances are off by units in the last place of their distance from the center; if that is the eye, all by the same
    angle, as the eye sees them.

    Parameters
    ----------
    scene : Scene
    shown : list of int
        Its instances that have anything to be hit.
    boxes : list of float64[2, 3]
        Bounds of each mesh in its own space on the chip.
    spaces : list of (float64[3], float)
        Center and scale of each mesh's own space.
    fmt : FloatFormat
    max_depth : int
        Bound of the tree's depth.
    center : float64[3], optional
        Origin of the chip's scene coordinates, by default the scene's middle.
    room : (int, int), optional
        Nodes and list entries that the tree must not exceed, at least 2 and the number of instances: where it would, it
        is kept shallower, at the cost of rays that visit more instances than they need to.

    Returns
    -------
    TopLevel

    Raises
    ------
    SceneError
        If an instance's transform does not fit the format.
    """
    center, scale = unit_box(*scene.bounds(), center=center)
    placed = [scene.instances[number] for number in shown]
    meshes = [instance.mesh for instance in placed]
    transforms = np.array([instance.transform for instance in placed])
    mesh_centers, mesh_scales = (np.array([spaces[mesh][k] for mesh in meshes]) for k in (0, 1))
    linear = transforms[:, :, :3]
    middles = ((linear @ mesh_centers[..., None])[..., 0] + transforms[:, :, 3] - center) * scale
    inverses = np.linalg.inv(linear) * (mesh_scales / scale)[:, None, None]
    maps = fmt.quantize(np.concatenate([inverses, middles[:, None]], axis=1))
    fits = np.isfinite(maps).all(axis=(1, 2))
    fits[fits] = np.linalg.matrix_rank(maps[fits, :3]) == 3
    if not fits.all():
        name = placed[int(np.argmin(fits))].name
        raise SceneError(f"instance '{name}': its transform does not fit format {fmt}, whose values "
                         f"are from {fmt.min_normal:.3g} to {fmt.max:.3g}; choose a format with more exponent "
                         "bits, or scale the instance less")
    # The chip's map is the rounded one, so the box is that of its inverse.
    which = np.indices((2, 2, 2)).reshape(1, 3, 8).swapaxes(1, 2)
    corners = np.take_along_axis(np.array([boxes[mesh] for mesh in meshes]), which, axis=1)
    world = corners @ np.linalg.inv(maps[:, :3]).swapaxes(1, 2) + maps[:, 3:]
    # What the transformed ray is off by in the mesh's space, seen from the scene's.
    slack = 4 * 2.0 ** -fmt.frac_width * np.abs(world - maps[:, 3:]).max(axis=(1, 2))[:, None]
    bounds = np.stack([world.min(axis=1) - slack, world.max(axis=1) + slack], axis=1)
    is_cut = False
    while True:
        tree = tree_over(bounds[:, 0], bounds[:, 1], fmt=fmt, cost=INSTANCE_COST, max_depth=max_depth)
        found = TopLevel(center, scale, maps, tree, is_cut)
        if room is None or (found.num_nodes <= room[0] and found.num_entries <= room[1]):
            return found
        # In the end a leaf at the root, which always fits.
        is_cut, max_depth = True, tree.max_depth // 2
