"""Cases of traversal, through the chip's model: the compiler's image, kd-tree, stack and default test."""

from dataclasses import dataclass
from functools import cached_property

import numba
import numpy as np

from rtl.config import ChipConfig

from ..methods import Answers
from ..model.compiled import compiled
from ..model.packet import COUNTS, trace_packet
from ..scene.compile import CompiledScene
from .meshes import cube
from .probe import Probe, rounded_rays
from .truth import judge, scene_of

__all__ = ["ChipProbe", "deep_tree", "in_splitting_planes", "traversed"]

_MAILBOX, _TOLERANCE = ChipConfig().mailbox_entries, ChipConfig().edge_tolerance


@compiled(parallel=True)
def _trace(params, root, nodes, splits, lists, matrices, stack_depth, tolerance, origins, directions, owners,
           distances, whole):
    for packet in numba.prange(len(origins) // 4):
        hits, owner = np.empty((4, 4)), np.empty((4, 2), np.int64)
        first = 4 * packet
        whole[packet] = trace_packet(
            0, params, root, nodes, splits, lists, matrices, _MAILBOX, stack_depth, tolerance,
            origins[first:first + 4], directions[first:first + 4], 15, np.zeros((4, 2)), np.full((4, 2), -1, np.int64),
            np.zeros(4, np.int64), False, hits, owner, np.zeros(len(COUNTS), np.int64))
        for ray in range(4):
            owners[first + ray] = owner[ray]
            distances[first + ray] = hits[ray, 0] if owner[ray, 0] >= 0 else np.inf


@dataclass(frozen=True, eq=False)
class ChipProbe:
    """Rays through a compiled scene.

    Parameters
    ----------
    probe : Probe
        Triangles and rays in the chip's coordinates.
    image : SceneImage
    stack_depth : int
        Of the chip; a packet that needs more counts as a failure of its four rays.
    """

    probe: Probe
    image: object
    stack_depth: int = 32

    @property
    def num_rays(self):
        """Number of rays."""
        return self.probe.num_rays

    @cached_property
    def answers(self):
        """The chip's :class:`~sim.methods.Answers`."""
        image, probe = self.image, self.probe
        owners, distances = np.empty((self.num_rays, 2), np.int64), np.empty(self.num_rays)
        whole = np.zeros(self.num_rays // 4, np.bool_)
        _trace(image.fmt.params, image.root, image.nodes[:, 0].astype(np.int64), image.split_values(),
               image.lists.astype(np.int64), image.matrix_values(), self.stack_depth,
               _TOLERANCE * 2.0**-image.fmt.frac_width, probe.origins, probe.directions, owners, distances, whole)
        _, prim = image.owners(owners[:, 0], owners[:, 1])
        return Answers(distances, np.where(owners[:, 0] >= 0, prim, -1), np.repeat(~whole, 4))

    def verdict(self, method=None):
        """The :class:`~sim.stability.truth.Verdict` on the chip."""
        return judge(self.answers, self.probe.truth)


def _compiled(corners, origins, targets, fmt, rng, **options):
    scene = scene_of(corners)
    compiled_scene = CompiledScene(scene, fmt=fmt, **options)
    center, scale = compiled_scene.center, compiled_scene.scale
    origins, directions, _ = rounded_rays(fmt, (origins - center) * scale, (targets - center) * scale, rng)
    count = len(origins) // 4 * 4
    probe = Probe(fmt, fmt.quantize((corners - center) * scale), origins[:count], directions[:count])
    return ChipProbe(probe, compiled_scene.image(scene))


def traversed(probe_of, value, count, *, fmt, rng):
    """The rays of another case through the scene compiler and the chip's model."""
    probe = probe_of(value, count, fmt=fmt, rng=rng)
    return _compiled(probe.corners, probe.origins, probe.origins + probe.directions, fmt, rng)


def in_splitting_planes(value, count, *, fmt, rng):
    """Along the planes between the squares of a cube's faces, where a tree splits, ``value`` units off at most."""
    mesh = cube(8)
    axis, side = rng.integers(3, size=count), rng.choice((-1.0, 1.0), count)
    rows = np.arange(count)
    targets = np.rint(rng.uniform(-3.4, 3.4, (count, 3))) / 4
    targets += rng.integers(-value, value + 1, (count, 3)) * 2.0**-fmt.frac_width
    targets[rows, axis] = side
    origins = targets.copy()
    origins[rows, axis] = 3 * side
    return _compiled(mesh.corners, origins, targets, fmt, rng)


def deep_tree(value, count, *, fmt, rng):
    """Squares one behind the other towards a corner, each half as large as the one before: ``value`` of them."""
    sizes = 2.0 ** -np.arange(value)
    unit = np.array([[(0, 0, 0), (1, 0, 0), (1, 1, 0)], [(0, 0, 0), (1, 1, 0), (0, 1, 0)]], np.float64)
    corners = np.concatenate([size * (unit + (1, 1, 1)) for size in sizes])
    chosen = rng.integers(value, size=count)
    targets = sizes[chosen, None] * (1 + np.append(rng.uniform(0.05, 0.95, (count, 2)), np.zeros((count, 1)), axis=1))
    origins = targets + sizes[chosen, None] * np.array([0.0, 0.0, -0.3]) + rng.uniform(-1e-3, 1e-3, (count, 3))
    return _compiled(corners, origins, targets, fmt, rng)
