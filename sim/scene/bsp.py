"""Maps of Quake III (IBSP, version 46): their surfaces as meshes.

Surfaces are flat polygons and models (triangle lists by way of mesh vertices) and quadratic Bézier patches; billboards
are left out, and so is what the game does not draw. Light maps and vertex colours are not read. The game's polygons
wind clockwise; here they are turned, so that the front is where the stored normals point.
"""

import numpy as np

from .patches import grid_triangles, tessellate
from .pk3 import MAX_TEXT
from .records import Records, text
from .scene import Mesh

__all__ = ["Bsp"]

_LUMPS = dict(entities=0, textures=1, models=7, vertices=10, meshverts=11, faces=13)
_TEXTURE = np.dtype([("name", "S64"), ("flags", "<u4"), ("contents", "<u4")])
_MODEL = np.dtype([("bounds", "<f4", 6), ("first_face", "<i4"), ("num_faces", "<i4"), ("brushes", "<i4", 2)])
_VERTEX = np.dtype([("position", "<f4", 3), ("uv", "<f4", 2), ("light_uv", "<f4", 2), ("normal", "<f4", 3),
                    ("color", "u1", 4)])
_FACE = np.dtype([("texture", "<i4"), ("effect", "<i4"), ("kind", "<i4"), ("first_vertex", "<i4"),
                  ("num_vertices", "<i4"), ("first_meshvert", "<i4"), ("num_meshverts", "<i4"), ("light", "<i4", 17),
                  ("width", "<i4"), ("height", "<i4")])
_POLYGON, _PATCH, _MODEL_FACE, _BILLBOARD = 1, 2, 3, 4
# Of a texture's flags: the sky; and NODRAW, HINT, SKIP.
_SKY, _NOT_DRAWN = 0x4, 0x380
_MAX_SIDE = 129
# Faces may share vertices: a small file must not claim the machine's memory. The largest maps have a tenth of this.
_MAX_TRIANGLES = 1 << 20


