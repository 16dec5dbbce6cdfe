"""Wavefront OBJ: every ``o`` statement's faces become one mesh with one instance.

A reader of our own because ``prim_id`` is the triangle's number in file order: trimesh groups faces by
material and merges objects of one name. Lines are handled in bulk by kind; only when that fails is the
offending line looked for.
"""

import re
from dataclasses import dataclass
from itertools import chain
from pathlib import Path

import numpy as np

from .error import SceneError
from .mtl import load_mtl
from .scene import DEFAULT_MATERIAL, IDENTITY, Instance, Mesh, Scene
from .texture import TextureFiles

__all__ = ["load_obj"]

_CORNER = re.compile(rb"[+-]?\d{1,18}(/([+-]?\d{1,18})?(/[+-]?\d{1,18})?)?")
_MAX_KEY = 8


@dataclass
class _Lines:
    """The words of each line; rows count from 0, and a continued line is on its first row."""

    path: Path
    words: list[list[bytes]]
    keys: np.ndarray

    def rows(self, key):
        return np.flatnonzero(self.keys == key)

    def words_of(self, rows):
        return [self.words[row] for row in rows.tolist()]

    def error(self, row, text):
        return SceneError(f"{self.path}:{row + 1}: {text}")

    def names(self, key):
        """Rows of a keyword, and the rest of each line."""
        rows = self.rows(key)
        return rows, [b" ".join(words[1:]).decode("utf-8", "replace") for words in self.words_of(rows)]


def _read_lines(path):
    data = path.read_bytes()
    lines = data.splitlines()
    if b"#" in data:
        lines = [line.split(b"#", 1)[0] for line in lines]
    if b"\\" in data:
        _join_continued(lines)
    words = [line.split() for line in lines]
    # Cut to a length that tells keywords apart: one long word must not widen the whole array.
    return _Lines(path, words, np.array([line[0][:_MAX_KEY] if line else b"" for line in words]))


def _join_continued(lines):
    """Puts lines that end in a backslash, and what follows them, on the first of them."""
    row = 0
    while row < len(lines):
        last = row
        while last < len(lines) - 1 and lines[last].rstrip().endswith(b"\\"):
            last += 1
        if last > row:
            lines[row] = b" ".join([line.rstrip()[:-1] for line in lines[row:last]] + [lines[last]])
            lines[row + 1:last + 1] = [b""] * (last - row)
        row = last + 1


def _vectors(text, key, width):
    """All lines of one keyword as float64[n, width]; numbers beyond ``width`` (w, colours) are ignored."""
    rows = text.rows(key)
    words = text.words_of(rows)
    try:
        return np.array([line[1:1 + width] for line in words], dtype=np.float64).reshape(-1, width)
    except ValueError:
        for row, line in zip(rows, words, strict=True):
            if len(line) <= width:
                raise text.error(row, f"'{key.decode()}' needs {width} numbers, has {len(line) - 1}") from None
            for word in line[1:1 + width]:
                try:
                    float(word)
                except ValueError:
                    raise text.error(row, f"'{word.decode(errors='replace')}' is not a number") from None
        raise


def _corners(text, rows, words):
    """Vertex, texture and normal number of every corner as int64[n, 3], 0 where not given."""
    flat = list(chain.from_iterable(line[1:] for line in words))
    if b"/" not in b" ".join(flat):
        try:
            return np.pad(np.array(flat, dtype=np.int64)[:, None], ((0, 0), (0, 2)))
        except (ValueError, OverflowError):
            pass
    for row, line in zip(rows, words, strict=True):
        for word in line[1:]:
            if not _CORNER.fullmatch(word):
                raise text.error(row, f"'{word.decode(errors='replace')}' is not a face corner; "
                                 "use v, v/vt, v//vn or v/vt/vn")
    # Every corner gets both slashes, so that one split serves all four forms.
    flat = [word + b"/" * (2 - word.count(b"/")) for word in flat]
    numbers = b"/".join(flat).split(b"/")
    return np.array([number or 0 for number in numbers], dtype=np.int64).reshape(-1, 3)


