"""glTF buffers and accessors as numpy arrays; nothing is believed that the file does not hold."""

import base64
import urllib.parse

import numpy as np

from .error import SceneError
from .files import inside

__all__ = ["Accessors", "read_uri"]

_COMPONENTS = {5120: np.dtype("i1"), 5121: np.dtype("u1"), 5122: np.dtype("<i2"), 5123: np.dtype("<u2"),
               5125: np.dtype("<u4"), 5126: np.dtype("<f4")}
_WIDTHS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4}
# Elements of all accessors without data (all zero): a few bytes of file must not claim the machine's memory.
_MAX_ZEROS = 1 << 24


def read_uri(element, uri, folder):
    """Bytes that an element's ``uri`` holds (data:) or names (a file in the scene's folder).

    Raises
    ------
    SceneError
        If it is neither, or there is no such file.
    """
    if uri.startswith("data:"):
        head, _, body = uri.partition(",")
        try:
            return base64.b64decode(body, validate=True) if head.endswith(";base64") \
                else urllib.parse.unquote_to_bytes(body)
        except ValueError as error:
            raise element.error(f"bad base64 data: {error}") from None
    try:
        scheme = urllib.parse.urlsplit(uri).scheme
    except ValueError as error:
        raise element.error(f"'{uri}' is no uri: {error}") from None
    if scheme:
        raise element.error(f"'{uri}' is not a file name; only files beside the scene are read")
    try:
        path = inside(folder, urllib.parse.unquote(uri))
        return path.read_bytes()
    except SceneError as error:
        raise element.error(error) from None
    except OSError as error:
        raise element.error(f"{path}: {error.strerror}") from None


class Accessors:
    """Reads the accessors of a glTF file.

    Parameters
    ----------
    folder : Path
        Folder of the file; its external buffers may not lie outside.
    binary : bytes or None
        The binary chunk of a .glb.
    """

    def __init__(self, folder, binary):
        self.folder, self.binary = folder, binary
        self._buffers, self._zeros_left = {}, _MAX_ZEROS

    def _load(self, buffer):
        uri = buffer.text("uri", None)
        if uri is None:
            if buffer.place != "buffers[0]" or self.binary is None:
                raise buffer.error("has no uri, and no binary chunk holds it")
            return self.binary
        return read_uri(buffer, uri, self.folder)

    def _buffer(self, buffer):
        if buffer.place not in self._buffers:
            data, claimed = self._load(buffer), buffer.whole("byteLength")
            if len(data) < claimed:
                raise buffer.error(f"claims {claimed} bytes but has {len(data)}; it is cut short")
            self._buffers[buffer.place] = data
        return self._buffers[buffer.place]

    def _place(self, view):
        """Buffer, offset and length of a buffer view."""
        data = self._buffer(view.refer("buffer", "buffers"))
        offset, length = view.whole("byteOffset", 0), view.whole("byteLength")
        if offset + length > len(data):
            raise view.error(f"ends at byte {offset + length} of a buffer of {len(data)}")
        return data, offset, length

    def view_bytes(self, view):
        """Bytes of a buffer view, as images are stored."""
        data, offset, length = self._place(view)
        return bytes(data[offset:offset + length])

    def _elements(self, source, count, dtype, width):
        """Array[count, width] over the buffer view that ``source`` (an accessor or part of one) names."""
        view = source.refer("bufferView", "bufferViews")
        data, view_offset, view_length = self._place(view)
        element = dtype.itemsize * width
        stride = view.whole("byteStride", element)
        if stride < element:
            raise view.error(f"byteStride {stride} is less than the {element} bytes of an element")
        offset = source.whole("byteOffset", 0)
        end = offset + stride * (count - 1) + element
        if count and end > view_length:
            raise source.error(f"{count} elements end at byte {end}, {view.place} has {view_length}")
        if not count:
            return np.zeros((0, width), dtype)
        return np.ndarray((count, width), dtype, data, view_offset + offset, (stride, dtype.itemsize))

    def read(self, accessor, types, *, as_index=False):
        """Accessor as float64[count, width], normalised integers scaled and sparse elements put in.

        Parameters
        ----------
        accessor : Element
        types : tuple of str
            Types that are right here, as in ``("VEC3", "VEC4")``.
        as_index : bool
            Require unsigned whole numbers, and give them as int64[count].

        Raises
        ------
        SceneError
            If it is of another type, or reaches beyond its buffer.
        """
        kind, component = accessor.text("type"), accessor.whole("componentType")
        dtype = _COMPONENTS.get(component)
        if kind not in types or dtype is None or (as_index and dtype.kind != "u"):
            raise accessor.error(f"type {kind} of component type {component} cannot be used here; "
                                 f"{' or '.join(types)}{' of unsigned integers' if as_index else ''} can")
        width, count = _WIDTHS[kind], accessor.whole("count")
        if "bufferView" in accessor.data:
            values = self._elements(accessor, count, dtype, width)
        elif count <= self._zeros_left:
            self._zeros_left -= count
            values = np.zeros((count, width), dtype)
        else:
            raise accessor.error(f"{count} elements without data; at most {_MAX_ZEROS} are taken of a file")
        if "sparse" in accessor.data:
            values = self._with_sparse(values, accessor.child("sparse"))
        if as_index:
            return values[:, 0].astype(np.int64)
        scaled = values.astype(np.float64)
        if accessor.flag("normalized") and dtype.kind in "iu":
            scaled = np.maximum(scaled / np.iinfo(dtype).max, -1.0)
        return scaled

    def _with_sparse(self, values, sparse):
        count, where, what = sparse.whole("count"), sparse.child("indices"), sparse.child("values")
        if where is None or what is None:
            raise sparse.error("needs 'indices' and 'values'")
        dtype = _COMPONENTS.get(where.whole("componentType"))
        if dtype is None or dtype.kind != "u":
            raise where.error("component type must be an unsigned integer")
        index = self._elements(where, count, dtype, 1)[:, 0]
        if count and index.max() >= len(values):
            raise where.error(f"index {index.max()} is out of range; there are {len(values)} elements")
        values = values.copy()
        values[index] = self._elements(what, count, values.dtype, values.shape[1])
        return values