class Bsp:
    """A map, its surfaces checked.

    Parameters
    ----------
    data : bytes
    name : str
        What messages call the file.
    level : int
        Steps of a quadratic patch each way.

    Members
    -------
    entities : str
    textures : list of str
        Names of the surfaces' shaders.
    num_models : int
        Model 0 is the world, the others are those of entities.

    Raises
    ------
    SceneError
        If a part of the file is not where it should be, or refers to something that is not there.
    """

    def __init__(self, data, name, *, level=4):
        self._file, self._level = Records(data, name), level
        if data[:8] != b"IBSP\x2e\0\0\0":
            raise self._file.error("not a map of Quake III (IBSP, version 46)")
        self._lumps = self._file.table("directory", ("<i4", 2), 8, 17)
        entities = self._lump("entities", "u1")
        if len(entities) > MAX_TEXT:
            raise self._file.error(f"entities: {len(entities):,} bytes; at most {MAX_TEXT:,} are read")
        self.entities = text(entities)
        textures = self._lump("textures", _TEXTURE)
        self.textures = [text(raw).lower() for raw in textures["name"]]
        self._vertices, self._meshverts = self._lump("vertices", _VERTEX), self._lump("meshverts", "<i4")
        self._models = self._lump("models", _MODEL)
        self.num_models = len(self._models)
        self._faces = self._lump("faces", _FACE)
        self._check_models()
        self._num_triangles = self._check_faces(textures["flags"])

    def _lump(self, what, dtype):
        offset, length = self._lumps[_LUMPS[what]].tolist()
        size = np.dtype(dtype).itemsize
        if length % size:
            raise self._file.error(f"{what}: {length} bytes are no whole number of {size}")
        return self._file.table(what, dtype, offset, length // size)

    def _check_models(self):
        first, count = (self._models[key].astype(np.int64) for key in ("first_face", "num_faces"))
        bad = (first < 0) | (count < 0) | (first + count > len(self._faces))
        if not len(bad):
            raise self._file.error("has no models, not even the world")
        if bad.any():
            raise self._file.error(f"model {np.argmax(bad)}: its faces are not all among {len(self._faces)}")
        if count.sum() > len(self._faces):
            raise self._file.error(f"models share faces: they have {count.sum()} of {len(self._faces)}")

    def _check_faces(self, flags):
        """Triangles of each face, int64[F]; 0 for those that are not drawn."""
        f = {key: self._faces[key].astype(np.int64) for key in _FACE.names if key != "light"}
        kind = f["kind"]

        def require(good, what):
            if not good.all():
                raise self._file.error(f"face {np.argmin(good)}: {what}")

        require((kind >= _POLYGON) & (kind <= _BILLBOARD), "its kind is none of 1 to 4")
        require((f["texture"] >= 0) & (f["texture"] < len(flags)), f"its texture is none of {len(flags)}")
        is_list, is_patch = (kind == _POLYGON) | (kind == _MODEL_FACE), kind == _PATCH
        first, count, total = f["first_vertex"], f["num_vertices"], len(self._vertices)
        require((kind == _BILLBOARD) | ((first >= 0) & (count >= 0) & (first + count <= total)),
                f"its vertices are not all among {total}")
        first, count, total = f["first_meshvert"], f["num_meshverts"], len(self._meshverts)
        require(~is_list | ((first >= 0) & (count >= 0) & (first + count <= total)),
                f"its mesh vertices are not all among {total}")
        require(~is_list | (count % 3 == 0), "its mesh vertices are no whole number of triangles")
        width, height = f["width"], f["height"]
        require(~is_patch | ((width % 2 == 1) & (height % 2 == 1) & (np.minimum(width, height) >= 3)
                             & (np.maximum(width, height) <= _MAX_SIDE)),
                f"a patch needs an odd number of control points each way, 3 to {_MAX_SIDE}")
        require(~is_patch | (width * height == f["num_vertices"]), "a patch needs as many vertices as control points")
        drawn = flags[f["texture"]] & (_SKY | _NOT_DRAWN) == 0
        steps = self._level * self._level
        triangles = np.where(is_list, count // 3, np.where(is_patch, (width - 1) * (height - 1) // 2 * steps, 0))
        triangles = np.where(drawn, triangles, 0)
        if triangles.sum() > _MAX_TRIANGLES:
            raise self._file.error(f"has {triangles.sum():,} triangles; at most {_MAX_TRIANGLES:,} are read")
        return triangles

    def drawn_textures(self):
        """Numbers of the textures that something to draw has."""
        return np.unique(self._faces["texture"][self._num_triangles > 0]).tolist()

    def leave_out(self, textures):
        """Draw nothing that has one of these textures."""
        self._num_triangles[np.isin(self._faces["texture"], textures)] = 0

    def mesh(self, number, name, *, materials, scales):
        """The mesh of a model, its triangles in the order of its faces.

        Parameters
        ----------
        number : int
        name : str
        materials : int32[textures]
            Of each texture.
        scales : float64[textures, 2]
            Factors of the texture coordinates, of each texture.

        Returns
        -------
        Mesh or None
            None if it has nothing to draw.

        Raises
        ------
        SceneError
            If a mesh vertex is none of its face's.
        """
        first, count = (int(self._models[key][number]) for key in ("first_face", "num_faces"))
        faces = np.arange(first, first + count)
        faces = faces[self._num_triangles[faces] > 0]
        total = int(self._num_triangles[faces].sum())
        if not total:
            return None
        parts = [self._lists(faces), *self._patches(faces)]
        owner, position, normal, uv = (np.concatenate(arrays) for arrays in zip(*parts, strict=True))
        order = np.argsort(owner, kind="stable")
        owner, normal, uv = owner[order], normal[order], np.nan_to_num(uv[order])
        texture = self._faces["texture"][owner]
        corners = np.arange(3 * total, dtype=np.int32).reshape(total, 3)
        return Mesh(name, position[order].reshape(-1, 3), corners, materials[texture], normals=normal,
                    uvs=uv * scales[texture][:, None])

    def _lists(self, faces):
        """(face, positions, normals, uvs) of the triangles of all polygons and models among the faces."""
        faces = faces[self._faces["kind"][faces] != _PATCH]
        rows = self._faces[faces]
        per_face = rows["num_meshverts"].astype(np.int64)
        step = np.arange(per_face.sum()) - np.repeat(np.cumsum(per_face) - per_face, per_face)
        corner = self._meshverts[np.repeat(rows["first_meshvert"], per_face) + step].astype(np.int64)
        owner = np.repeat(faces, per_face)
        bad = (corner < 0) | (corner >= self._faces["num_vertices"][owner])
        if bad.any():
            k = np.argmax(bad)
            raise self._file.error(f"face {owner[k]}: mesh vertex {corner[k]} is none of its "
                                   f"{self._faces['num_vertices'][owner[k]]} vertices")
        index = (self._faces["first_vertex"][owner] + corner).reshape(-1, 3)[:, ::-1]
        vertices = self._vertices
        return (owner[::3], *(vertices[key][index].astype(np.float64) for key in ("position", "normal", "uv")))

    def _patches(self, faces):
        """The same of the patches among the faces, those of one size at a time."""
        faces = faces[self._faces["kind"][faces] == _PATCH]
        sizes = np.stack([self._faces["height"][faces], self._faces["width"][faces]], axis=1)
        for height, width in np.unique(sizes, axis=0).tolist():
            mine = faces[(sizes == (height, width)).all(axis=1)]
            index = self._faces["first_vertex"][mine][:, None] + np.arange(height * width)
            control = np.concatenate([self._vertices[key][index] for key in ("position", "normal", "uv")], axis=2)
            points = tessellate(control.reshape(len(mine), height, width, 8).astype(np.float64), self._level)
            triangles = grid_triangles(*points.shape[1:3])
            corners = points.reshape(len(mine), -1, 8)[:, triangles].reshape(-1, 3, 8)
            yield np.repeat(mine, len(triangles)), corners[..., :3], corners[..., 3:6], corners[..., 6:]
