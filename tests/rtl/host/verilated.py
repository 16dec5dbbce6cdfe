"""The hardware's side of the link in Verilator, in place of :class:`~sim.host.Board`."""

import ctypes
from pathlib import Path

from rtl.host.host_port import HostPort
from sim.machine.component_build import component_library

__all__ = ["VerilatedBoard"]

_MOST = 1 << 16


class VerilatedBoard:
    """A :class:`~rtl.host.host_port.HostPort` with a memory behind it that takes its time.

    Parameters
    ----------
    num_words, num_registers, num_guarded : int
        See there.
    values : list of int
        What can be read behind registers and counts.
    seed : int
        Of gaps and of the memory's time.

    Attributes
    ----------
    memory, registers, ready, starts
        As :class:`~sim.host.Board` has them.
    """

    def __init__(self, *, num_words, num_registers, values, num_guarded=0, seed=1, progress=lambda text: None):
        word_width = (num_words - 1).bit_length()
        dut = HostPort(word_width=word_width, num_words=num_words, num_registers=num_registers,
                       num_values=len(values), num_guarded=num_guarded)
        self._library = ctypes.CDLL(str(component_library(
            dut, bench=Path(__file__).with_name("board.cpp"), defines={"WORD_WIDTH": word_width}, optimise="-O2",
            progress=progress)))
        self._library.board_new.restype = ctypes.c_void_p
        self._library.board_receive.restype = ctypes.c_int64
        self._board = ctypes.c_void_p(self._library.board_new(ctypes.c_uint64(seed), num_words))
        self._num_registers = num_registers
        self._values = values
        self._memory = {}
        self._answer = (ctypes.c_uint8 * _MOST)()
        self._pairs = (ctypes.c_uint32 * (2 * _MOST))()
        self.ready = True

    def close(self):
        """Ends the simulation."""
        self._library.board_delete(self._board)

    @property
    def ready(self):
        """Whether a picture may be started."""
        return self._ready

    @ready.setter
    def ready(self, ready):
        self._ready = ready
        self._library.board_set(self._board, int(ready), (ctypes.c_uint32 * len(self._values))(*self._values),
                                len(self._values))

    def receive(self, received):
        """Bytes that it answers with, once it has done all that it does."""
        count = self._library.board_receive(self._board, bytes(received), len(received), self._answer, _MOST)
        assert count >= 0, "an assertion of the hardware fails"
        assert not self._counts()[2], "it writes or reads what is not there, starts while it is not ready, or " \
            "answers before words are written"
        return bytes(self._answer[:count])

    def reset(self):
        """A cycle of reset."""
        self.reset_within(0)
        self.receive(b"")

    def reset_within(self, cycles):
        """A reset in so many cycles, whatever goes on then."""
        self._library.board_reset_in(self._board, cycles)

    @property
    def reset_pending(self):
        """Whether it has yet to come."""
        return self._counts()[3] > 0

    @property
    def registers(self):
        """What is set."""
        registers = (ctypes.c_uint32 * self._num_registers)()
        self._library.board_registers(self._board, registers, self._num_registers)
        return list(registers)

    @property
    def memory(self):
        """Words by their addresses."""
        while count := self._library.board_written(self._board, self._pairs, _MOST):
            pairs = self._pairs[:2 * count]
            self._memory.update(zip(pairs[::2], pairs[1::2], strict=True))
        return self._memory

    @property
    def starts(self):
        """How often a picture was started."""
        return self._counts()[1]

    @property
    def words_written(self):
        """How many writes of a word there have been."""
        return self._counts()[4]

    @property
    def cycles(self):
        """How many there have been."""
        return self._counts()[0]

    def _counts(self):
        counts = (ctypes.c_uint64 * 5)()
        self._library.board_counts(self._board, counts)
        return list(counts)
