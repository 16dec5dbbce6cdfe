"""The scene in memory: meshes, their instances, materials, lights, cameras and motion."""

import math
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np

from .camera import Camera
from .check import usable_triangles
from .error import SceneError
from .light import MAX_LIGHTS, Light
from .material import DEFAULT_MATERIAL, Material
from .normals import corner_normals
from .sky import Sky
from .texture import Texture

__all__ = ["DEFAULT_MATERIAL", "IDENTITY", "Camera", "Instance", "Light", "Material", "Mesh", "Scene", "SceneError",
           "Sky", "Texture"]

IDENTITY = np.eye(3, 4)

# Condition number from which the inverse of a 3×3 in float64 has no correct bit left.
_MAX_CONDITION = 1e14


@dataclass(frozen=True, eq=False)
class Mesh:
    """Triangles in object space; a triangle's number in its mesh is its ``prim_id``.

    Parameters
    ----------
    name : str
    vertices : float64[V, 3]
    triangles : int32[T, 3]
        Indices of the corners v0, v1, v2.
    material_ids : int32[T]
        Indices into the scene's materials.
    normals : float64[T, 3, 3], optional
        Shading normal of each corner, in object space.
    uvs : float64[T, 3, 2], optional
        Texture coordinates of each corner.
    """

    name: str
    vertices: np.ndarray
    triangles: np.ndarray
    material_ids: np.ndarray
    normals: np.ndarray | None = None
    uvs: np.ndarray | None = None

    @property
    def num_triangles(self):
        """Number of triangles, unusable ones included."""
        return len(self.triangles)

    @cached_property
    def usable(self):
        """bool[T], see :func:`sim.scene.check.usable_triangles`."""
        return usable_triangles(self)

    @cached_property
    def shading_normals(self):
        """float64[T, 3, 3] or None, see :func:`sim.scene.normals.corner_normals`."""
        return corner_normals(self)

    @cached_property
    def _bounds(self):
        corners = self.vertices[self.triangles[self.usable]].reshape(-1, 3)
        if not len(corners):
            return np.full(3, math.inf), np.full(3, -math.inf)
        return corners.min(axis=0), corners.max(axis=0)

    def bounds(self):
        """``(lower, upper)`` float64[3] of the usable triangles; (inf, −inf) if there are none."""
        return self._bounds


@dataclass(frozen=True, eq=False)
class Instance:
    """A mesh placed in the world by a transform; its index in the scene is its ``instance_id``.

    Parameters
    ----------
    mesh : int
        Index into the scene's meshes.
    transform : float64[3, 4]
        Maps object space to world space: [A | b], X ↦ A·X + b.
    name : str
    """

    mesh: int
    transform: np.ndarray
    name: str

    def to_world(self, points):
        """float64[…, 3]: where points of object space are in the world."""
        return points @ self.transform[:, :3].T + self.transform[:, 3]


