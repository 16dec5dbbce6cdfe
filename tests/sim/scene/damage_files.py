"""Damage to files of the common formats: OBJ with MTL and pictures, PLY, glTF."""

import copy
import gzip
import io
import json

import numpy as np
from PIL import Image

from . import test_ply
from .gltf_builder import Builder

__all__ = ["FILES", "damaged", "damaged_numbers"]

_NUMBERS = (0, 1, 2, 3, 0x7F, 0xFF, 0x7FFF, 0xFFFF, 1 << 24, 1 << 30, 0x7FFFFFFF, 0x80000000, 0xFFFFFFFF, 0x7F800000,
            0x7FC00000, 0xFF7FFFFF)
_OBJ = (b"o x\nv 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 1\nvn 0 0 1\nusemtl r\nf 1/1/1 2/1/1 3/1/1\nf 1 2 -1\n"
        b"f 1//1 2//1 \\\n 3//1 1//1\n")
_WORDS = (b"nan", b"inf", b"-1", b"0", b"99999999999999999999", b"1e999", b"/", b"{}", b"[]", b"null", b"true", b"\n",
          b" ", b"\xff", b"\0", b'"', b"2.5")


def _small():
    builder = Builder()
    builder.node(mesh=builder.mesh(dict(builder.triangle(), indices=builder.scalars([0, 1, 2], "H"))))
    builder.document["cameras"] = [dict(type="perspective", perspective=dict(yfov=1.0))]
    builder.node(camera=0, translation=[1, 2, 3])
    builder.animate(0, "rotation", [0, 1], [(0, 0, 0, 1), (0, 1, 0, 0)])
    return builder


def _looks():
    """Materials, pictures, lights, and all extensions that are drawn."""
    builder = Builder()
    picture = dict(bufferView=builder.view(_png()), mimeType="image/png")
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
    return builder


def _png():
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


#: What takes a number's or a word's place in text.
_ODD_WORDS = (b"0", b"-1", b"1", b"2", b"3", b"4", b"255", b"65536", b"16777216", b"2147483647", b"4294967296", b"1e30",
              b"1e-30", b"9" * 40, b"9" * 5000, b"list", b"double", b"char", b"uint", b"int8", b"\\", b"-1/2/3", b"//",
              b"a.mtl", b"../a", b"o", b"f", b"v", b"usemtl", b"face", b"vertex", b"ascii", b"1.0")


def _damaged_words(data, rng):
    """Text with one to three words or lines replaced, left out, repeated or changed about."""
    lines = [line.split(b" ") for line in data.split(b"\n")]
    for _ in range(rng.choice((1, 1, 2, 3))):
        row, other = rng.randrange(len(lines)), rng.randrange(len(lines))
        match rng.randrange(6):
            case 0 | 1 | 2:
                words = lines[row] = list(lines[row])
                words[rng.randrange(len(words))] = rng.choice((rng.choice(_ODD_WORDS), rng.choice(lines[other])))
            case 3:
                del lines[row]
            case 4:
                lines[row:row] = rng.choice((1, 1, 50)) * [lines[other]]
            case 5:
                lines[row], lines[other] = lines[other], lines[row]
        lines = lines or [[b""]]
    return b"\n".join(b" ".join(line) for line in lines)


def _text(data):
    return lambda rng: _damaged_words(data, rng) if rng.randrange(2) else damaged(data, rng)


def _ply(data):
    """Damage to the header's words, the body's numbers, or any bytes."""
    size = data.index(b"end_header\n") + len(b"end_header\n")

    def make(rng):
        match rng.randrange(4):
            case 0:
                return _damaged_words(data[:size], rng) + data[size:]
            case 1:
                return data[:size] + damaged_numbers(data[size:], rng)
            case 2:
                return data[:rng.randrange(len(data))]
        return damaged(data, rng)
    return make


def _compressed(rng):
    """Damage inside, outside, or a body that unpacks to much more than the file."""
    data = test_ply.binary_file(test_ply.MIXED, "<")
    match rng.randrange(5):
        case 0:
            return gzip.compress(_ply(data)(rng), 1)
        case 1:
            return damaged(gzip.compress(data, 1), rng)
        case 2:
            return gzip.compress(data.replace(b"face 2", b"face %d" % rng.getrandbits(24)) + bytes(rng.getrandbits(24)),
                                 9)
        case 3:
            return gzip.compress(data)[:rng.randrange(1, 90)]
    return gzip.compress(data) + damaged(gzip.compress(data), rng)


