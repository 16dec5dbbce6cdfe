"""The simulated board, driven from Python a frame at a time."""

import ctypes
import signal
import threading
from ctypes import POINTER, c_int32, c_uint32, c_uint64

import numpy as np

from rtl.dynrtc import counter_names
from rtl.layout import thread_width
from rtl.memory_ports import memory_ports
from rtl.observation import UNITS
from rtl.write_out import pixel_layout

from .build import chip_library
from .simulation import Simulation

__all__ = ["MEMORIES", "Bench", "HangError", "SimulationError"]

#: A chip's memories, in the order in which the bench numbers them; not every chip has the last.
MEMORIES = ("nodes", "lists", "matrices", "shading", "textures")

_HUNG, _OUT_OF_CYCLES, _BAD_ADDRESS, _BAD_PIXEL, _INTERRUPTED, _ASSERTION, _VIOLATION = range(1, 8)


class SimulationError(Exception):
    """The simulated chip did something that it must not."""


class HangError(SimulationError):
    """The simulated chip stands still; the message names threads and the units that hold them."""


def _array(array, kind):
    return array.ctypes.data_as(POINTER(kind))


class Bench(Simulation):
    """A Verilated chip with its memories.

    Parameters
    ----------
    config : ChipConfig
        The chip.
    latency : int
        Cycles from a request to the first word of a line.
    jitter : int
        Up to so many cycles more, drawn for each line; then the memories also pause between words and refuse
        requests at random, and so does the receiver of pixels.
    seed : int
        Of that randomness.
    trace : str
        ``"vcd"``, ``"fst"``, or nothing for a faster chip without waveforms.
    progress : callable
        Is told what is being compiled, if anything is.

    Raises
    ------
    BuildError
        If the chip cannot be compiled.
    """

    def __init__(self, config, *, latency=4, jitter=0, seed=1, trace="", progress=lambda text: None):
        self._config = config
        self._library = library = ctypes.CDLL(str(chip_library(config, trace=trace, progress=progress)))
        library.bench_new.restype = ctypes.c_void_p
        for name in ("cycle", "words_read"):
            getattr(library, f"bench_{name}").restype = c_uint64
        self._bench = ctypes.c_void_p(library.bench_new())
        self._memories = {}
        for number in range(len(MEMORIES)):
            library.bench_latency(self._bench, number, c_uint32(latency), c_uint32(jitter), c_uint32(seed))

    def load(self, name, words):
        """Puts ``words`` (uint32) into one of :data:`MEMORIES`."""
        words_at_once, _ = memory_ports(self._config)[name]
        # A line may reach past the last item.
        padded = np.zeros(-(-max(words.size, 1) // words_at_once) * words_at_once, np.uint32)
        padded[:words.size] = words.reshape(-1)
        self._memories[name] = padded
        self._library.bench_memory(self._bench, MEMORIES.index(name), _array(padded, c_uint32),
                                   c_uint64(padded.size), c_uint32(words_at_once))

    def write(self, name, first, words):
        """Changes words of a memory that is loaded, from the word numbered ``first`` on.

        Raises
        ------
        SimulationError
            If they do not all lie in the memory.
        """
        memory, words = self._memories.get(name, np.empty(0)), np.ravel(words)
        if not 0 <= first <= memory.size - words.size:
            raise SimulationError(f"words {first} to {first + words.size - 1} are not all in the memory '{name}', "
                                  f"which has {memory.size}")
        memory[first:first + words.size] = words

    def trace(self, path, *, first=0, last=1 << 62):
        """Writes a waveform of the cycles from ``first`` to before ``last``, counted from now."""
        if not self._library.bench_trace(self._bench, str(path).encode(), c_uint64(first), c_uint64(last)):
            raise SimulationError(f"waveform {path} cannot be opened")

    def draw(self, *, camera, root, width, height, background, max_cycles=1 << 40, hang_cycles=None):
        """Draws one picture.

        Returns
        -------
        pixels : uint32[height, width, words]
            Each pixel as the chip put it out.
        written, begun : uint64[height, width], uint64[packets]
            The cycle in which each pixel left the chip, and each packet was begun, from the start of the picture.

        Raises
        ------
        HangError
            If no unit took anything in for ``hang_cycles`` cycles. Default: 20,000, and 200,000 with a shader,
            in which all rays may be at work for long before any of them is traced.
        SimulationError
            If an assertion of the chip fails, it reads beyond a memory or writes beyond the picture, or the
            picture takes more than ``max_cycles``.
        KeyboardInterrupt
            If the user interrupts.
        """
        library, config = self._library, self._config
        hang_cycles = hang_cycles or (20_000 if config.shader is None else 200_000)
        layout = pixel_layout(fmt=config.fmt, index_width=config.index_width, coord_width=config.coord_width)
        words = -(-layout.size // 32)
        pixels = np.zeros((height, width, words), np.uint32)
        written = np.zeros((height, width), np.uint64)
        begun = np.zeros(-(-width // 2) * -(-height // 2), np.uint64)
        camera = np.ascontiguousarray(camera, np.uint32)
        library.bench_picture(self._bench, _array(camera, c_uint32), c_uint32(root), c_uint32(width),
                              c_uint32(height), c_uint32(background))
        arguments = (self._bench, c_uint64(max_cycles), c_uint64(hang_cycles), c_uint32(config.coord_width),
                     c_uint32(thread_width(config.num_threads)), c_uint32(width), c_uint32(height),
                     c_uint32(words), _array(pixels, c_uint32), _array(written, c_uint64), _array(begun, c_uint64),
                     c_uint32(len(begun)))
        status = self._interruptible(lambda: library.bench_run(*arguments))
        if status == _INTERRUPTED:
            raise KeyboardInterrupt
        if status == _HUNG:
            raise HangError(f"the chip stands still since cycle {self.cycle - hang_cycles}: {self._whereabouts()}")
        if status:
            raise SimulationError({
                _OUT_OF_CYCLES: f"the picture is not done after {max_cycles} cycles: {self._whereabouts()}",
                _BAD_ADDRESS: f"the chip reads beyond a memory in cycle {self.cycle}",
                _BAD_PIXEL: f"the chip writes a pixel outside of the picture in cycle {self.cycle}",
                _ASSERTION: f"an assertion of the chip fails in cycle {self.cycle}",
                _VIOLATION: f"the SDRAM refuses: {self._violation()}",
            }[status])
        return pixels, written, begun

    def _interruptible(self, function):
        """Calls ``function`` such that Ctrl-C is noticed while it runs."""
        if threading.current_thread() is not threading.main_thread():
            return function()
        result = []
        worker = threading.Thread(target=lambda: result.append(function()))
        before = signal.signal(signal.SIGINT, lambda *_: self._library.bench_interrupt(self._bench))
        try:
            worker.start()
            while worker.is_alive():
                worker.join(0.1)
        finally:
            signal.signal(signal.SIGINT, before)
        return result[0]

    def _violation(self):
        """What a memory with rules of its own refused; these have none."""
        return ""

    def _whereabouts(self):
        num_slots = 64 * self._config.num_pipelines
        units, cycles = np.full(num_slots, -1, np.int32), np.zeros(num_slots, np.uint64)
        self._library.bench_threads(self._bench, _array(units, c_int32), _array(cycles, c_uint64))
        several = self._config.num_pipelines > 1
        stuck = [f"{f'pipeline {slot // 64}, ' if several else ''}thread {slot % 64} in {UNITS[unit]} since cycle "
                 f"{cycles[slot]}" for slot, unit in enumerate(units) if unit >= 0]
        return "; ".join(stuck) if stuck else "no thread has been begun"

    @property
    def cycle(self):
        """Clock cycles simulated so far."""
        return int(self._library.bench_cycle(self._bench))

    @property
    def counters(self):
        """The chip's counters, by name."""
        names = counter_names(self._config)
        values = np.zeros(len(names), np.uint32)
        self._library.bench_counters(self._bench, _array(values, c_uint32), c_uint32(len(values)))
        return dict(zip(names, values.tolist(), strict=True))

    @property
    def bytes_read(self):
        """Bytes that each memory has delivered."""
        return {name: 4 * int(self._library.bench_words_read(self._bench, number))
                for number, name in enumerate(MEMORIES) if name in memory_ports(self._config)}
