"""Modes of a display: how many pixels and lines, and when they are synchronised."""

from dataclasses import dataclass

__all__ = ["MODES", "VGA", "XGA", "XGA_REDUCED", "VideoMode"]


@dataclass(frozen=True, kw_only=True)
class VideoMode:
    """The times of a picture: of a line in pixels, of a frame in lines.

    Parameters
    ----------
    name : str
        As people write it.
    pixel_mhz : float
        Nominal pixel clock.
    width, height : int
        What is visible.
    h_front, h_sync, h_back, v_front, v_sync, v_back : int
        After what is visible: front porch, sync pulse, back porch.
    h_positive, v_positive : bool
        Whether sync pulses are high.

    Raises
    ------
    ValueError
        If any of the times is not positive.
    """

    name: str
    pixel_mhz: float
    width: int
    h_front: int
    h_sync: int
    h_back: int
    height: int
    v_front: int
    v_sync: int
    v_back: int
    h_positive: bool = False
    v_positive: bool = False

    def __post_init__(self):
        for name in ("pixel_mhz", "width", "h_front", "h_sync", "h_back", "height", "v_front", "v_sync", "v_back"):
            if getattr(self, name) <= 0:
                raise ValueError(f"{self.name}: {name} is {getattr(self, name)}; it must be positive")

    @property
    def h_total(self):
        """Pixels from line to line."""
        return self.width + self.h_front + self.h_sync + self.h_back

    @property
    def v_total(self):
        """Lines from frame to frame."""
        return self.height + self.v_front + self.v_sync + self.v_back

    def refresh_hz(self, pixel_mhz=None):
        """Frames a second, at another pixel clock if one is given."""
        return (pixel_mhz or self.pixel_mhz) * 1e6 / (self.h_total * self.v_total)


#: VESA, *Display Monitor Timing* 1.0 rev. 13, DMT ID 04h: 59.94 Hz; the borders of 8 pixels and lines count as porches.
#: Its clock is to be within 0.5 %; with 25 MHz, 0.7 % less, there are 59.52 frames a second.
VGA = VideoMode(name="640x480", pixel_mhz=25.175, width=640, h_front=16, h_sync=96, h_back=48,
                height=480, v_front=10, v_sync=2, v_back=33)
#: Ibid., DMT ID 10h: 60.00 Hz.
XGA = VideoMode(name="1024x768", pixel_mhz=65.0, width=1024, h_front=24, h_sync=136, h_back=160,
                height=768, v_front=3, v_sync=6, v_back=29)
#: VESA, *Coordinated Video Timings* 1.2, reduced blanking: 59.87 Hz. Five times its clock is 280 MHz, which an ECP5's
#: flip-flops and wires reach; five times 65 they hardly do.
XGA_REDUCED = VideoMode(name="1024x768r", pixel_mhz=56.0, width=1024, h_front=48, h_sync=32, h_back=80,
                        height=768, v_front=3, v_sync=4, v_back=15, h_positive=True)
#: By name
MODES = {mode.name: mode for mode in (VGA, XGA, XGA_REDUCED)}
