"""A built-in scene: the room of :mod:`sim.scene.room` with the sun in its window, a lamp, a mirror and a glass ball."""

from dataclasses import replace

import numpy as np

from .camera import Camera
from .light import Light
from .material import Material
from .normals import smooth_normals
from .patterns import blend, noise, planks, texture
from .room import room_scene
from .scene import Instance, Mesh, Scene
from .shapes import ball, box, box_uvs, joined, sheet
from .sky import Sky

__all__ = ["SUN", "furnished_room", "mirror_room_scene"]

#: Into which the sun shines: through the window at y = 6, onto table and floor.
SUN = np.array((-0.22, -1.0, -0.47))

_ROUND = ("brass", "glaze")


def _looks():
    """The room's materials with textures and gloss, by name."""
    grain = noise(256, cells=6, octaves=5, seed=3)
    weave = noise(256, cells=64, octaves=1, seed=4)
    rug = blend(weave, (0.40, 0.06, 0.05), (0.62, 0.14, 0.11))
    stripe = (np.arange(256) // 32) % 4 == 0
    rug[stripe] = blend(weave[stripe], (0.65, 0.50, 0.28), (0.80, 0.66, 0.42))
    return {
        "parquet": dict(base_color=(1.0, 1.0, 1.0), specular=0.25, shininess=64, reflection=0.06, fresnel=True,
                        texture=planks("parquet", (0.16, 0.075, 0.03), (0.50, 0.29, 0.14))),
        "plaster": dict(base_color=(1.0, 1.0, 1.0),
                        texture=texture("plaster", blend(grain, (0.68, 0.64, 0.56), (0.80, 0.77, 0.69)))),
        "oak": dict(base_color=(1.0, 1.0, 1.0), specular=0.15, shininess=32,
                    texture=planks("oak", (0.30, 0.17, 0.07), (0.58, 0.38, 0.19), rows=4, columns=1, seed=5)),
        "rug": dict(base_color=(1.0, 1.0, 1.0), texture=texture("rug", rug)),
        "blue lacquer": dict(specular=0.4, shininess=64, reflection=0.05, fresnel=True),
        "brass": dict(specular=0.7, shininess=64, reflection=0.55, tinted=True),
        "glaze": dict(specular=0.6, shininess=128, reflection=0.06, fresnel=True),
        "canvas": dict(base_color=(0.75, 0.35, 0.15)),
        "orange": dict(specular=0.2, shininess=16),
    }


def furnished_room():
    """``(mesh, materials)`` of the room with an open window, textures, and normals on round things."""
    room = room_scene()
    (mesh,) = room.meshes
    names = np.array([material.name for material in room.materials])
    keeps = names[mesh.material_ids] != "sky"
    triangles, material_ids = mesh.triangles[keeps], mesh.material_ids[keeps]
    corners = mesh.vertices[triangles]
    round_things = np.isin(names[material_ids], _ROUND)
    normals = np.where(round_things[:, None, None], smooth_normals(mesh.vertices, triangles, crease_deg=60), 0.0)
    looks = _looks()
    materials = [replace(material, **looks.get(material.name, {})) for material in room.materials]
    uvs = box_uvs(corners, size=1.2)
    return Mesh("room", mesh.vertices, triangles, material_ids, normals=normals, uvs=uvs), materials


def mirror_room_scene():
    """The scene ``mirror-room``: two lights, a mirror on the wall and a glass ball on the table."""
    room, materials = furnished_room()
    first = len(materials)
    materials += [Material("mirror", (0.94, 0.96, 0.95), reflection=1.0, tinted=True),
                  Material("frame", (0.22, 0.11, 0.05), specular=0.4, shininess=32),
                  Material("glass", (0.97, 0.99, 0.98), specular=0.9, shininess=512, reflection=0.04, fresnel=True,
                           transmission=1.0, ior=1.5),
                  Material("steel", (0.80, 0.80, 0.82), specular=0.8, shininess=256, reflection=1.0, tinted=True),
                  Material("bulb", (1.0, 1.0, 1.0), emission=(1.0, 0.85, 0.6))]
    mirror, frame, glass, steel, bulb = range(first, first + 5)
    # It hangs over the sideboard, in front of the picture.
    low, high = np.array((0.002, 2.05, 1.08)), np.array((0.06, 3.95, 2.30))
    hung = joined("mirror", [
        (box(low, (high[0], low[1] + 0.07, high[2])), frame), (box((low[0], high[1] - 0.07, low[2]), high), frame),
        (box(low + (0, 0.06, 0), (0.059, high[1] - 0.06, low[2] + 0.07)), frame),
        (box((low[0], low[1] + 0.06, high[2] - 0.07), (0.059, high[1] - 0.06, high[2])), frame),
        (sheet(low + (0.043, 0.05, 0.05), (0, 1.8, 0), (0, 0, 1.12)), mirror)])
    meshes = [room, hung, joined("glass ball", [(ball((0, 0, 0), 0.17, num_rings=48), glass)]),
              joined("steel ball", [(ball((0, 0, 0), 0.12, num_rings=32), steel)]),
              joined("bulb", [(ball((0, 0, 0), 0.035, num_rings=12), bulb)])]
    places = ((0, 0, 0), (0, 0, 0), (2.62, 2.42, 0.7415 + 0.17), (2.15, 2.55, 0.7415 + 0.12), (2.5, 3.0, 1.87))
    instances = [Instance(number, np.column_stack([np.eye(3), place]), mesh.name)
                 for number, (mesh, place) in enumerate(zip(meshes, places, strict=True))]
    lights = [Light("point", color=(1.0, 0.80, 0.55), intensity=0.9, position=(2.5, 3.0, 1.80), radius=0.15,
                    name="lamp"),
              Light("directional", color=(1.0, 0.93, 0.80), intensity=2.8, direction=SUN, name="sun")]
    sky = Sky.gradient(zenith=(0.12, 0.28, 0.68), horizon=(0.62, 0.78, 0.92), ground=(0.12, 0.16, 0.07), sun=-SUN)
    camera = Camera((4.55, 0.55, 1.70), (1.45, 3.75, 0.95), (0.0, 0.0, 1.0), 68.0, "corner")
    close = Camera((3.35, 1.75, 1.25), (2.35, 2.75, 0.85), (0.0, 0.0, 1.0), 50.0, "glass ball")
    return Scene(meshes, instances, materials, [camera, close], lights=lights, sky=sky, ambient=(0.30, 0.30, 0.31))
