"""Damaged files of Quake III through their readers.

    python -m tests.sim.scene.quake_damage --count 10000
"""

import random
import resource
import tempfile
import time
import warnings
import zipfile
from pathlib import Path

import click

from sim.scene import SceneError, load_scene

from .quake_builder import bsp, md3, picture, pk3, small_map, small_player, surface
from .test_damaged_files import damaged, shading_tables

__all__ = ["FORMATS", "try_damage"]

_NUMBERS = (0, 1, 2, 3, 0x7F, 0xFF, 0x7FFF, 0xFFFF, 1 << 24, 1 << 30, 0x7FFFFFFF, 0x80000000, 0xFFFFFFFF, 0x7F800000,
            0x7FC00000, 0xFF7FFFFF)
_SCRIPT = (b"textures/a/veil\n{\n\tcull none // both\n\t{\n\t\tmap textures/a/veil.tga\n\t\tblendfunc blend\n"
           b"\t\ttcmod scale 2 2\n\t}\n}\ntextures/a/floor { deformVertexes wave { animmap 1 textures/a/veil.tga } }\n")
_PICTURES = {"textures/a/veil.tga": picture((1, 2, 3, 128)), "textures/a/floor.png": picture((9, 8, 7), "PNG", (3, 5))}
_CONFIG = b"".join(b"%d\t1 0 15\n" % first for first in [0] * 22 + [2, 1, 1])


def _map(**changes):
    return {"maps/small.bsp": bsp(**small_map()), "scripts/a.shader": _SCRIPT, **_PICTURES} | changes


def _player():
    return small_player() | {"models/players/toy/animation.cfg": _CONFIG}


def damaged_numbers(data, rng):
    """``data`` with one to three of its 32-bit numbers replaced: by an odd one, a neighbour, another of the file."""
    data = bytearray(data)
    for _ in range(rng.choice((1, 1, 2, 3))):
        place, other = (4 * rng.randrange(len(data) // 4) for _ in range(2))
        old = int.from_bytes(data[place:place + 4], "little")
        new = rng.choice((rng.choice(_NUMBERS), old + rng.choice((-4, -1, 1, 4)), rng.getrandbits(32),
                          int.from_bytes(data[other:other + 4], "little")))
        data[place:place + 4] = (new % (1 << 32)).to_bytes(4, "little")
    return bytes(data)


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
# Bytes of address space within which all has to be read, the libraries' own among them.
_MEMORY = 3 << 30
#: Of each kind of damage: the scene to load, its file, and a function from a random generator to the file's bytes.
FORMATS = {
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


def try_damage(kind, count, folder):
    """``(read, refused, seconds of the slowest)`` of ``count`` damaged files of a kind; any other exception is let out.

    A failure is repeated by its number, which alone seeds it.
    """
    scene_name, file, make = FORMATS[kind]
    num_read = num_refused = slowest = 0
    for number in range(count):
        (folder / file).write_bytes(make(random.Random(f"{kind} {number}")))
        begin = time.perf_counter()
        try:
            scene = load_scene(f"{folder}/{scene_name}")
            scene.default_camera()
            shading_tables(scene)
            num_read += 1
        except SceneError as error:
            if not str(error).startswith(f"{folder}/{file}"):
                raise AssertionError(f"{kind} {number}: the file is not named: {error}") from error
            num_refused += 1
        except Exception as error:
            raise AssertionError(f"{kind} {number}: {type(error).__name__}: {error}") from error
        slowest = max(slowest, time.perf_counter() - begin)
    return num_read, num_refused, slowest


@click.command()
@click.option("--count", type=click.IntRange(min=1), default=10_000, show_default=True, help="Files of each kind")
@click.option("--only", multiple=True, type=click.Choice(list(FORMATS)), help="Only this kind")
def main(count, only):
    """Read damaged files of each kind, and say how many were read, refused, and how long the slowest took."""
    warnings.simplefilter("ignore", RuntimeWarning)
    resource.setrlimit(resource.RLIMIT_AS, (_MEMORY, _MEMORY))
    with tempfile.TemporaryDirectory() as folder:
        for kind in only or FORMATS:
            num_read, num_refused, slowest = try_damage(kind, count, Path(folder))
            click.echo(f"{kind}: {num_read} read, {num_refused} refused, the slowest {slowest:.2f} s")


if __name__ == "__main__":
    main()