@dataclass(frozen=True, eq=False)
class Scene:
    """Everything that is needed to render: meshes, instances, materials, cameras, motion, lights and sky.

    Parameters
    ----------
    meshes : list of Mesh
    instances : list of Instance
        Nodes that carry a mesh, in file order.
    materials : list of Material
    cameras : list of Camera
    animation : Animation, optional
        Motion of the instances, cameras and lights.
    warnings : list of str
        What was odd in the file and how it was taken.
    lights : list of Light
        At most 256; a scene without any is lit from the camera.
    sky : Sky, optional
        What rays see that meet nothing, in place of a background colour.
    ambient : tuple of 3 floats
        Light that reaches every surface from everywhere, linear RGB.

    Raises
    ------
    SceneError
        If nothing in the scene can be hit, an instance's transform has no inverse, or there are too many lights.
    """

    meshes: list[Mesh]
    instances: list[Instance]
    materials: list[Material]
    cameras: list[Camera] = field(default_factory=list)
    animation: object | None = None
    warnings: list[str] = field(default_factory=list)
    lights: list[Light] = field(default_factory=list)
    sky: Sky | None = None
    ambient: tuple[float, float, float] = (0.0, 0.0, 0.0)

    def __post_init__(self):
        if len(self.lights) > MAX_LIGHTS:
            raise SceneError(f"scene has {len(self.lights)} lights; the shader has room for {MAX_LIGHTS}; "
                             "leave some out")
        transforms = np.array([instance.transform for instance in self.instances]).reshape(-1, 3, 4)
        finite = np.isfinite(transforms).all(axis=(1, 2))
        regular, linear = finite.copy(), transforms[finite, :, :3]
        regular[finite] = (np.linalg.matrix_rank(linear) == 3) & ~(np.linalg.cond(linear) > _MAX_CONDITION)
        if not regular.all():
            number = int(np.argmin(regular))
            what = ("is singular (flattens the mesh); give it a non-zero scale on every axis" if finite[number] else
                    "has a value that is not finite")
            raise SceneError(f"node '{self.instances[number].name}' (instance {number}): transform {what}")
        if not any(self.meshes[instance.mesh].usable.any() for instance in self.instances):
            raise SceneError("scene is empty: no instance has a usable triangle")

    @property
    def num_triangles(self):
        """Number of triangles that rays can meet, every instance counted."""
        return sum(self.meshes[instance.mesh].num_triangles for instance in self.instances)

    @property
    def num_stored_triangles(self):
        """Number of triangles in memory, each mesh counted once."""
        return sum(mesh.num_triangles for mesh in self.meshes)

    def bounds(self):
        """``(lower, upper)`` float64[3], world space, of the corners of the instances' boxes."""
        boxes = np.array([mesh.bounds() for mesh in self.meshes])
        shown = [instance for instance in self.instances if np.isfinite(boxes[instance.mesh]).all()]
        transforms = np.array([instance.transform for instance in shown])
        which = np.indices((2, 2, 2)).reshape(1, 3, 8).swapaxes(1, 2)
        corners = np.take_along_axis(boxes[[instance.mesh for instance in shown]], which, axis=1)
        corners = corners @ transforms[:, :, :3].swapaxes(1, 2) + transforms[:, None, :, 3]
        return corners.min(axis=(0, 1)), corners.max(axis=(0, 1))

    def default_camera(self):
        """First camera of the file, else a view of the whole scene from above one corner.

        The up axis is z where the scene is clearly flattest along z (rooms, landscapes), else y (objects).
        """
        if self.cameras:
            return self.cameras[0]
        lower, upper = self.bounds()
        extent = upper - lower
        z_up = extent[2] < 0.7 * extent[:2].min()
        up = np.array([0.0, 0.0, 1.0] if z_up else [0.0, 1.0, 0.0])
        towards_eye = np.array([0.6, -1.0, 0.6] if z_up else [0.6, 0.6, 1.0])
        hfov_deg = 60.0
        center, radius = (lower + upper) / 2, np.linalg.norm(extent) / 2
        # 0.75: the sphere has to fit the height of a 4:3 picture too.
        distance = radius / math.sin(math.atan(0.75 * math.tan(math.radians(hfov_deg / 2))))
        eye = center + towards_eye / np.linalg.norm(towards_eye) * distance
        return Camera(eye, center, up, hfov_deg, "whole scene")

    @property
    def is_animated(self):
        """True if something in the scene moves."""
        return self.animation is not None

    @property
    def duration(self):
        """Time of the last key frame, in seconds; 0 for a still scene."""
        return self.animation.duration if self.is_animated else 0.0

    def at_time(self, t, *, move=None):
        """The same scene with instances, cameras and lights where they are at time ``t``, in seconds.

        Times outside the key frames take the nearest one's value. Meshes are shared, not copied.

        Parameters
        ----------
        t : float
        move : callable, optional
            ``move(number, instance, t)`` is asked where each :class:`Instance` is, which it gets as the key frames have
            it: float64[3, 4], or None for there. So still scenes move too, if they are compiled with
            ``flatten=False``::

                def swing(number, instance, t):
                    if instance.name == "door":
                        c, s = np.cos(t), np.sin(t)
                        return instance.transform @ [[c, -s, 0, 0], [s, c, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]]

                posed = scene.at_time(0.5, move=swing)

        Raises
        ------
        SceneError
            If a transform is singular at that time, or what ``move`` returns is none.
        """
        posed = self
        if self.is_animated:
            transforms, cameras, lights = self.animation.pose(t)
            instances = [replace(instance, transform=transform)
                         for instance, transform in zip(self.instances, transforms, strict=True)]
            posed = replace(self, instances=instances, cameras=cameras, lights=lights or self.lights)
        if move is None:
            return posed
        return replace(posed, instances=[_moved(number, instance, move(number, instance, t))
                                         for number, instance in enumerate(posed.instances)])


def _moved(number, instance, transform):
    if transform is None:
        return instance
    try:
        transform = np.array(transform, np.float64)
        if transform.shape != (3, 4):
            raise ValueError(f"of shape {transform.shape}")
    except (TypeError, ValueError) as error:
        raise SceneError(f"node '{instance.name}' (instance {number}): what moves it must return a 3×4 matrix [A | b] "
                         f"or None: {error}") from error
    return replace(instance, transform=transform)