def _resolve(text, corners, corner_rows, column, key, count):
    """Numbers from 1, or from the latest line backwards where negative, into indices from 0 (−1: not given)."""
    number = corners[:, column]
    defined = np.searchsorted(text.rows(key), corner_rows)
    index = np.where(number < 0, defined + number, number - 1)
    bad = np.flatnonzero((number != 0) & ((index < 0) | (index >= count)))
    if column == 0 and not bad.size:
        bad = np.flatnonzero(number == 0)
    if bad.size:
        raise text.error(corner_rows[bad[0]], f"'{key.decode()}' index {number[bad[0]]} is out of range; "
                         f"the file has {count} (numbered from 1, or backwards from -1)")
    return index


def _per_corner(values, index):
    """Attribute of each corner of each triangle, zero where not given; None if no corner has one."""
    if not (index >= 0).any():
        return None
    return np.where((index >= 0)[..., None], values[index], 0.0)


def load_obj(path):
    """Scene of an OBJ file and the MTL files it names.

    Each ``o`` statement that has faces is a mesh with one instance (identity transform), in file order; faces
    before any ``o`` form one too. Polygons become fans, so ``prim_id`` counts triangles in file order. Points
    and lines are ignored.

    Parameters
    ----------
    path : path-like

    Raises
    ------
    SceneError
        With file and line, for a bad number, a bad face corner, or an index out of range.
    """
    path = Path(path)
    text = _read_lines(path)
    warnings = []
    positions = _vectors(text, b"v", 3)
    texcoords = _vectors(text, b"vt", 2)
    normals = _vectors(text, b"vn", 3)
    infinite = np.flatnonzero(~np.isfinite(positions).all(axis=1))
    if infinite.size:
        warnings.append(f"{path}:{text.rows(b'v')[infinite[0]] + 1}: vertex is not finite "
                        f"({infinite.size} such in the file)")

    face_rows = text.rows(b"f")
    if not face_rows.size:
        raise SceneError(f"{path}: scene is empty: no faces ('f' lines)")
    words = text.words_of(face_rows)
    num_corners = np.fromiter(map(len, words), dtype=np.int64) - 1
    short = np.flatnonzero(num_corners < 3)
    if short.size:
        raise text.error(face_rows[short[0]], f"face with {num_corners[short[0]]} corners; at least 3 are needed")
    corners = _corners(text, face_rows, words)
    corner_rows = np.repeat(face_rows, num_corners)
    index = np.stack([_resolve(text, corners, corner_rows, column, key, len(values)) for column, (key, values)
                      in enumerate(((b"v", positions), (b"vt", texcoords), (b"vn", normals)))], axis=1)

    # Fan: triangle k of a face is its corners 0, k+1, k+2.
    per_face = num_corners - 2
    first = np.repeat(np.cumsum(num_corners) - num_corners, per_face)
    step = np.arange(per_face.sum()) - np.repeat(np.cumsum(per_face) - per_face, per_face)
    index = index[np.stack([first, first + step + 1, first + step + 2], axis=1)]
    rows = np.repeat(face_rows, per_face)

    materials = [DEFAULT_MATERIAL]
    textures = TextureFiles(path.parent, warnings, flip=True)
    for name in text.names(b"mtllib")[1]:
        materials += load_mtl(path.parent, name, textures, warnings)
    warnings += textures.warnings()
    number = {material.name: i for i, material in reversed(list(enumerate(materials)))}
    use_rows, use_names = text.names(b"usemtl")
    for name in dict.fromkeys(use_names):
        if name not in number:
            warnings.append(f"{path}: material '{name}' is not defined; default grey used")
    use_ids = np.array([0] + [number.get(name, 0) for name in use_names], dtype=np.int32)
    material_ids = use_ids[np.searchsorted(use_rows, rows)]

    object_rows, object_names = text.names(b"o")
    object_names = [path.stem, *object_names]
    object_ids = np.searchsorted(object_rows, rows)
    meshes, instances = [], []
    for object_id in np.unique(object_ids):
        mine = index[object_ids == object_id]
        used, triangles = np.unique(mine[:, :, 0], return_inverse=True)
        meshes.append(Mesh(object_names[object_id], positions[used],
                           triangles.reshape(-1, 3).astype(np.int32), material_ids[object_ids == object_id],
                           normals=_per_corner(normals, mine[:, :, 2]), uvs=_per_corner(texcoords, mine[:, :, 1])))
        instances.append(Instance(len(instances), IDENTITY, object_names[object_id]))
    return Scene(meshes, instances, materials, warnings=warnings)