#: What takes a value's place in JSON.
_ODD_VALUES = (None, True, -1, 0, 1, 2, 3, 5, 255, 5121, 5123, 5125, 5126, 1 << 24, 1 << 31, 1 << 64, 10**400, 0.5,
               -1e300, 1e-300, "", "x", "VEC3", "SCALAR", "../a", "data:;base64,AAAA", [], {}, [0, 0, 0], [1e30] * 4,
               [[0]])


def _places(value):
    """Every (object or list, key) in JSON."""
    for key, part in value.items() if isinstance(value, dict) else enumerate(value):
        yield value, key
        if isinstance(part, (dict, list)):
            yield from _places(part)


def _damaged_document(document, rng):
    """JSON with one to three values replaced, left out or repeated."""
    document = copy.deepcopy(document)
    for _ in range(rng.choice((1, 1, 2, 3))):
        places = list(_places(document))
        if not places:
            break
        within, key = rng.choice(places)
        other, name = rng.choice(places)
        match rng.randrange(5):
            case 0 | 1:
                within[key] = copy.deepcopy(rng.choice(_ODD_VALUES))
            case 2:
                within[key] = copy.deepcopy(other[name])
            case 3:
                del within[key]
            case 4 if isinstance(within, list):
                within.extend(copy.deepcopy(within[key]) for _ in range(rng.choice((1, 30))))
    return document


def _glb(builder):
    def make(rng):
        changed = copy.copy(builder)
        match rng.randrange(5):
            case 0:
                return damaged(builder.glb(), rng)
            case 1:
                changed.binary = damaged_numbers(builder.binary, rng)
            case 2:
                return damaged_numbers(builder.glb(), rng)
            case _:
                changed.document = _damaged_document(builder.document, rng)
        return changed.glb()
    return make


def _gltf(builder):
    document = copy.deepcopy(builder.document)
    document["buffers"][0]["uri"] = "a.bin"

    def make(rng):
        if rng.randrange(4):
            return json.dumps(_damaged_document(document, rng)).encode()
        return damaged(json.dumps(document).encode(), rng)
    return make


_MTL = (b"newmtl m\nKd 0.5 0.25 1\nKs 1 0.5 0.5\nKe 0 0 0.5\nTf 1 0.9 0.8\nNs 37\nNi 1.5\nd 0.5\nillum 7\n"
        b"newmtl n\nmap_Kd -s 1 2 -o 0 t.png\nmap_d t.png\nTr 0.25\nbump -bm 1 t.png\n")
_TEXTURED = b"mtllib a.mtl\nusemtl n\n" + _OBJ
_BESIDE = {"a.obj": _TEXTURED, "a.mtl": _MTL, "t.png": _png()}
_PLY = {"ascii": test_ply.ascii_file(test_ply.MIXED), "little": test_ply.binary_file(test_ply.MIXED, "<"),
        "big": test_ply.binary_file(test_ply.TRIANGLES, ">")}
#: Of each kind of damage: the scene to load, the damaged file, a function from a random generator to its bytes, and
#: what lies beside it.
FILES = {
    "obj": ("a.obj", "a.obj", _text(_TEXTURED), _BESIDE),
    "mtl": ("a.obj", "a.mtl", _text(_MTL), _BESIDE),
    "picture": ("a.obj", "t.png", lambda rng: damaged(_png(), rng), _BESIDE),
    **{f"ply, {name}": ("a.ply", "a.ply", _ply(data), {}) for name, data in _PLY.items()},
    "ply.gz": ("a.ply.gz", "a.ply.gz", _compressed, {}),
    "gltf": ("a.gltf", "a.gltf", _gltf(_looks()), {"a.bin": _looks().binary}),
    "glb": ("a.glb", "a.glb", _glb(_small()), {}),
    "glb, looks": ("a.glb", "a.glb", _glb(_looks()), {}),
}
