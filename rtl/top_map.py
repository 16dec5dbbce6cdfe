"""What a host finds behind its link: the registers of a :class:`~rtl.top.Top`, by name."""

import zlib

from .dynrtc import counter_names
from .layout import camera_layout
from .memory_ports import memory_ports

__all__ = ["TopMap"]


class TopMap:
    """Names of registers and of what can be read, each of 32 bits, in their order.

    Parameters
    ----------
    config : :class:`~rtl.config.ChipConfig`
        Of the chip.

    Attributes
    ----------
    num_camera_words : int
        Registers ``camera0`` … that make a :func:`~rtl.layout.camera_layout`, the lowest bits first.
    registers : tuple of str
        The camera's; ``root``; ``size``, width in the lower and height in the upper half; ``background``; where each of
        the chip's memories begins, and the two frames, in units of 16 words; and ``options``, of which bit 0 shows the
        test picture.
    num_guarded : int
        So many of them make the picture, and are not set while one is drawn.
    values : tuple of str
        ``identity``; ``status``, of which bit 0 says that a picture may be started, bit 1 that one waits to be shown,
        and bit 2 which frame is; ``frames`` shown and lines that were ``late``, since reset; the chip's counters.
    identity : int
        Tells chips of one configuration from others: images for one are not for another.
    """

    def __init__(self, config):
        self.num_camera_words = -(-camera_layout(config.fmt).size // 32)
        guarded = (*(f"camera{number}" for number in range(self.num_camera_words)), "root", "size", "background",
                   *(f"{name}_base" for name in memory_ports(config)), "frame0_base", "frame1_base")
        self.registers = (*guarded, "options")
        self.num_guarded = len(guarded)
        self.values = ("identity", "status", "frames", "late", *counter_names(config))
        self.identity = zlib.crc32(repr(config).encode())
