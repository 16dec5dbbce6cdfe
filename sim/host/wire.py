"""Frames as bytes on the wire."""

import struct
import zlib
from dataclasses import dataclass

from rtl.host.protocol import END, ESCAPE, ESCAPED_END, ESCAPED_ESCAPE, OVERHEAD

__all__ = ["Deframer", "Frame", "pack_words", "unpack_words"]

_HEADER = struct.Struct("<BBH")


def pack_words(words):
    """Words as bytes, the lowest first."""
    return struct.pack(f"<{len(words)}I", *words)


def unpack_words(payload):
    """A payload's words."""
    return struct.unpack(f"<{len(payload) // 4}I", payload)


@dataclass(frozen=True)
class Frame:
    """A frame: type, sequence number, payload.

    Parameters
    ----------
    kind, sequence : int
        A byte each.
    payload : bytes
        Words of four.
    """

    kind: int
    sequence: int
    payload: bytes = b""

    @property
    def checksum(self):
        """CRC-32 of header and payload."""
        return zlib.crc32(_HEADER.pack(self.kind, self.sequence, len(self.payload)) + self.payload)

    def encode(self):
        """Its bytes between two of END."""
        inner = _HEADER.pack(self.kind, self.sequence, len(self.payload)) + self.payload
        inner += struct.pack("<I", zlib.crc32(inner))
        # The escape first, so that what stands for END is not escaped again.
        inner = inner.replace(bytes([ESCAPE]), bytes([ESCAPE, ESCAPED_ESCAPE]))
        inner = inner.replace(bytes([END]), bytes([ESCAPE, ESCAPED_END]))
        return bytes([END]) + inner + bytes([END])

    @classmethod
    def parse(cls, inner):
        """The frame of bytes between two of END, without escapes; None if it is damaged."""
        if len(inner) < OVERHEAD:
            return None
        kind, sequence, length = _HEADER.unpack_from(inner)
        body, checksum = inner[:-4], struct.unpack("<I", inner[-4:])[0]
        if length != len(inner) - OVERHEAD or length % 4 or zlib.crc32(body) != checksum:
            return None
        return cls(kind, sequence, inner[4:-4])


class Deframer:
    """Cuts a stream of bytes into what is between two of END; before the first, nobody knows what it is.

    Parameters
    ----------
    max_bytes : int
        Longest that is kept, so that noise without end takes no memory.
    """

    def __init__(self, *, max_bytes=1 << 16):
        self._max_bytes = max_bytes
        self.reset()

    def reset(self):
        """Forgets what has come, and waits for an END."""
        self._inner, self._escaped, self._skips = bytearray(), False, True

    def feed(self, received):
        """A list of what has ended with these bytes, each without its escapes; nothing between two of END is none."""
        found = []
        for byte in received:
            escaped, self._escaped = self._escaped, byte == ESCAPE and not self._escaped
            if byte == END:
                if self._inner and not self._skips:
                    found.append(bytes(self._inner))
                self._inner, self._skips = bytearray(), False
            elif byte != ESCAPE and not self._skips and len(self._inner) < self._max_bytes:
                self._inner.append((END if byte == ESCAPED_END else ESCAPE) if escaped else byte)
        return found
