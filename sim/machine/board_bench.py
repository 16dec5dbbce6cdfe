"""A board simulated at its pins: a serial cable to it, an SDRAM chip and a monitor on it."""

import ctypes
from ctypes import POINTER, c_char_p, c_uint8, c_uint64, c_void_p
from pathlib import Path

import numpy as np

from rtl.sdram.timing import SLOWEST, SdramTiming
from rtl.top import Top
from rtl.video.mode import XGA

from .bench import SimulationError
from .component_build import component_library
from .dvi_receiver import DviReceiver, unpacked
from .sdram_bench import PARTS
from .simulation import Simulation

__all__ = ["SimulatedBoard"]

_ASSERTION, _VIOLATION = 1, 2
_CHUNK = 1 << 16
#: Cycles between two looks at whether to go on
_STRIDE = 1 << 14


class SimulatedBoard(Simulation):
    """A Verilated :class:`~rtl.top.Top`; a port for a :class:`~sim.host.driver.Driver`, in the board's own time.

    Parameters
    ----------
    config : ChipConfig
        The chip.
    clock_mhz : float
        Of chip and SDRAM.
    mode : VideoMode
        Of the screen.
    scale : int
        2 for pictures of half its width and height.
    divisor : int
        Cycles of a bit of the cable; by default the least that there can be, as loading is most of a simulation.
    part : str
        The SDRAM.
    progress : callable
        Is told what is being compiled, if anything is.

    Raises
    ------
    BuildError
        If it cannot be compiled.
    """

    def __init__(self, config, *, clock_mhz=100.0, mode=XGA, scale=2, divisor=4, part="MT48LC16M16A2-75",
                 progress=lambda text: None):
        self._clock_mhz = clock_mhz
        self._mode = mode
        self.top = Top(config, timing=SdramTiming(SLOWEST, clock_mhz=clock_mhz), mode=mode, scale=scale,
                       divisor=divisor)
        library = ctypes.CDLL(str(component_library(
            self.top, bench=Path(__file__).with_name("board_bench.cpp"), domains=("sync", "pixel", "shift"),
            progress=progress)))
        for name in ("cycle", "received", "unwatched"):
            getattr(library, f"bench_{name}").restype = c_uint64
        library.bench_new.restype = c_void_p
        library.bench_violation.restype = c_char_p
        self._library = library
        self._bench = c_void_p(library.bench_new(
            PARTS.index(part), c_uint64(round(1e6 / clock_mhz)), c_uint64(round(1e6 / (5 * mode.pixel_mhz))), divisor))
        self._buffer = (c_uint8 * _CHUNK)()
        # Come while the screen was watched
        self._earlier = b""

    def run(self, cycles, *, until_byte=False):
        """Goes on for so many cycles, or until a byte has come.

        Raises
        ------
        SimulationError
            If the SDRAM refuses a command, or an assertion of the hardware fails.
        """
        end = self.cycle + cycles
        while (left := end - self.cycle) > 0:
            status = self._library.bench_run(self._bench, c_uint64(min(left, _STRIDE)), int(until_byte))
            if status == _VIOLATION:
                raise SimulationError(
                    f"the SDRAM refuses: {self._library.bench_violation(self._bench).decode()}")
            if status == _ASSERTION:
                raise SimulationError(f"an assertion of the hardware fails in cycle {self.cycle}")
            if until_byte and (received := self._received()):
                return received
        return self._received()

    def _received(self):
        count = self._library.bench_received(self._bench, self._buffer, c_uint64(_CHUNK))
        received, self._earlier = self._earlier + bytes(self._buffer[:count]), b""
        return received

    def write(self, sent):
        """Bytes to the board, which go while it runs."""
        self._library.bench_send(self._bench, bytes(sent), c_uint64(len(sent)))

    def read(self, seconds):
        """Bytes that have come, none if none do in so many seconds of the board."""
        return self.run(max(1, round(seconds * self._clock_mhz * 1e6)), until_byte=True)

    def receive(self, sent):
        """As :meth:`write`, for a pseudo-terminal; what is answered comes later."""
        self.write(sent)
        return b""

    @property
    def is_ready(self):
        """Whether its lamp says that a picture may be started: the last one is on the screen."""
        return bool(self._library.bench_lamps(self._bench) & 1)

    @property
    def is_drawing(self):
        """Whether its lamp says that a picture is drawn."""
        return bool(self._library.bench_lamps(self._bench) & 2)

    def clock(self):
        """Seconds of the board since it was switched on."""
        return self.cycle / (self._clock_mhz * 1e6)

    def reset(self):
        """All but the SDRAM begins anew."""
        self._library.bench_reset(self._bench)

    @property
    def cycle(self):
        """Cycles of the chip's clock so far."""
        return int(self._library.bench_cycle(self._bench))

    def screen(self, frames=1):
        """What a monitor shows from now on: a list of so many whole frames.

        Raises
        ------
        DviError
            If what comes is not what the specification allows.
        """
        mode = self._mode
        pairs = np.zeros(5 * mode.h_total * mode.v_total * (frames + 1) + 5 * mode.h_total, np.uint8)
        self._library.bench_watch(self._bench, pairs.ctypes.data_as(POINTER(c_uint8)), c_uint64(pairs.size))
        while self._library.bench_unwatched(self._bench):
            self._earlier = self.run(_STRIDE)
        return DviReceiver(unpacked(pairs)).frames()[:frames]
