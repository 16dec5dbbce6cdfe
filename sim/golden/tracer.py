"""The golden ray tracer's front: scenes and rays in, hits out."""

import weakref
from dataclasses import dataclass, fields
from typing import NamedTuple

import numpy as np

from .bvh import Bvh, build_bvh
from .kernel import trace_rays

__all__ = ["Geometry", "Hits", "render", "scene_geometry", "trace"]

# A mesh never changes, so its hierarchy is built once for all frames and calls.
_mesh_bvhs = weakref.WeakKeyDictionary()


@dataclass(frozen=True, eq=False)
class Hits:
    """Closest hits, one per ray; all arrays have the shape of the rays.

    Parameters
    ----------
    instance_id, prim_id : int32
        What was hit; −1 on a miss.
    t : float64
        Distance in units of the direction; inf on a miss.
    u, v : float64
        The point hit is (1−u−v)·v0 + u·v1 + v·v2; 0 on a miss.
    dot : float64
        (A⁻¹·D)·N with A the instance's 3×3 and N the triangle's unit normal in object space, along
        (v1−v0)×(v2−v0); 0 on a miss.
    """

    instance_id: np.ndarray
    prim_id: np.ndarray
    t: np.ndarray
    u: np.ndarray
    v: np.ndarray
    dot: np.ndarray

    @property
    def is_hit(self):
        """bool, true where a triangle was hit."""
        return self.prim_id >= 0

    def reshape(self, *shape):
        """The same hits in another shape."""
        return Hits(*(getattr(self, field.name).reshape(shape) for field in fields(self)))


def _mesh_bvh(mesh):
    if mesh not in _mesh_bvhs:
        corners = np.ascontiguousarray(mesh.vertices[mesh.triangles])
        _mesh_bvhs[mesh] = corners, build_bvh(corners.min(axis=1), corners.max(axis=1), mesh.usable)
    return _mesh_bvhs[mesh]


def _world_boxes(scene):
    """Boxes round the instances' boxes' corners, widened for the rounding of rays into object space."""
    lower, upper = np.empty((2, len(scene.instances), 3))
    for i, instance in enumerate(scene.instances):
        box = np.array(scene.meshes[instance.mesh].bounds())
        corners = np.take_along_axis(box, np.indices((2, 2, 2)).reshape(3, 8).T, axis=0)
        if np.isfinite(corners).all():
            corners = corners @ instance.transform[:, :3].T + instance.transform[:, 3]
        slack = 1e-12 * np.abs(corners).max()
        lower[i], upper[i] = corners.min(axis=0) - slack, corners.max(axis=0) + slack
    return lower, upper


def _unit_normals(corners):
    """Unit normals along (v1−v0)×(v2−v0) of triangles float64[N, 3, 3]."""
    edges = corners[:, 1:] - corners[:, :1]
    # Scaled first, so that products of tiny or huge edges stay within the format.
    edges /= np.abs(edges).max(axis=(1, 2), keepdims=True)
    normals = np.cross(edges[:, 0], edges[:, 1])
    return normals / np.linalg.norm(normals, axis=1, keepdims=True)


class Geometry(NamedTuple):
    """A scene's triangles and hierarchies as :func:`sim.golden.kernel.trace_rays` takes them."""

    top: Bvh
    inverses: np.ndarray
    bases: np.ndarray
    nodes: Bvh
    corners: np.ndarray


def scene_geometry(scene):
    """Geometry of a scene; the meshes' hierarchies are kept for the next frame."""
    corners, bvhs = zip(*map(_mesh_bvh, scene.meshes), strict=True)
    sizes = [(len(bvh.first), len(bvh.items), len(c)) for bvh, c in zip(bvhs, corners, strict=True)]
    mesh_of = np.array([instance.mesh for instance in scene.instances])
    bases = np.cumsum([(0, 0, 0), *sizes], axis=0)[mesh_of]
    corners, nodes = np.concatenate(corners), Bvh(*map(np.concatenate, zip(*bvhs, strict=True)))
    lower, upper = _world_boxes(scene)
    top = build_bvh(lower, upper, (lower <= upper).all(axis=1))
    maps = np.tile(np.eye(4), (len(scene.instances), 1, 1))
    maps[:, :3] = [instance.transform for instance in scene.instances]
    inverses = np.ascontiguousarray(np.linalg.inv(maps)[:, :3])
    return Geometry(top, inverses, bases, nodes, corners)


def trace(scene, origins, directions, t_min=0.0, *, exclude=None):
    """Closest hit of each ray at t > ``t_min``; ties go to the lowest (instance_id, prim_id).

    Triangles are two-sided. Unusable ones (:func:`sim.scene.check.usable_triangles`) are never hit. A ray
    that meets a shared edge or vertex of a closed mesh always hits one of its triangles.

    Parameters
    ----------
    scene : Scene
    origins, directions : float64[..., 3]
        Rays, broadcast against each other; directions of any length.
    t_min : float
    exclude : pair of int arrays, optional
        instance_id and prim_id of a triangle that each ray ignores, −1 for none; of the rays' shape.

    Returns
    -------
    Hits
    """
    origins, directions = np.broadcast_arrays(np.asarray(origins, np.float64), np.asarray(directions, np.float64))
    shape = origins.shape[:-1]
    origins, directions = (np.ascontiguousarray(rays.reshape(-1, 3)) for rays in (origins, directions))
    n = len(origins)
    if exclude is None:
        exclude = (-1, -1)
    excluded = np.ascontiguousarray(np.stack([np.broadcast_to(i, shape).reshape(n) for i in exclude]), np.int32)

    geometry = scene_geometry(scene)
    ids, distances = np.empty((2, n), np.int32), np.empty((3, n))
    trace_rays(origins, directions, float(t_min), excluded, *geometry, ids, distances)
    dot, hit = np.zeros(n), ids[1] >= 0
    normals = _unit_normals(geometry.corners[geometry.bases[ids[0, hit], 2] + ids[1, hit]])
    dot[hit] = np.einsum("ni,nij,nj->n", normals, geometry.inverses[ids[0, hit], :, :3], directions[hit])
    return Hits(*ids, *distances, dot).reshape(*shape)


def render(scene, camera, width, height, *, shift=(0.0, 0.0)):
    """Closest hits of a camera's rays through the centres of width × height pixels, as [height, width] arrays."""
    return trace(scene, *camera.rays(width, height, shift=shift))
