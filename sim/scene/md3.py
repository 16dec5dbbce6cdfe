"""Models of Quake III (MD3, version 15): surfaces in many poses (frames), and tags, where other models are joined on.

Coordinates are 16-bit numbers of 1/64 unit, normals two angles of 8 bits. Triangles wind clockwise in the file and are
turned, so that the front is where the normals point.
"""

from dataclasses import dataclass

import numpy as np

from .records import Records, text

__all__ = ["Md3", "Surface"]

_HEADER = np.dtype([("magic", "S4"), ("version", "<i4"), ("name", "S64"), ("flags", "<i4"), ("num_frames", "<i4"),
                    ("num_tags", "<i4"), ("num_surfaces", "<i4"), ("num_skins", "<i4"), ("frames", "<i4"),
                    ("tags", "<i4"), ("surfaces", "<i4"), ("end", "<i4")])
_SURFACE = np.dtype([("magic", "S4"), ("name", "S64"), ("flags", "<i4"), ("num_frames", "<i4"),
                     ("num_shaders", "<i4"), ("num_vertices", "<i4"), ("num_triangles", "<i4"), ("triangles", "<i4"),
                     ("shaders", "<i4"), ("uvs", "<i4"), ("vertices", "<i4"), ("end", "<i4")])
_SHADER = np.dtype([("name", "S64"), ("index", "<i4")])
_TAG = np.dtype([("name", "S64"), ("origin", "<f4", 3), ("axes", "<f4", (3, 3))])
_VERTEX = np.dtype([("position", "<i2", 3), ("zenith", "u1"), ("azimuth", "u1")])
_UNIT = 1 / 64
# The game's own bounds.
_MAX_SURFACES, _MAX_TAGS, _MAX_VERTICES, _MAX_TRIANGLES = 32, 16, 4096, 8192


@dataclass(frozen=True, eq=False)
class Surface:
    """A part of a model in one pose.

    Parameters
    ----------
    name : str
    shader : str
        Empty if the file names none.
    vertices, normals : float64[V, 3]
    uvs : float64[V, 2]
    triangles : int32[T, 3]
    """

    name: str
    shader: str
    vertices: np.ndarray
    normals: np.ndarray
    uvs: np.ndarray
    triangles: np.ndarray


class Md3:
    """A model.

    Parameters
    ----------
    data : bytes
    name : str
        What messages call the file.

    Raises
    ------
    SceneError
        If it is no MD3 of version 15, or has more parts than the game allows.
    """

    def __init__(self, data, name):
        self._file = Records(data, name)
        if data[:8] != b"IDP3\x0f\0\0\0":
            raise self._file.error("not a model of Quake III (MD3, version 15)")
        self._header = self._file.table("header", _HEADER, 0, 1)[0]
        self.num_frames = int(self._header["num_frames"])
        for key, most in (("num_surfaces", _MAX_SURFACES), ("num_tags", _MAX_TAGS)):
            if not 0 <= self._header[key] <= most:
                raise self._file.error(f"has {self._header[key]} {key.removeprefix('num_')}; at most {most} are read")

    def _check(self, frame):
        if not 0 <= frame < self.num_frames:
            raise self._file.error(f"has no frame {frame}; there are {self.num_frames}, numbered from 0")

    def tags(self, frame):
        """Transforms float64[3, 4] of the tags at a frame, by name: [A | b] takes what is joined on into the model.

        Axes are made of length 1, as in the game.

        Raises
        ------
        SceneError
            If there is no such frame, or a tag's axes have no direction.
        """
        self._check(frame)
        count, first = (int(self._header[key]) for key in ("num_tags", "tags"))
        rows = self._file.table("tags", _TAG, first + frame * count * _TAG.itemsize, count)
        axes, origins = rows["axes"].astype(np.float64), rows["origin"].astype(np.float64)
        lengths = np.linalg.norm(axes, axis=2, keepdims=True)
        names = [text(name) for name in rows["name"]]
        good = (lengths > 0).all(axis=(1, 2)) & np.isfinite(lengths).all(axis=(1, 2)) & np.isfinite(origins).all(axis=1)
        if not good.all():
            raise self._file.error(f"tag '{names[np.argmin(good)]}', frame {frame}: its axes or its origin are none")
        axes = (axes / lengths).swapaxes(1, 2)
        return dict(zip(names, np.concatenate([axes, origins[:, :, None]], axis=2), strict=True))

    def surfaces(self, frame):
        """List of :class:`Surface` at a frame.

        Raises
        ------
        SceneError
            If there is no such frame, or a surface reaches beyond the file or its own vertices.
        """
        self._check(frame)
        start, found = int(self._header["surfaces"]), []
        for number in range(int(self._header["num_surfaces"])):
            what = f"surface {number}"
            row = self._file.table(what, _SURFACE, start, 1)[0]
            if row["magic"] != b"IDP3" or row["num_frames"] != self.num_frames:
                raise self._file.error(f"{what}: is none, or has not the model's {self.num_frames} frames")
            found.append(self._surface(row, start, frame, what))
            start += int(row["end"])
        return found

    def _surface(self, row, start, frame, what):
        def table(key, dtype, count, skip=0):
            return self._file.table(f"{what}, {key}", dtype, start + int(row[key]) + skip, count)

        count = int(row["num_vertices"])
        if count > _MAX_VERTICES or row["num_triangles"] > _MAX_TRIANGLES:
            raise self._file.error(f"{what}: has {count} vertices and {row['num_triangles']} triangles; at most "
                                   f"{_MAX_VERTICES} and {_MAX_TRIANGLES} are read")
        vertices = table("vertices", _VERTEX, count, frame * count * _VERTEX.itemsize)
        triangles = table("triangles", ("<i4", 3), int(row["num_triangles"]))
        bad = (triangles < 0) | (triangles >= count)
        if bad.any():
            raise self._file.error(f"{what}: triangle {np.argwhere(bad)[0, 0]} uses vertex {triangles[bad][0]}; there "
                                   f"are {count}, numbered from 0")
        shaders = table("shaders", _SHADER, min(int(row["num_shaders"]), 1))
        zenith, azimuth = (2 * np.pi / 256 * vertices[key] for key in ("zenith", "azimuth"))
        normals = np.stack([np.cos(azimuth) * np.sin(zenith), np.sin(azimuth) * np.sin(zenith), np.cos(zenith)], axis=1)
        return Surface(text(row["name"]).lower(), text(shaders[0]["name"]) if len(shaders) else "",
                       vertices["position"] * _UNIT, normals,
                       np.nan_to_num(table("uvs", ("<f4", 2), count).astype(np.float64)), triangles[:, ::-1])
