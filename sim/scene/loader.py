"""From a file's name to a scene."""

from dataclasses import replace
from pathlib import Path

from .check import unusable_warnings
from .error import SceneError
from .gltf import load_gltf
from .mirror_room import mirror_room_scene
from .obj import load_obj
from .ply import load_ply
from .quake_map import load_pk3, split_name
from .quake_player import load_md3
from .room import room_scene
from .sunflowers import sunflowers_scene
from .vpl import vpl_scene
from .walk import walk_scene

__all__ = ["BUILT_IN", "load_scene"]

#: Scenes made in code, by name.
BUILT_IN = {"room": room_scene, "mirror-room": mirror_room_scene, "vpl": vpl_scene, "walk": walk_scene,
            "sunflowers": sunflowers_scene}

_LOADERS = {".obj": load_obj, ".ply": load_ply, ".ply.gz": load_ply, ".gltf": load_gltf, ".glb": load_gltf,
            ".md3": load_md3}


def load_scene(path):
    """Scene from a file, by the extension of its name.

    Parameters
    ----------
    path : str or path-like
        A file ending in .obj, .ply, .ply.gz, .gltf, .glb, .md3 or .pk3 (FILE.pk3:MAP where it has several maps),
        or a name in :data:`BUILT_IN`.

    Raises
    ------
    SceneError
        If the file is missing, of an unknown format, or broken.
    """
    path = Path(path)
    if str(path) in BUILT_IN:
        return BUILT_IN[str(path)]()
    archive = split_name(path)
    loader = load_pk3 if archive else next(
        (load for suffix, load in _LOADERS.items() if path.name.lower().endswith(suffix)), None)
    if loader is None:
        raise SceneError(f"{path}: unknown scene format; supported are {', '.join(_LOADERS)}, .pk3 and the built-in "
                         f"scenes {', '.join(BUILT_IN)}")
    file = archive[0] if archive else str(path)
    try:
        scene = loader(path)
    except OSError as error:
        raise SceneError(f"{file}: {error.strerror or error}") from error
    except SceneError as error:
        if str(error).startswith(file):
            raise
        raise SceneError(f"{file}: {error}") from error
    return replace(scene, warnings=scene.warnings + unusable_warnings(scene.meshes))
