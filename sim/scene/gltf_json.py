"""The structure of a glTF 2.0 file: its JSON, checked where it is read, and the binary chunk of a .glb."""

import json
import math
import struct

from .error import SceneError

__all__ = ["Element", "read_gltf_file"]

_GLB_MAGIC, _JSON_CHUNK, _BIN_CHUNK = 0x46546C67, 0x4E4F534A, 0x004E4942
_REQUIRED = object()


def _is_finite(value):
    try:
        return math.isfinite(value)
    except OverflowError:  # a whole number beyond the largest float
        return False


class Element:
    """A JSON object with its place in the file; every getter raises SceneError naming that place.

    Parameters
    ----------
    data : object
        What the JSON holds there.
    place : str
        As in ``nodes[3].camera``; empty for the whole file.
    root : Element, optional
        The whole file; itself if not given.
    """

    def __init__(self, data, place="", root=None):
        self.data, self.place, self.root = data, place, root or self
        if not isinstance(data, dict):
            raise SceneError(f"{place or 'glTF'}: must be a JSON object, not {type(data).__name__}")

    def error(self, text):
        """SceneError about this element."""
        return SceneError(f"{self.place}: {text}" if self.place else text)

    def _get(self, key, default, kinds, what):
        value = self.data.get(key, default)
        if value is _REQUIRED:
            raise self.error(f"'{key}' is missing")
        if value is not default and (not isinstance(value, kinds) or (isinstance(value, bool) and bool not in kinds)):
            raise self.error(f"'{key}' must be {what}, not {value!r}")
        return value

    def text(self, key, default=_REQUIRED):
        """A string."""
        return self._get(key, default, (str,), "a string")

    def flag(self, key):
        """A boolean, false if absent."""
        return self._get(key, False, (bool,), "true or false")

    def whole(self, key, default=_REQUIRED):
        """A whole number, not negative."""
        value = self._get(key, default, (int,), "a whole number")
        if isinstance(value, int) and value < 0:
            raise self.error(f"'{key}' must not be negative, it is {value}")
        return value

    def real(self, key, default=_REQUIRED):
        """A finite number."""
        value = self._get(key, default, (int, float), "a number")
        if value is not default and not _is_finite(value):
            raise self.error(f"'{key}' must be finite, it is {value}")
        return value

    def reals(self, key, length, default=_REQUIRED):
        """A list of ``length`` finite numbers."""
        value = self._get(key, default, (list,), f"a list of {length} numbers")
        if value is not default and (len(value) != length or not all(
                isinstance(x, (int, float)) and not isinstance(x, bool) and _is_finite(x) for x in value)):
            raise self.error(f"'{key}' must be a list of {length} finite numbers, not {value!r}")
        return value

    def child(self, key):
        """The object under ``key``, or None."""
        return Element(self.data[key], f"{self.place}.{key}", self.root) if key in self.data else None

    def list(self, key):
        """The objects in the list under ``key``, empty if absent."""
        values = self._get(key, (), (list,), "a list")
        prefix = f"{self.place}.{key}" if self.place else key
        return [Element(value, f"{prefix}[{i}]", self.root) for i, value in enumerate(values)]

    def indices(self, key, kind):
        """A list of numbers of top-level elements of a kind."""
        values = self._get(key, (), (list,), "a list of numbers")
        return [self._checked(key, value, kind) for value in values]

    def index(self, key, kind, default=_REQUIRED):
        """The number of a top-level element of a kind, as in ``mesh`` of ``meshes``."""
        value = self.whole(key, default)
        return value if value is default else self._checked(key, value, kind)

    def refer(self, key, kind):
        """The top-level element whose number is under ``key``."""
        number = self.index(key, kind)
        return Element(self.root.data[kind][number], f"{kind}[{number}]", self.root)

    def _checked(self, key, value, kind):
        elements = self.root.data.get(kind, ())
        num = len(elements) if isinstance(elements, (list, tuple)) else 0
        if not isinstance(value, int) or isinstance(value, bool) or not 0 <= value < num:
            raise self.error(f"'{key}' names {kind}[{value!r}], which does not exist; there are {num}")
        return value


def _split_glb(data):
    """JSON text and binary chunk (or None) of a .glb file."""
    if len(data) < 12:
        raise SceneError(f"GLB header is cut short: {len(data)} bytes of 12")
    version, length = struct.unpack_from("<II", data, 4)
    if version != 2:
        raise SceneError(f"GLB version {version} is not supported; convert it to version 2")
    if length > len(data):
        raise SceneError(f"GLB header claims {length} bytes, the file has {len(data)}; it is cut short")
    text, binary, offset = None, None, 12
    while offset + 8 <= length:
        size, kind = struct.unpack_from("<II", data, offset)
        if offset + 8 + size > length:
            raise SceneError(f"GLB chunk at byte {offset} claims {size} bytes, {length - offset - 8} are left")
        chunk = data[offset + 8:offset + 8 + size]
        if kind == _JSON_CHUNK and text is None:
            text = chunk
        elif kind == _BIN_CHUNK and binary is None:
            binary = chunk
        offset += 8 + size
    if text is None:
        raise SceneError("GLB has no JSON chunk")
    return text, binary


def read_gltf_file(path, supported=()):
    """``(Element, bytes or None)``: the JSON of a .gltf or .glb file, told apart by content, and the binary
    chunk.

    Parameters
    ----------
    path : Path
    supported : sequence of str
        Extensions that a file may require.

    Raises
    ------
    SceneError
        If the file is cut short, is no JSON, is no glTF 2.x, or requires an extension that is not supported.
    """
    data, binary = path.read_bytes(), None
    if data[:4] == struct.pack("<I", _GLB_MAGIC):
        data, binary = _split_glb(data)
    try:
        root = Element(json.loads(data.decode("utf-8-sig")))
    except (ValueError, RecursionError) as error:
        raise SceneError(f"not valid JSON: {error}") from None
    asset = root.child("asset")
    version = asset.text("version") if asset else "unknown"
    if version.split(".")[0] != "2":
        raise SceneError(f"glTF version {version} is not supported; convert it to version 2.0")
    required = root.data.get("extensionsRequired") or []
    if not isinstance(required, list) or any(name not in supported for name in required):
        raise SceneError(f"requires extensions {required}; export without them (no compression)")
    return root, binary
