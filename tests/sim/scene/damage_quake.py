"""Damage to files of Quake III: maps, players, scripts, archives."""

import zipfile

from .damage_files import damaged, damaged_numbers
from .quake_builder import bsp, md3, picture, pk3, small_map, small_player, surface

__all__ = ["QUAKE"]

_SCRIPT = (b"textures/a/veil\n{\n\tcull none // both\n\t{\n\t\tmap textures/a/veil.tga\n\t\tblendfunc blend\n"
           b"\t\ttcmod scale 2 2\n\t}\n}\ntextures/a/floor { deformVertexes wave { animmap 1 textures/a/veil.tga } }\n")
_PICTURES = {"textures/a/veil.tga": picture((1, 2, 3, 128)), "textures/a/floor.png": picture((9, 8, 7), "PNG", (3, 5))}
_CONFIG = b"".join(b"%d\t1 0 15\n" % first for first in [0] * 22 + [2, 1, 1])


def _map(**changes):
    return {"maps/small.bsp": bsp(**small_map()), "scripts/a.shader": _SCRIPT, **_PICTURES} | changes


def _player():
    return small_player() | {"models/players/toy/animation.cfg": _CONFIG}


def _damaged_binary(data, rng):
    match rng.randrange(8):
        case 0:
            return damaged(data, rng)
        case 1:
            return data[:rng.randrange(len(data))]
        case 2:
            # The header and what it points to.
            return damaged_numbers(data[:200], rng) + data[200:]
    return damaged_numbers(data, rng)


def _damaged_member(files, rng, choose, damage):
    name = rng.choice([name for name in files if choose(name)])
    return pk3(files | {name: damage(files[name], rng)}, method=zipfile.ZIP_STORED)


def _is_text(name):
    return name.endswith((".shader", ".cfg", ".skin"))


def _entities(rng):
    entities = damaged(small_map()["entities"].encode(), rng).decode("latin-1")
    return pk3(_map(**{"maps/small.bsp": bsp(**small_map(entities=entities.encode("ascii", "replace").decode()))}))


_MODEL = md3([surface(name, shader="x", frames=[[(0, 0, 0), (1, 0, 0), (0, 1, 0)]] * 2, normals=[(1, 2)] * 3,
                      uvs=[(0, 0)] * 3, triangles=[(0, 1, 2)]) for name in "ab"], num_frames=2)
#: Of each kind of damage: the scene to load, its file, and a function from a random generator to the file's bytes.
QUAKE = {
    "bsp": ("a.pk3", "a.pk3", lambda rng: _damaged_member(_map(), rng, lambda name: name.endswith("bsp"),
                                                          _damaged_binary)),
    "entities": ("a.pk3", "a.pk3", _entities),
    "pictures": ("a.pk3", "a.pk3", lambda rng: _damaged_member(_map(), rng, lambda name: name.startswith("textures"),
                                                               damaged)),
    "scripts": ("a.pk3", "a.pk3", lambda rng: _damaged_member(_map(), rng, _is_text, damaged)),
    "pk3": ("a.pk3", "a.pk3", lambda rng: damaged(pk3(_map()), rng)),
    "md3": ("a.md3", "a.md3", lambda rng: _damaged_binary(_MODEL, rng)),
    "player": ("a.pk3:toy", "a.pk3", lambda rng: _damaged_member(_player(), rng, lambda name: name.endswith("md3"),
                                                                 _damaged_binary)),
    "wardrobe": ("a.pk3:toy", "a.pk3", lambda rng: _damaged_member(_player(), rng, _is_text, damaged)),
}
