"""Tables of fixed records in binary files; nothing is believed that the file does not hold."""

import numpy as np

from .error import SceneError

__all__ = ["Records", "text"]


class Records:
    """Bytes of a file, taken piece by piece.

    Parameters
    ----------
    data : bytes
    name : str
        What messages call the file.
    """

    def __init__(self, data, name):
        self.data, self.name = data, name

    def error(self, text):
        """SceneError about this file."""
        return SceneError(f"{self.name}: {text}")

    def table(self, what, dtype, offset, count):
        """Array of ``count`` records at a byte of the file, not copied.

        Raises
        ------
        SceneError
            If the file does not reach that far.
        """
        dtype, offset, count = np.dtype(dtype), int(offset), int(count)
        if offset < 0 or count < 0 or offset + count * dtype.itemsize > len(self.data):
            raise self.error(f"{what}: {count} of {dtype.itemsize} bytes at byte {offset}, in a file of "
                             f"{len(self.data)}; it is cut short or damaged")
        return np.frombuffer(self.data, dtype, count, offset)


def text(raw):
    """The text of a field of bytes, up to its first zero."""
    return bytes(raw).split(b"\0", 1)[0].decode("latin-1")
