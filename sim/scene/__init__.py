"""Scenes: file formats in, spatial index out."""

from .loader import load_scene
from .scene import Camera, Instance, Material, Mesh, Scene, SceneError

__all__ = ["Camera", "Instance", "Material", "Mesh", "Scene", "SceneError", "load_scene"]
