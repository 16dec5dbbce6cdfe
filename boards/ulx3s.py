"""ULX3S: an ECP5 of 12 to 85 thousand tables, 32 MB of SDRAM, a connector for a monitor and a USB serial port."""

from dataclasses import replace

from amaranth_boards.ulx3s import ULX3S_25F_Platform, ULX3S_45F_Platform, ULX3S_85F_Platform

from rtl.video.mode import XGA_REDUCED

from .board import Board
from .chips import FULL, SIMPLE, SMALL
from .device import DEVICES

__all__ = ["ULX3S_25F", "ULX3S_45F", "ULX3S_85F"]

ULX3S_85F = Board(name="ulx3s_85f", title="ULX3S with LFE5U-85F", platform=ULX3S_85F_Platform,
                  device=DEVICES["LFE5U-85F"], oscillator_mhz=25, clock_mhz=64.0625, config=FULL,
                  mode=XGA_REDUCED)
ULX3S_45F = replace(ULX3S_85F, name="ulx3s_45f", title="ULX3S with LFE5U-45F", platform=ULX3S_45F_Platform,
                    device=DEVICES["LFE5U-45F"], clock_mhz=70, config=SIMPLE)
ULX3S_25F = replace(ULX3S_85F, name="ulx3s_25f", title="ULX3S with LFE5U-25F", platform=ULX3S_25F_Platform,
                    device=DEVICES["LFE5U-25F"], clock_mhz=50, config=SMALL)
