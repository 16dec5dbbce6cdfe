"""Whatever is in a file, its reader gives a scene or says what is wrong: no other exception, no endless work."""

import io
import random

import numpy as np
import pytest
from PIL import Image

from sim.golden.tables import lamps, looks, surfaces
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


def glb_with_looks():
    """Materials, pictures, lights, and all extensions that are drawn."""
    builder = Builder()
    picture = dict(bufferView=builder.view(png()), mimeType="image/png")
    glass = dict(KHR_materials_transmission=dict(transmissionFactor=0.5), KHR_materials_ior=dict(ior=1.4),
                 KHR_materials_volume=dict(thicknessFactor=1.0),
                 KHR_materials_emissive_strength=dict(emissiveStrength=2))
    builder.document.update(
        images=[picture], samplers=[dict(magFilter=9729, wrapS=33071)], textures=[dict(source=0, sampler=0)],
        extensionsUsed=["KHR_lights_punctual"],
        extensions=dict(KHR_lights_punctual=dict(lights=[
            dict(type="spot", color=[1, 0.5, 0], intensity=9.5, range=9, spot=dict(outerConeAngle=0.5))])),
        materials=[dict(alphaMode="MASK", alphaCutoff=0.25, emissiveFactor=[0, 0.5, 1], pbrMetallicRoughness=dict(
            baseColorFactor=[1, 1, 0, 0.5], metallicFactor=0.25, roughnessFactor=0.5,
            baseColorTexture=dict(index=0))), dict(extensions=glass)])
    for material in (0, 1):
        part = builder.triangle(material=material)
        part["attributes"]["TEXCOORD_0"] = builder.accessor([(0, 0), (1, 0), (0, 1)])
        builder.node(mesh=builder.mesh(part))
    builder.node(extensions=dict(KHR_lights_punctual=dict(light=0)), rotation=[0, 0, 0, 1])
    return builder.glb()


def png():
    file = io.BytesIO()
    Image.fromarray(np.random.default_rng(1).integers(0, 256, (8, 8, 4), dtype=np.uint8)).save(file, "PNG")
    return file.getvalue()


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
    ("a.obj", _OBJ), ("a.glb", glb()), ("b.glb", glb_with_looks()), ("ascii.ply", test_ply.ascii_file(test_ply.MIXED)),
    ("little.ply", test_ply.binary_file(test_ply.MIXED, "<")),
    ("big.ply", test_ply.binary_file(test_ply.TRIANGLES, ">"))], ids=("obj", "glb", "looks", "ascii", "little", "big"))
def test_damage_is_read_or_refused(tmp_path, name, data):
    rng = random.Random(name)
    num_read = num_refused = 0
    for _ in range(500):
        (tmp_path / name).write_bytes(damaged(data, rng))
        try:
            scene = load_scene(tmp_path / name)
            scene.at_time(0.5).default_camera()
            shading_tables(scene)
            num_read += 1
        except SceneError:
            num_refused += 1
    assert num_read > 10
    assert num_refused > 10


def shading_tables(scene):
    """What the shader reads has numbers only."""
    for table in (looks(scene.materials), surfaces(scene), lamps(scene.lights)):
        for values in table:
            assert not np.isnan(values).any()


_MTL = (b"newmtl m\nKd 0.5 0.25 1\nKs 1 0.5 0.5\nKe 0 0 0.5\nTf 1 0.9 0.8\nNs 37\nNi 1.5\nd 0.5\nillum 7\n"
        b"newmtl n\nmap_Kd -s 1 2 -o 0 t.png\nmap_d t.png\nTr 0.25\nbump -bm 1 t.png\n")


@pytest.mark.filterwarnings("ignore::RuntimeWarning")
@pytest.mark.parametrize("which", ["a.mtl", "t.png"])
def test_damage_beside_an_obj_is_read_or_refused(tmp_path, which):
    rng = random.Random(which)
    files = {"a.obj": b"mtllib a.mtl\nusemtl n\n" + _OBJ, "a.mtl": _MTL, "t.png": png()}
    for name, data in files.items():
        (tmp_path / name).write_bytes(data)
    num_read = num_refused = 0
    for _ in range(300):
        (tmp_path / which).write_bytes(damaged(files[which], rng))
        try:
            shading_tables(load_scene(tmp_path / "a.obj"))
            num_read += 1
        except SceneError:
            num_refused += 1
    assert num_read > 10
    assert num_refused > 10
