"""Whatever is in a file, its reader gives a scene or says what is wrong: no other exception, no endless work."""

import random

import pytest

from sim.scene import SceneError, load_scene

from . import test_ply
from .gltf_builder import Builder

_OBJ = (b"o x\nv 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 1\nvn 0 0 1\nusemtl r\nf 1/1/1 2/1/1 3/1/1\nf 1 2 -1\n"
        b"f 1//1 2//1 \\\n 3//1 1//1\n")
_WORDS = (b"nan", b"inf", b"-1", b"0", b"99999999999999999999", b"1e999", b"/", b"{}", b"[]", b"null", b"true", b"\n",
          b" ", b"\xff", b"\0", b'"', b"2.5")


def glb():
    builder = Builder()
    builder.node(mesh=builder.mesh(dict(builder.triangle(), indices=builder.scalars([0, 1, 2], "H"))))
    builder.document["cameras"] = [dict(type="perspective", perspective=dict(yfov=1.0))]
    builder.node(camera=0, translation=[1, 2, 3])
    builder.animate(0, "rotation", [0, 1], [(0, 0, 0, 1), (0, 1, 0, 0)])
    return builder.glb()


def damaged(data, rng):
    """``data`` with one or two places overwritten, cut out, replaced by an odd word or repeated."""
    data = bytearray(data)
    for _ in range(rng.choice((1, 1, 2))):
        place, other = rng.randrange(len(data)), rng.randrange(len(data))
        match rng.randrange(4):
            case 0:
                data[place] = rng.randrange(256)
            case 1:
                del data[place:place + rng.randrange(1, 5)]
            case 2:
                data[place:place + rng.randrange(4)] = rng.choice(_WORDS)
            case 3:
                data[place:place] = data[other:other + rng.randrange(1, 20)]
    return bytes(data)


@pytest.mark.filterwarnings("ignore::RuntimeWarning")
@pytest.mark.parametrize(("name", "data"), [
    ("a.obj", _OBJ), ("a.glb", glb()), ("ascii.ply", test_ply.ascii_file(test_ply.MIXED)),
    ("little.ply", test_ply.binary_file(test_ply.MIXED, "<")),
    ("big.ply", test_ply.binary_file(test_ply.TRIANGLES, ">"))], ids=("obj", "glb", "ascii", "little", "big"))
def test_damage_is_read_or_refused(tmp_path, name, data):
    rng = random.Random(name)
    num_read = num_refused = 0
    for _ in range(500):
        (tmp_path / name).write_bytes(damaged(data, rng))
        try:
            scene = load_scene(tmp_path / name)
            scene.at_time(0.5).default_camera()
            num_read += 1
        except SceneError:
            num_refused += 1
    assert num_read > 10
    assert num_refused > 10
