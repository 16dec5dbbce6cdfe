"""What a board is: its FPGA and connectors, and the chip that is built for it."""

from collections.abc import Callable
from dataclasses import dataclass

from rtl.config import ChipConfig
from rtl.host.uart import uart_divisor
from rtl.sdram.timing import SLOWEST, SdramChip, SdramTiming
from rtl.video.mode import VideoMode

from .device import Device

__all__ = ["Board"]


@dataclass(frozen=True, kw_only=True)
class Board:
    """A board with an ECP5, a 16-bit SDRAM, a DVI or HDMI connector and a serial port.

    Parameters
    ----------
    name : str
        By which it is asked for.
    title : str
        For people.
    platform : callable
        Makes the platform of amaranth-boards.
    device : Device
        The FPGA.
    grade : int
        Its speed grade.
    oscillator_mhz : float
        The clock that the board gives.
    clock_mhz : float
        The chip's and the SDRAM's.
    config : ChipConfig
        The chip that it is built with, if no other is asked for.
    mode : VideoMode
        Of the screen.
    scale : int
        2 for pictures of half the screen's width and height.
    baud : int
        Of the serial port.
    sdram : SdramChip
        The times of what may be soldered on it.
    """

    name: str
    title: str
    platform: Callable
    device: Device
    grade: int = 6
    oscillator_mhz: float
    clock_mhz: float
    config: ChipConfig
    mode: VideoMode
    scale: int = 2
    baud: int = 3_000_000
    sdram: SdramChip = SLOWEST

    @property
    def size(self):
        """Width and height of pictures."""
        return self.mode.width // self.scale, self.mode.height // self.scale

    def timing(self, clock_mhz):
        """Of the SDRAM at a clock."""
        return SdramTiming(self.sdram, clock_mhz=clock_mhz)

    def divisor(self, clock_mhz):
        """Cycles of a bit of the serial port at a clock."""
        return uart_divisor(clock_hz=clock_mhz * 1e6, baud=self.baud)
