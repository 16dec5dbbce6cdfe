"""The scenes that are measured on, with their views."""

import json

from sim.scene import Camera, load_scene

__all__ = ["SCENES", "real_scenes"]

#: Name, file in the folder of scenes (none: built in), view in its cameras.json (none: the scene's own).
SCENES = (
    ("room", None, None),
    ("simple_room", "scene6_simple_room/simple_room.obj", "scene6"),
    ("bunny", "classic/stanford-bunny.obj", "bunny"),
    ("conference", "conference/conference.obj", "conference"),
    ("grande_salle", "office_laas_grande_salle/grande_salle.obj", "office"),
    ("quake3-oa_dm5", "openarena/quake3-oa_dm5.pk3", "quake3"),
    ("terrain", "terrain.glb", "terrain"),
)


def real_scenes(folder, *, only=(), scenes=SCENES):
    """Yields ``(name, scene, camera)`` of each of ``scenes``, or of those named ``only``.

    Parameters
    ----------
    folder : Path
        With the files and cameras.json.

    Raises
    ------
    SceneError
        If a file is missing or broken.
    """
    cameras = json.loads((folder / "cameras.json").read_text())
    for name, file, view in scenes:
        if only and name not in only:
            continue
        scene = load_scene(name if file is None else folder / file)
        if view is None:
            yield name, scene, scene.default_camera()
        else:
            numbers = cameras[view][0]
            yield name, scene, Camera(numbers["eye"], numbers["at"], numbers["up"], numbers["hfov_deg"])
