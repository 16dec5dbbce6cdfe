"""Scenes: file formats in, spatial index out."""

from .light import Light
from .loader import load_scene
from .material import Material
from .scene import Camera, Instance, Mesh, Scene, SceneError
from .sky import Sky
from .texture import Texture

__all__ = ["Camera", "Instance", "Light", "Material", "Mesh", "Scene", "SceneError", "Sky", "Texture", "load_scene"]
