"""What goes over the pins of an SDRAM, and what its controller is asked for and answers."""

from amaranth.hdl import unsigned
from amaranth.lib import data, enum
from amaranth.lib.wiring import In, Out, Signature

__all__ = ["Command", "access_layout", "answer_layout", "mode_register", "pins_signature"]

#: Words of the longest burst.
MAX_WORDS = 16
PLACE_WIDTH = 4
#: The address bit that means all banks.
ALL_BANKS = 10


class Command(enum.Enum, shape=unsigned(3)):
    """Levels of RAS#, CAS# and WE#, from high to low bit."""

    MODE = 0b000
    REFRESH = 0b001
    PRECHARGE = 0b010
    ACTIVATE = 0b011
    WRITE = 0b100
    READ = 0b101
    NOP = 0b111


def mode_register(cas_latency):
    """Bursts of two columns, sequential, reads and writes alike."""
    return cas_latency << 4 | 1


def pins_signature(chip):
    """The chip's pins, as the FPGA sees them; all outputs come from registers, and ``dq_i`` goes into one.

    ``dq_oe`` is high for cycles in which ``dq_o`` is driven.
    """
    return Signature({
        "cke": Out(1), "cs_n": Out(1), "ras_n": Out(1), "cas_n": Out(1), "we_n": Out(1),
        "ba": Out(chip.bank_width), "a": Out(chip.row_width), "dqm": Out(2),
        "dq_o": Out(16), "dq_oe": Out(1), "dq_i": In(16),
    })


def access_layout(chip, *, tag_width):
    """An access: ``left`` + 1 words from the 32-bit word ``address`` on, all in one row; a write is one word.

    Words read come back with the ``tag``, and with ``place``, which counts on from one to the next.
    """
    return data.StructLayout({"write": 1, "address": chip.word_width, "left": PLACE_WIDTH, "place": PLACE_WIDTH,
                              "tag": tag_width})


def answer_layout(*, tag_width):
    """A word that has been read; ``last`` tells that of an access."""
    return data.StructLayout({"valid": 1, "word": 32, "place": PLACE_WIDTH, "tag": tag_width, "last": 1})
