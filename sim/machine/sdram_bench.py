"""The simulated board with one SDRAM, driven from Python a frame at a time."""

import ctypes
from ctypes import c_char_p, c_double, c_uint32, c_uint64, c_void_p
from pathlib import Path

import numpy as np

from rtl.memory_ports import memory_ports
from rtl.memory_system import MemorySystem
from rtl.sdram.timing import SLOWEST, SdramTiming

from .bench import MEMORIES, Bench, SimulationError, _array
from .build import bench_defines
from .component_build import component_library
from .machine import draw_frame, load_image

__all__ = ["PARTS", "SdramBench", "render_sdram"]

#: SDRAMs that there are models of, in the order of sdram_chip.h
PARTS = ("AS4C16M16SA-6", "AS4C16M16SA-7", "MT48LC16M16A2-75")
_COUNTS = ("data_cycles", "refreshes", "activations", "reads", "writes", "violations")


class SdramBench(Bench):
    """A Verilated chip with its memory controller, and an SDRAM that refuses what its datasheet forbids.

    Parameters
    ----------
    config : ChipConfig
        The chip.
    clock_mhz : float
        Clock of chip and SDRAM.
    part : str
        The SDRAM.
    chip_mhz : float, optional
        Another clock by which the SDRAM judges.
    progress : callable
        Is told what is being compiled, if anything is.

    Raises
    ------
    BuildError
        If the chip cannot be compiled.
    """

    def __init__(self, config, *, clock_mhz=125.0, part="MT48LC16M16A2-75", chip_mhz=None,
                 progress=lambda text: None):
        self._config = config
        path = component_library(
            MemorySystem(config, timing=SdramTiming(SLOWEST, clock_mhz=clock_mhz)), progress=progress,
            bench=Path(__file__).with_name("sdram_bench.cpp"),
            defines=bench_defines(config))
        self._library = library = ctypes.CDLL(str(path))
        for name in ("cycle", "words_read", "sdram"):
            getattr(library, f"bench_{name}").restype = c_uint64
        library.bench_new.restype = c_void_p
        library.bench_violation.restype = c_char_p
        self._bench = c_void_p(library.bench_new(PARTS.index(part), c_double(1000 / (chip_mhz or clock_mhz))))
        self._memories = {}

    def load(self, name, words):
        """Puts ``words`` (uint32) into the SDRAM, behind what is there, as one of a chip's memories.

        Raises
        ------
        SimulationError
            If there is no room.
        """
        words_at_once, _ = memory_ports(self._config)[name]
        padded = np.zeros(-(-max(words.size, 1) // words_at_once) * words_at_once, np.uint32)
        padded[:words.size] = words.reshape(-1)
        if not self._library.bench_memory(self._bench, MEMORIES.index(name), _array(padded, c_uint32),
                                          c_uint64(padded.size), c_uint32(words_at_once)):
            raise SimulationError(f"the memory '{name}' has {4 * padded.size:,} bytes, for which there is no room in "
                                  "the SDRAM's 32 MB behind the picture and the others")

    def write(self, name, first, words):
        """Not here: what is in the SDRAM changes by its pins only."""
        raise SimulationError("a scene in the simulated SDRAM cannot be changed")

    def trace(self, path, *, first=0, last=1 << 62):
        """Not here."""
        raise SimulationError("waveforms are not written of a chip with an SDRAM")

    def _violation(self):
        return self._library.bench_violation(self._bench).decode()

    @property
    def sdram(self):
        """What the SDRAM has done so far, by name."""
        return {name: int(self._library.bench_sdram(self._bench, number)) for number, name in enumerate(_COUNTS)}

    def picture(self, width, height):
        """The picture's words in the SDRAM, uint32[height, width]."""
        words = np.zeros((height, width), np.uint32)
        self._library.bench_picture_words(self._bench, c_uint32(width), c_uint32(height), _array(words, c_uint32))
        return words


def render_sdram(image, camera, width, height, *, config, background=(0, 0, 0), clock_mhz=125.0,
                 chip_mhz=None, progress=lambda text: None):
    """What the simulated chip draws of a scene in an SDRAM; the picture is read from there as well.

    Parameters
    ----------
    image, camera, width, height, config, background
        As for :func:`~sim.model.model.render_model`.
    clock_mhz, chip_mhz
        See :class:`SdramBench`.
    progress : callable
        Is told what is being done.

    Returns
    -------
    Frame
        As of :func:`~sim.machine.machine.render_rtl`; its report has ``sdram`` too: bytes moved, the part of the time
        in which data are on its lines, refreshes, and rows opened.

    Raises
    ------
    BuildError, SimulationError
        Also if the picture in the SDRAM is not the one that left the chip.
    """
    with SdramBench(config, clock_mhz=clock_mhz, chip_mhz=chip_mhz, progress=progress) as bench:
        load_image(bench, image, config)
        progress("drawing")
        before = bench.sdram
        frame, _, _ = draw_frame(bench, image, camera, width, height, config=config, background=background)
        done = {name: count - before[name] for name, count in bench.sdram.items()}
        stored = bench.picture(width, height)
    wrong = sum(stored >> shift & 255 != frame.color[..., channel]
                for channel, shift in enumerate((16, 8, 0))).astype(bool).sum()
    if wrong:
        raise SimulationError(f"{wrong} pixels of the picture in the SDRAM are not those that the chip put out")
    frame.report["sdram"] = {"clock_mhz": clock_mhz, "bytes": 4 * (done["reads"] + done["writes"]),
                             "busy": done["data_cycles"] / frame.report["cycles"], "refreshes": done["refreshes"],
                             "activations": done["activations"]}
    return frame
