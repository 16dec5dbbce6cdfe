"""What host and chip say to each other: numbers that both sides know."""

from enum import IntEnum

__all__ = ["ACKNOWLEDGED", "END", "ESCAPE", "ESCAPED_END", "ESCAPED_ESCAPE", "MAX_WORDS", "OVERHEAD", "REFUSED",
           "VERSION", "Command", "LinkCount", "Reason"]

#: Of the protocol
VERSION = 1
#: Framing of RFC 1055: a frame lies between two of END, which is nowhere in it
END, ESCAPE, ESCAPED_END, ESCAPED_ESCAPE = 0xC0, 0xDB, 0xDC, 0xDD
#: Words that one frame writes or reads at most
MAX_WORDS = 256
#: Bytes of a frame besides its payload
OVERHEAD = 8
#: Type of an answer: the command's and this, or REFUSED
ACKNOWLEDGED, REFUSED = 0x80, 0xFF


class Command(IntEnum):
    """Types of frames to the chip."""

    OPEN = 1
    WRITE = 2
    READ = 3
    SET = 4
    GET = 5
    START = 6


class Reason(IntEnum):
    """Why the chip refuses a frame."""

    CHECKSUM = 1
    NOT_OPEN = 2
    SEQUENCE = 3
    TYPE = 4
    LENGTH = 5
    ADDRESS = 6
    REGISTER = 7
    BUSY = 8


class LinkCount(IntEnum):
    """What the link counts, in the order in which it can be read behind the registers."""

    FRAMES = 0
    DAMAGED = 1
    DOUBLED = 2
    MISSED = 3
