"""Icepi Zero: an LFE5U-25F, 32 MB of SDRAM, a connector for a monitor and a USB serial port, the size of a stick."""

from dataclasses import replace

from amaranth_boards.icepi_zero import IcepiZero1_3Platform

from rtl.video.mode import XGA_REDUCED

from .board import Board
from .chips import SMALL
from .device import DEVICES

__all__ = ["ICEPI_ZERO"]

ICEPI_ZERO = Board(name="icepi_zero", title="Icepi Zero 1.3", platform=IcepiZero1_3Platform,
                   device=replace(DEVICES["LFE5U-25F"], package="CABGA256"), oscillator_mhz=50, clock_mhz=50,
                   config=SMALL, mode=XGA_REDUCED)
