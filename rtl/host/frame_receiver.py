"""From bytes to frames that are what was sent."""

from amaranth.hdl import Cat, Module, Signal
from amaranth.lib import data, stream, wiring
from amaranth.lib.crc.catalog import CRC32_ETHERNET
from amaranth.lib.wiring import In, Out

from ..block_memory import BlockMemory
from .protocol import END, ESCAPE, ESCAPED_END, MAX_WORDS, OVERHEAD

__all__ = ["MAX_PAYLOAD", "FrameReceiver", "header_layout"]

#: Words of a payload: an address, and what is to be written
MAX_PAYLOAD = MAX_WORDS + 1
_DEPTH = 512


def header_layout():
    """Of a frame: its type and sequence number, how many words its payload has, its checksum, and if it is ``good``."""
    return data.StructLayout({"type": 8, "sequence": 8, "num_words": range(_DEPTH), "checksum": 32, "good": 1})


class FrameReceiver(wiring.Component):
    """Keeps a frame until it is taken, and is deaf as long; then the next one is what begins behind an END.

    A frame is good if its length is as it says and its checksum, CRC-32, right. Frames of fewer bytes than any has are
    ignored. Throughput is a byte a cycle; a frame is there a cycle behind its END.

    Members
    -------
    i : stream of bytes
    frame : stream of headers
    word, reading, address : words of the payload while a frame is there, a cycle later
    missed : the END of a frame has come while it was deaf
    """

    def __init__(self):
        super().__init__({
            "i": In(stream.Signature(8, always_ready=True)),
            "frame": Out(stream.Signature(header_layout())),
            "reading": In(1),
            "address": In(range(_DEPTH)),
            "word": Out(32),
            "missed": Out(1),
        })

    def elaborate(self, platform):
        m = Module()
        m.submodules.payload = payload = BlockMemory(32, depth=_DEPTH, registered=False)
        m.submodules.crc = crc = CRC32_ETHERNET(8).create()
        frame, has_frame = Signal(header_layout(), reset_less=True), Signal()
        # Until an END nobody knows where a frame begins.
        skips, escaped = Signal(init=1), Signal()
        # Bytes, of which no more are counted than make too long a frame
        count, latest = Signal(range(4 * _DEPTH)), Signal(32, reset_less=True)
        length = Signal(16, reset_less=True)
        byte, taken, ends = Signal(8), Signal(), Signal()
        limit = 4 * MAX_PAYLOAD + OVERHEAD + 1
        m.d.comb += [
            # What follows an escape is either of the two that need one.
            byte.eq(self.i.payload),
            ends.eq(self.i.valid & (self.i.payload == END)),
            taken.eq(self.i.valid & (self.i.payload != END) & (self.i.payload != ESCAPE) & ~skips & ~has_frame),
            self.frame.valid.eq(has_frame), self.frame.payload.eq(frame),
            self.missed.eq(ends & has_frame & skips),
            crc.data.eq(byte), crc.valid.eq(taken), crc.start.eq(ends),
            payload.reading.eq(self.reading), payload.address.eq(self.address), self.word.eq(payload.data),
        ]
        with m.If(escaped):
            m.d.comb += byte.eq(END)
            with m.If(self.i.payload != ESCAPED_END):
                m.d.comb += byte.eq(ESCAPE)
        with m.If(self.i.valid):
            m.d.sync += escaped.eq((self.i.payload == ESCAPE) & ~escaped)
        with m.If(taken):
            m.d.sync += latest.eq(Cat(latest[8:], byte))
            with m.If(count != limit):
                m.d.sync += count.eq(count + 1)
            with m.Switch(count):
                with m.Case(0):
                    m.d.sync += frame.type.eq(byte)
                with m.Case(1):
                    m.d.sync += frame.sequence.eq(byte)
                with m.Case(2):
                    m.d.sync += length[:8].eq(byte)
                with m.Case(3):
                    m.d.sync += length[8:].eq(byte)
        # The first word behind the header goes to place 0.
        m.d.comb += [
            payload.write.valid.eq(taken & (count[:2] == 3) & (count[2:] != 0)),
            payload.write.address.eq(count[2:] - 1),
            payload.write.data.eq(Cat(latest[8:], byte)),
        ]
        with m.If(ends):
            m.d.sync += [count.eq(0), skips.eq(0)]
            with m.If(~has_frame & ~skips & (count >= OVERHEAD)):
                m.d.sync += [
                    has_frame.eq(1),
                    frame.good.eq(crc.match_detected & (count == length + OVERHEAD) & (length[:2] == 0)),
                    frame.num_words.eq(length[2:]),
                    frame.checksum.eq(latest),
                ]
        with m.Elif(self.i.valid & has_frame):
            m.d.sync += skips.eq(1)
        with m.If(self.frame.valid & self.frame.ready):
            m.d.sync += has_frame.eq(0)
        return m
