"""Files of Quake III made by hand, for the tests of their readers."""

import io
import struct
import zipfile

import numpy as np
from PIL import Image

__all__ = ["bsp", "corners", "face", "md3", "picture", "pk3", "small_map", "small_player", "surface"]

_ENTITIES, _TEXTURES, _MODELS, _VERTICES, _MESHVERTS, _FACES = 0, 1, 7, 10, 11, 13


def corners(mesh):
    """The corners of a mesh's triangles."""
    return mesh.vertices[mesh.triangles]


def face(kind, *, texture=0, vertices=(0, 0), meshverts=(0, 0), size=(0, 0)):
    """A face: ``vertices`` and ``meshverts`` are first and number, ``size`` the control points of a patch."""
    return struct.pack("<26i", texture, -1, kind, *vertices, *meshverts, *[0] * 17, *size)


def bsp(*, textures, vertices, meshverts, faces, models, entities, magic=b"IBSP", version=46):
    """A map; vertices are position, texture coordinates and normal, models first face and number of faces."""
    lumps = [b""] * 17
    lumps[_ENTITIES] = entities.encode() + b"\0"
    lumps[_TEXTURES] = b"".join(struct.pack("<64sII", name.encode(), flags, 1) for name, flags in textures)
    lumps[_MODELS] = b"".join(struct.pack("<6f4i", *[0.0] * 6, *faces, 0, 0) for faces in models)
    lumps[_VERTICES] = b"".join(struct.pack("<3f2f2f3f4B", *position, *uv, 0, 0, *normal, 255, 255, 255, 255)
                                for position, uv, normal in vertices)
    lumps[_MESHVERTS] = struct.pack(f"<{len(meshverts)}i", *meshverts)
    lumps[_FACES] = b"".join(faces)
    directory, body = b"", b""
    for lump in lumps:
        body += b"\0" * (-len(body) % 4)
        directory += struct.pack("<ii", 8 + 17 * 8 + len(body), len(lump))
        body += lump
    return magic + struct.pack("<i", version) + directory + body


def surface(name, *, shader, frames, normals, uvs, triangles):
    """A surface of a model: ``frames`` are positions of the vertices, normals pairs of angles (zenith, azimuth)."""
    count, size = len(uvs), 108
    parts = [b"".join(struct.pack("<3i", *corner) for corner in triangles),
             struct.pack("<64si", shader.encode(), 0),
             b"".join(struct.pack("<2f", *uv) for uv in uvs),
             b"".join(struct.pack("<3h2B", *(round(64 * x) for x in position), *normal)
                      for frame in frames for position, normal in zip(frame, normals, strict=True))]
    starts = np.cumsum([size, *map(len, parts)]).tolist()
    return struct.pack("<4s64s10i", b"IDP3", name.encode(), 0, len(frames), 1, count, len(triangles),
                       *starts) + b"".join(parts)


def md3(surfaces, *, num_frames=1, tags=(), version=15):
    """A model; ``tags`` are a list of name, origin, axes for each frame."""
    frames = struct.pack("<10f16s", *[0.0] * 10, b"frame") * num_frames
    tag_data = b"".join(struct.pack("<64s12f", name.encode(), *origin, *np.ravel(axes))
                        for frame in tags for name, origin, axes in frame)
    body = b"".join(surfaces)
    first = 108 + len(frames)
    return struct.pack("<4si64s9i", b"IDP3", version, b"model", 0, num_frames, len(tags[0]) if tags else 0,
                       len(surfaces), 0, 108, first, first + len(tag_data),
                       first + len(tag_data) + len(body)) + frames + tag_data + body


def picture(color, form="TGA", size=(4, 4)):
    """An image file of one colour, of three or four channels."""
    file = io.BytesIO()
    Image.new("RGBA" if len(color) == 4 else "RGB", size, tuple(color)).save(file, form)
    return file.getvalue()


def pk3(files, *, method=zipfile.ZIP_DEFLATED):
    """An archive, from bytes by name."""
    file = io.BytesIO()
    with zipfile.ZipFile(file, "w", method) as archive:
        for name, data in files.items():
            archive.writestr(zipfile.ZipInfo(name), data, method)
    return file.getvalue()


UP = (0, 0, 1)
SQUARE = [((0, 0, 0), (0, 0), UP), ((8, 0, 0), (2, 0), UP), ((8, 8, 0), (2, 2), UP), ((0, 8, 0), (0, 2), UP)]
PATCH = [((8 * i, 8 * j, 4 * (i == j == 1)), (i / 2, j / 2), UP) for j in range(3) for i in range(3)]
ENTITIES = ('{ "classname" "worldspawn" }\n{ "classname" "info_player_start" "origin" "4 4 2" "angle" "90" }\n'
            '{ "classname" "func_door" "model" "*1" "origin" "0 0 16" }\n{ "classname" "trigger_once" "model" "*1" }\n')


def small_map(**changes):
    """The parts of a map for :func:`bsp`: a square, a triangle, a patch, a billboard, two not drawn; a door."""
    square = dict(vertices=(0, 4), meshverts=(0, 6))
    return dict(
        textures=[("textures/a/floor", 0), ("textures/a/veil", 0), ("textures/a/sky", 4), ("textures/a/no", 0x80)],
        vertices=SQUARE + PATCH, meshverts=[0, 2, 1, 0, 3, 2],
        faces=[face(1, **square), face(3, texture=1, vertices=(0, 4), meshverts=(3, 3)),
               face(2, vertices=(4, 9), size=(3, 3)), face(4), face(1, texture=2, **square),
               face(1, texture=3, **square), face(1, texture=1, **square)],
        models=[(0, 6), (6, 1)], entities=ENTITIES) | changes


CORNERS = [(0, 0, 0), (1, 0, 0), (0, 1, 0)]
UPRIGHT = ((1, 0, 0), (0, 1, 0), (0, 0, 1))


def small_player():
    """Files of a player: three triangles, the upper body turned by 90° about z and raised by 2, the head by 1."""
    def part(name, *tags, num_frames=1):
        frames = [[(x, y, z + frame) for x, y, z in CORNERS] for frame in range(num_frames)]
        return md3([surface(name, shader="models/players/toy/skin.tga", frames=frames, normals=[(0, 0)] * 3,
                            uvs=[(0, 0), (1, 0), (0, 1)], triangles=[(0, 2, 1)])], num_frames=num_frames,
                   tags=[[(tag, (0, 0, height + frame), axes) for tag, height, axes in tags]
                         for frame in range(num_frames)])

    folder = "models/players/toy/"
    return {folder + "lower.md3": part("l_legs", ("tag_torso", 2, ((0, 2, 0), (-2, 0, 0), (0, 0, 2))), num_frames=3),
            folder + "upper.md3": part("u_torso", ("tag_head", 1, UPRIGHT), num_frames=2),
            folder + "head.md3": part("h_head"),
            folder + "head_default.skin": b"h_head,models/players/toy/face.tga\ntag_head,\n",
            folder + "skin.tga": picture((200, 0, 0)), folder + "face.tga": picture((0, 200, 0))}
