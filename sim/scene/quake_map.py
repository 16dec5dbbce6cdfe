"""Maps of Quake III in game archives (.pk3), as scenes.

The lamps of these maps are in their light maps, which are not read: scenes have no lights and are lit from the eye.
"""

import math
import re

import numpy as np

from .bsp import Bsp
from .camera import Camera
from .entities import numbers, parse_entities
from .error import SceneError
from .pk3 import Archive
from .quake_looks import QuakeLooks
from .quake_player import has_player, player_scene
from .scene import Instance, Scene

__all__ = ["load_pk3", "map_scene", "split_name"]

_PATH = re.compile(r"(.*?\.pk3)(?::(.*))?", re.IGNORECASE | re.DOTALL)
_SPAWNS = ("info_player_deathmatch", "info_player_start")
# The game's own view: its eye above a player's origin, and its field of view.
_EYE_HEIGHT, _HFOV_DEG = 26.0, 90.0


def split_name(path):
    """``(file, name)`` of ``FILE.pk3`` or ``FILE.pk3:NAME``, name None in the former; None if it is neither."""
    match = _PATH.fullmatch(str(path))
    return match and match.groups()


def _map_names(archive):
    return [name.removeprefix("maps/").removesuffix(".bsp") for name in archive.names("maps", ".bsp")]


def _chosen(archive, path, name):
    names = _map_names(archive)
    if not names:
        raise SceneError(f"{path}: has no map (maps/*.bsp)")
    if name is None and len(names) > 1:
        raise SceneError(f"{path}: has the maps {', '.join(names)}; name one, as in {path}:{names[0]}")
    if name is not None and name.lower() not in names:
        raise SceneError(f"{path}: has no map '{name}'; there {'are' if len(names) > 1 else 'is'} {', '.join(names)}")
    return names[0] if name is None else name.lower()


def _cameras(entities, place):
    """A view from each place where players enter the game."""
    cameras = []
    for entity in entities:
        if entity.get("classname") in _SPAWNS:
            eye = np.add(numbers(entity, "origin", (0.0, 0.0, 0.0), place), (0.0, 0.0, _EYE_HEIGHT))
            yaw = math.radians(numbers(entity, "angle", (0.0,), place)[0])
            cameras.append(Camera(eye, eye + (math.cos(yaw), math.sin(yaw), 0.0), (0.0, 0.0, 1.0), _HFOV_DEG,
                                  f"{entity['classname']} {len(cameras)}"))
    return cameras


def _placed(entities, bsp, place):
    """``(model, name, origin)`` of the world and of each entity that has a model of the map and is seen."""
    yield 0, "world", (0.0, 0.0, 0.0)
    for entity in entities:
        model, kind = entity.get("model", ""), entity.get("classname", "")
        if not model.startswith("*") or kind.startswith("trigger_"):
            continue
        if not model[1:].isdecimal() or not 0 < int(model[1:9]) < bsp.num_models:
            raise SceneError(f"{place}: entity '{kind}': there is no model '{model[:9]}'; "
                             + (f"the map has *1 to *{bsp.num_models - 1}" if bsp.num_models > 1 else "it has none"))
        yield int(model[1:]), f"{model} {kind}", numbers(entity, "origin", (0.0, 0.0, 0.0), place)


def map_scene(archive, name, *, level=4):
    """``(scene, entities)`` of a map: the world, and an object for each entity that has a model of its own.

    Cameras are the places where players enter, in the order of the file.

    Parameters
    ----------
    archive : Archive
    name : str
        Without folder and ending.
    level : int
        Steps of a quadratic Bézier patch each way, at least 1.

    Raises
    ------
    SceneError
        If the map, or something that it names, is damaged.
    """
    file = f"maps/{name}.bsp"
    place = f"{archive.path}: {file}"
    bsp, looks = Bsp(archive.read(file), place, level=level), QuakeLooks(archive)
    entities = parse_entities(bsp.entities, place)
    materials, hidden = [], []
    ids, scales = np.zeros(len(bsp.textures), np.int32), np.ones((len(bsp.textures), 2))
    for number in bsp.drawn_textures():
        look = looks.material(bsp.textures[number])
        if look is None:
            hidden.append(number)
        else:
            ids[number], scales[number] = len(materials), look[1]
            materials.append(look[0])
    bsp.leave_out(hidden)
    meshes, instances, known = [], [], {}
    for model, title, origin in _placed(entities, bsp, place):
        if model not in known:
            mesh = bsp.mesh(model, f"{name} *{model}" if model else name, materials=ids, scales=scales)
            known[model] = None if mesh is None else len(meshes)
            meshes += [] if mesh is None else [mesh]
        if known[model] is not None:
            instances.append(Instance(known[model], np.column_stack([np.eye(3), origin]), title))
    return Scene(meshes, instances, materials, _cameras(entities, place), warnings=looks.warnings()), entities


def load_pk3(path, *, level=4):
    """Scene of a map in a game archive, or of a player.

    Parameters
    ----------
    path : path-like
        FILE.pk3 of one map, or FILE.pk3:MAP or FILE.pk3:PLAYER.
    level : int
        As of :func:`map_scene`.

    Raises
    ------
    SceneError
        If there is no such map or player, or it is damaged.
    """
    file, name = split_name(path)
    archive = Archive(file)
    if name is not None and f"maps/{name}.bsp" not in archive and has_player(archive, name):
        return player_scene(archive, name)
    return map_scene(archive, _chosen(archive, file, name), level=level)[0]
