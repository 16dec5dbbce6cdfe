"""Stanford PLY: ascii and binary, plain or gzip-compressed, polygons as fans, vertex colours and normals."""

import gzip
import io
import zlib
from collections import Counter
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from .error import SceneError
from .scene import DEFAULT_MATERIAL, IDENTITY, Instance, Material, Mesh, Scene

__all__ = ["load_ply"]

_TYPES = {"char": "i1", "int8": "i1", "uchar": "u1", "uint8": "u1", "short": "i2", "int16": "i2", "ushort": "u2",
          "uint16": "u2", "int": "i4", "int32": "i4", "uint": "u4", "uint32": "u4", "float": "f4", "float32": "f4",
          "double": "f8", "float64": "f8"}
_NORMALS = ("nx", "ny", "nz")
_TEXTURE_COORDINATES = (("s", "t"), ("u", "v"), ("texture_u", "texture_v"))
# Real files unpack to ten times their size at most; a few bytes must not take the machine's memory or time.
_MAX_RATIO, _ALWAYS_UNPACKED = 50, 1 << 16
_ORDERS = {"ascii": "", "binary_little_endian": "<", "binary_big_endian": ">"}


@dataclass
class _Property:
    """A property of an element; ``length`` is the type of a list's length, None for a scalar."""

    name: str
    dtype: str
    length: str | None = None


@dataclass
class _Element:
    name: str
    count: int
    properties: list[_Property]


def _read_header(path, data):
    """(format, elements, bytes of the header)."""
    end = data.find(b"end_header")
    if not data.startswith(b"ply"):
        raise SceneError(f"{path}: not a PLY file: no ply in line 1")
    if end < 0:
        raise SceneError(f"{path}: not a PLY file: no end_header")
    size = data.find(b"\n", end) + 1 or len(data)
    form, elements = None, []
    for number, line in enumerate(data[:size].decode("latin-1").splitlines(), start=1):
        try:
            match line.split():
                case ["format", form, "1.0"] if form in _ORDERS:
                    pass
                case ["element", name, count] if int(count) >= 0:
                    elements.append(_Element(name, int(count), []))
                case ["property", "list", length, dtype, name] if elements:
                    elements[-1].properties.append(_Property(name, _TYPES[dtype], _TYPES[length]))
                case ["property", dtype, name] if elements:
                    elements[-1].properties.append(_Property(name, _TYPES[dtype]))
                case [] | ["ply"] | ["comment", *_] | ["obj_info", *_] | ["end_header"]:
                    pass
                case _:
                    raise ValueError
        except (ValueError, KeyError):
            raise SceneError(f"{path}:{number}: '{line.strip()}' is not understood") from None
    for element in elements:
        for name, times in Counter(prop.name for prop in element.properties).items():
            if times > 1:
                raise SceneError(f"{path}: element '{element.name}' has {times} properties '{name}'")
        # Each takes a byte at least.
        if element.count > len(data) - size:
            raise SceneError(f"{path}: ends within element '{element.name}' of {element.count}; it is cut short")
    if form is None:
        raise SceneError(f"{path}: header has no line 'format {'|'.join(_ORDERS)} 1.0'")
    return form, elements, size


class _Ascii:
    """Values of the body's words, in order."""

    def __init__(self, path, data):
        self.path, self.position = path, 0
        try:
            self.values = np.array(data.split(), dtype=np.float64)
        except ValueError as error:
            raise SceneError(f"{path}: body has a word that is not a number: {error}") from None

    def table(self, element):
        """Scalar properties of an element without lists, by name."""
        width = len(element.properties)
        values = self._take(element, element.count * width).reshape(element.count, width)
        return {prop.name: values[:, i] for i, prop in enumerate(element.properties)}

    def _take(self, element, count):
        if self.position + count > len(self.values):
            raise SceneError(f"{self.path}: ends within element '{element.name}' of {element.count}; it is cut short")
        values = self.values[self.position:self.position + count]
        self.position += count
        return values

    def scalar(self, element, _dtype):
        return self._take(element, 1)[0]

    def vector(self, element, _dtype, count):
        return self._take(element, count)


class _Binary:
    """The same for a binary body."""

    def __init__(self, path, data, order):
        self.path, self.data, self.order, self.position = path, data, order, 0

    def _take(self, element, dtype, count):
        size = count * dtype.itemsize
        if self.position + size > len(self.data):
            raise SceneError(f"{self.path}: ends within element '{element.name}' of {element.count}; it is cut short")
        values = np.frombuffer(self.data, dtype, count, self.position)
        self.position += size
        return values

    def table(self, element):
        row = np.dtype([(prop.name, self.order + prop.dtype) for prop in element.properties])
        values = self._take(element, row, element.count)
        return {prop.name: values[prop.name].astype(np.float64) for prop in element.properties}

    def scalar(self, element, dtype):
        return self._take(element, np.dtype(self.order + dtype), 1)[0]

    def vector(self, element, dtype, count):
        return self._take(element, np.dtype(self.order + dtype), count)

    def uniform_lists(self, element):
        """The one list of an element as int64[count, n] if all lists are as long as the first, else None."""
        (prop,) = element.properties
        start = self.position
        length = self.scalar(element, prop.length)
        self.position = start
        if not 0 <= length <= len(self.data):
            return None
        length = int(length)
        row = np.dtype([("length", self.order + prop.length), ("list", self.order + prop.dtype, (length,))])
        if element.count * row.itemsize > len(self.data) - start:
            return None
        values = self._take(element, row, element.count)
        if (values["length"] == length).all():
            return values["list"].astype(np.int64).reshape(element.count, length)
        self.position = start
        return None


