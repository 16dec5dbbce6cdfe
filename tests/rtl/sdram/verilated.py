"""A memory system in Verilator under random traffic, with a chip that refuses what its datasheet forbids."""

import ctypes
from ctypes import c_char_p, c_double, c_uint32, c_uint64, c_void_p
from pathlib import Path

from rtl.sdram.memory import SdramMemory
from rtl.sdram.timing import SLOWEST, SdramTiming
from sim.machine.component_build import component_library

__all__ = ["NUM_WORDS", "PARTS", "Soak"]

NUM_WORDS = 1 << SLOWEST.word_width
#: In the order of ``sdram_chip.h``.
PARTS = ("AS4C16M16SA-6", "AS4C16M16SA-7", "MT48LC16M16A2-75")


class _Counts(ctypes.Structure):
    _fields_ = [(name, c_uint64) for name in (
        "accesses", "cycles", "errors", "violations", "refreshes", "activations", "read_words", "written_words",
        "shown_words", "data_cycles", "underruns", "longest_wait")]


class Soak:
    """A memory system with readers of lines of so many ``words`` each, writers, and perhaps a display.

    Parameters
    ----------
    words : list of int
        Words of a line, for each reader.
    num_writers : int
        Streams of words to write.
    display : bool
        Whether there is a display.
    clock_mhz : float
        Clock of both.
    part : str
        One of :data:`PARTS`.
    chip_mhz : float, optional
        Another clock by which the chip judges.
    seed : int
        Of the traffic.
    """

    def __init__(self, words, *, num_writers=0, display=False, clock_mhz=125.0, part="MT48LC16M16A2-75", chip_mhz=None,
                 seed=1, optimise="-O2", progress=lambda text: None):
        readers = {f"r{number}": (each, (NUM_WORDS // each - 1).bit_length()) for number, each in enumerate(words)}
        dut = SdramMemory(timing=SdramTiming(SLOWEST, clock_mhz=clock_mhz), readers=readers,
                          num_writers=num_writers, display=display)
        ports = "".join([*(f"READER({number})" for number in range(len(words))),
                         *(f"WRITER({number})" for number in range(num_writers))])
        path = component_library(dut, bench=Path(__file__).with_name("soak.cpp"), optimise=optimise, progress=progress,
                                 defines={"SOAK_PORTS": ports, "SOAK_DISPLAY": int(display)})
        self._library = library = ctypes.CDLL(str(path))
        library.soak_new.restype = c_void_p
        library.soak_message.restype = c_char_p
        self.clock_mhz = clock_mhz
        self._soak = c_void_p(library.soak_new(
            PARTS.index(part), c_double(1000 / (chip_mhz or clock_mhz)), c_uint64(seed),
            (c_uint32 * len(words))(*words), len(words), num_writers))

    def close(self):
        """Ends the simulation."""
        self.last_message = self.message
        self._library.soak_delete(self._soak)

    def __enter__(self):
        return self

    def __exit__(self, *exception):
        self.close()

    def read(self, reader, *, rate, sequential=False, first=0, count=NUM_WORDS):
        """Lets a reader ask for lines of a region with so much probability a cycle."""
        self._library.soak_reader(self._soak, reader, c_double(rate), c_uint32(sequential), c_uint32(first),
                                  c_uint32(count))

    def write(self, writer, *, rate, sequential=False, first=0, count=NUM_WORDS):
        """Lets a writer write words of a region with so much probability a cycle."""
        self._library.soak_writer(self._soak, writer, c_double(rate), c_uint32(sequential), c_uint32(first),
                                  c_uint32(count))

    def show(self, *, bits, first=0):
        """Shows 640×480 at 60 Hz, with so many bits a pixel."""
        self._library.soak_display(self._soak, c_double(25.175 / self.clock_mhz), c_uint32(32 // bits),
                                   c_uint32(first), c_uint32(640 * 480 * bits // 32))

    def damage(self, address):
        """Changes a word in the chip."""
        self._library.soak_damage(self._soak, c_uint32(address))

    def run(self, accesses, *, max_cycles=1 << 62, finish=False):
        """Does so many accesses more; ends at the first that is wrong. Returns all counts until now."""
        failed = self._library.soak_run(self._soak, c_uint64(accesses), c_uint64(max_cycles), int(finish))
        counts = _Counts()
        self._library.soak_counts(self._soak, ctypes.byref(counts))
        assert not failed, f"an assertion of the memory fails in cycle {counts.cycles}"
        return {name: getattr(counts, name) for name, _ in counts._fields_}

    @property
    def message(self):
        """What went wrong first, if anything did."""
        return self._library.soak_message(self._soak).decode()
