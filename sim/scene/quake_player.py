"""Models of Quake III as scenes, and players: lower body, upper body and head, joined at tags."""

from pathlib import Path

import numpy as np

from .error import SceneError
from .md3 import Md3
from .pk3 import Folder, read_text
from .quake_looks import QuakeLooks
from .scene import IDENTITY, Instance, Mesh, Scene

__all__ = ["Wardrobe", "has_player", "load_md3", "player_mesh", "player_scene"]

_FOLDER = "models/players"
# Of the lines of animation.cfg: what a player's legs begin with, its gesture, and how it stands.
_GESTURE, _TORSO_STAND, _LEGS, _LEGS_IDLE = 6, 11, 13, 22


class Wardrobe:
    """Materials by the names of surfaces' shaders, in the order of their first use.

    Parameters
    ----------
    archive : Archive or Folder
    """

    def __init__(self, archive):
        self.materials, self._looks, self._ids = [], QuakeLooks(archive), {}

    def warnings(self):
        """See :meth:`QuakeLooks.warnings`."""
        return self._looks.warnings()

    def wear(self, name):
        """``(number of the material, scale of texture coordinates)``, or None for what is not drawn."""
        if name not in self._ids:
            look = self._looks.material(name)
            self._ids[name] = look and (len(self.materials), look[1])
            self.materials += [look[0]] if look else []
        return self._ids[name]


def _skin(archive, path):
    """Shaders of surfaces, by name, from a .skin file: lines of surface, comma, picture."""
    if path not in archive:
        return {}
    lines = read_text(archive, path).lower().splitlines()
    pairs = (line.split(",", 1) for line in lines if "," in line)
    return {surface.strip(): picture.strip() for surface, picture in pairs if picture.strip()}


def _joined(name, parts, wardrobe):
    """The mesh of surfaces ``(surface, shader, transform)``."""
    vertices, triangles, ids, normals, uvs, count = [], [], [], [], [], 0
    for surface, shader, transform in parts:
        worn = wardrobe.wear(shader or surface.name)
        if worn is None:
            continue
        vertices.append(surface.vertices @ transform[:, :3].T + transform[:, 3])
        triangles.append(surface.triangles + count)
        ids.append(np.full(len(surface.triangles), worn[0], np.int32))
        normals.append((surface.normals @ transform[:, :3].T)[surface.triangles])
        uvs.append((surface.uvs * worn[1])[surface.triangles])
        count += len(surface.vertices)
    if not vertices:
        raise SceneError(f"{name}: has nothing to draw")
    return Mesh(name, np.concatenate(vertices), np.concatenate(triangles).astype(np.int32), np.concatenate(ids),
                normals=np.concatenate(normals), uvs=np.concatenate(uvs))


def has_player(archive, name):
    """True if an archive has a player of that name."""
    return bool(_levels(archive, name, "lower"))


def _levels(archive, name, part):
    """Levels of detail of a player's part, by number, as names of files; the finest is 0."""
    files = {0: f"{_FOLDER}/{name}/{part}.md3", **{level: f"{_FOLDER}/{name}/{part}_{level}.md3" for level in (1, 2)}}
    return {level: file for level, file in files.items() if file in archive}


def _standing(archive, name):
    """Frames ``(legs, torso)`` of a standing player, by animation.cfg; 0 where there is none.

    Legs count on from the torso's frames there, but their model has none of these.
    """
    path = f"{_FOLDER}/{name}/animation.cfg"
    if path not in archive:
        return 0, 0
    firsts = []
    for line in read_text(archive, path).splitlines():
        words = line.split("//", 1)[0].split()
        if len(words) == 4 and all(word.isascii() and word.isdecimal() and len(word) < 9 for word in words):
            firsts.append(int(words[0]))
    if len(firsts) <= _LEGS_IDLE:
        raise SceneError(f"{archive.path}: {path}: has {len(firsts)} lines of four numbers; a player has 25")
    return firsts[_LEGS_IDLE] - firsts[_LEGS] + firsts[_GESTURE], firsts[_TORSO_STAND]


def player_mesh(archive, name, wardrobe, *, level=0, legs=None, torso=None, joints=None, warnings=None):
    """The mesh of a player, its origin that of the legs.

    Parameters
    ----------
    archive : Archive or Folder
    name : str
    wardrobe : Wardrobe
        Receives its materials.
    level : int
        Of detail, 0 to 2; parts that have none of it take the nearest.
    legs, torso : int, optional
        Frames; those of a standing player if not given.
    joints : dict, optional
        Where ``tag_torso`` and ``tag_head`` are in models that lack these tags, (x, y, z).
    warnings : list of str, optional
        Receives a sentence for each tag that is nowhere; what is joined on there stands at the origin.

    Raises
    ------
    SceneError
        If a part is missing or damaged, or has no such frame.
    """
    stand = _standing(archive, name)
    frames = {"lower": stand[0] if legs is None else legs, "upper": stand[1] if torso is None else torso, "head": 0}
    transform, parts = np.eye(4), []
    for part, tag in (("lower", "tag_torso"), ("upper", "tag_head"), ("head", None)):
        levels = _levels(archive, name, part)
        if not levels:
            raise SceneError(f"{archive.path}: player '{name}' has no {_FOLDER}/{name}/{part}.md3")
        file = levels[min(levels, key=lambda number: abs(number - level))]
        model = Md3(archive.read(file), f"{archive.path}: {file}")
        skin = _skin(archive, f"{_FOLDER}/{name}/{part}_default.skin")
        parts += [(surface, skin.get(surface.name, surface.shader), transform[:3])
                  for surface in model.surfaces(frames[part])]
        if tag is None:
            continue
        tags = {**{key: np.column_stack([np.eye(3), place]) for key, place in (joints or {}).items()},
                **model.tags(frames[part])}
        if tag not in tags and warnings is not None:
            warnings.append(f"{file}: has no {tag}; what is joined on there stands at its origin")
        transform = transform @ np.vstack([tags.get(tag, IDENTITY), (0, 0, 0, 1)])
    return _joined(name, parts, wardrobe)


def player_scene(archive, name, *, level=0):
    """Scene of one player of an archive."""
    wardrobe, warnings = Wardrobe(archive), []
    mesh = player_mesh(archive, name, wardrobe, level=level, warnings=warnings)
    return Scene([mesh], [Instance(0, IDENTITY, name)], wardrobe.materials, warnings=warnings + wardrobe.warnings())


def load_md3(path, *, frame=0):
    """Scene of an MD3 file: one mesh, one instance.

    Pictures are looked for below the folder that has the file's folder ``models``, where there is one, else below the
    file's own; a surface's is that of NAME_default.skin beside the file, else that of the file.

    Parameters
    ----------
    path : path-like
    frame : int

    Raises
    ------
    SceneError
        If the file is damaged, or has no such frame.
    """
    path = Path(path)
    resolved = path.resolve()
    folders = [folder for folder in resolved.parents if folder.name.lower() == "models"]
    root = folders[0].parent if folders else resolved.parent
    archive = Folder(root)
    model = Md3(path.read_bytes(), str(path))
    stem = path.stem[:-2] if path.stem[-2:] in ("_1", "_2") else path.stem
    skin = _skin(archive, str(resolved.with_name(f"{stem}_default.skin").relative_to(root)))
    wardrobe = Wardrobe(archive)
    mesh = _joined(path.stem, [(surface, skin.get(surface.name, surface.shader), IDENTITY)
                               for surface in model.surfaces(frame)], wardrobe)
    return Scene([mesh], [Instance(0, IDENTITY, path.stem)], wardrobe.materials, warnings=wardrobe.warnings())