def _faces(body, element):
    """Corner lists of the faces: a list of integer arrays."""
    names = [prop.name for prop in element.properties]
    wanted = next((i for i, name in enumerate(names) if name in ("vertex_indices", "vertex_index")), None)
    if wanted is None or element.properties[wanted].length is None:
        raise SceneError(f"{body.path}: element 'face' has no list 'vertex_indices'")
    if isinstance(body, _Binary) and len(names) == 1 and element.count:
        uniform = body.uniform_lists(element)
        if uniform is not None:
            return uniform
    faces = []
    for _ in range(element.count):
        for i, prop in enumerate(element.properties):
            count = 1 if prop.length is None else body.scalar(element, prop.length)
            if not 0 <= count < np.inf:
                raise SceneError(f"{body.path}: face {len(faces)} has a list of length {count:g}")
            values = body.vector(element, prop.dtype, int(count))
            if i == wanted:
                faces.append(values.astype(np.int64))
    return faces


def _fan(path, faces, num_vertices):
    if isinstance(faces, np.ndarray):
        n = max(faces.shape[1] - 2, 0)
        triangles = np.stack([np.repeat(faces[:, :1], n, axis=1), faces[:, 1:n + 1], faces[:, 2:n + 2]], axis=2)
        triangles = triangles.reshape(-1, 3)
    else:
        triangles = np.array([(face[0], face[i], face[i + 1]) for face in faces for i in range(1, len(face) - 1)],
                             dtype=np.int64).reshape(-1, 3)
    bad = (triangles < 0) | (triangles >= num_vertices)
    if bad.any():
        raise SceneError(f"{path}: triangle {np.argwhere(bad)[0, 0]} uses vertex {triangles[bad][0]}; "
                         f"there are {num_vertices}, numbered from 0")
    return triangles.astype(np.int32)


def _materials(columns, element, triangles):
    """Materials and their ids: a colour for each triangle, the mean of its corners', where vertices have colours."""
    if not all(name in columns for name in ("red", "green", "blue")):
        return [DEFAULT_MATERIAL], np.zeros(len(triangles), np.int32)
    dtype = next(np.dtype(prop.dtype) for prop in element.properties if prop.name == "red")
    colors = np.stack([columns[name] for name in ("red", "green", "blue")], axis=1)
    if dtype.kind in "iu":
        colors = colors / np.iinfo(dtype).max
    # 32 levels a channel: thousands of vertices share few materials.
    levels = np.round(np.nan_to_num(colors[triangles].mean(axis=1)).clip(0, 1) * 31).astype(np.int64)
    unique, ids = np.unique(levels, axis=0, return_inverse=True)
    materials = [Material(f"color {r}/{g}/{b}", (r / 31, g / 31, b / 31)) for r, g, b in unique.tolist()]
    return materials or [DEFAULT_MATERIAL], ids.reshape(-1).astype(np.int32)


def _per_corner(columns, triangles, *names):
    """Attribute of each corner, float64[T, 3, n], by the first set of columns that is there; None if none is."""
    for wanted in names:
        if all(name in columns for name in wanted):
            return np.nan_to_num(np.stack([columns[name] for name in wanted], axis=1))[triangles]
    return None


def _unpacked(path, data):
    most = max(_MAX_RATIO * len(data), _ALWAYS_UNPACKED)
    try:
        with gzip.open(io.BytesIO(data)) as file:
            unpacked = file.read(most + 1)
    except (OSError, EOFError, zlib.error) as error:
        raise SceneError(f"{path}: not a whole gzip file: {error}") from None
    if len(unpacked) > most:
        raise SceneError(f"{path}: would unpack to more than {most:,} bytes, {_MAX_RATIO} times its size; unpack it "
                         "with gunzip")
    return unpacked


def load_ply(path):
    """Scene of a PLY file: one mesh, one instance.

    Parameters
    ----------
    path : path-like
        Ending in .ply, or .ply.gz where compressed.

    Raises
    ------
    SceneError
        If the header is not understood, the body is cut short, or a face uses a vertex that is not there.
    """
    path = Path(path)
    data = path.read_bytes()
    if path.suffix.lower() == ".gz":
        data = _unpacked(path, data)
    form, elements, size = _read_header(path, data)
    body = _Ascii(path, data[size:]) if form == "ascii" else _Binary(path, data[size:], _ORDERS[form])
    columns, triangles, vertex = None, None, None
    for element in elements:
        if element.name == "face":
            faces = _faces(body, element)
            if columns is None:
                raise SceneError(f"{path}: element 'face' must come after element 'vertex'")
            triangles = _fan(path, faces, len(columns["x"]))
        elif any(prop.length for prop in element.properties):
            raise SceneError(f"{path}: element '{element.name}' with a list is not supported; only 'face' may have one")
        else:
            table = body.table(element)
            if element.name == "vertex":
                columns, vertex = table, element
                if not {"x", "y", "z"} <= columns.keys():
                    raise SceneError(f"{path}: element 'vertex' lacks x, y or z")
    if triangles is None:
        raise SceneError(f"{path}: scene is empty: no element 'face' (a point cloud?)")
    materials, material_ids = _materials(columns, vertex, triangles)
    vertices = np.stack([columns[name] for name in "xyz"], axis=1)
    name = path.name.split(".")[0]
    mesh = Mesh(name, vertices, triangles, material_ids, normals=_per_corner(columns, triangles, _NORMALS),
                uvs=_per_corner(columns, triangles, *_TEXTURE_COORDINATES))
    return Scene([mesh], [Instance(0, IDENTITY, name)], materials)
