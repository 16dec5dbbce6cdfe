"""From words to the bytes of frames."""

from amaranth.hdl import Module, Mux, Signal
from amaranth.lib import data, stream, wiring
from amaranth.lib.crc.catalog import CRC32_ETHERNET
from amaranth.lib.wiring import In, Out

from .protocol import END, ESCAPE, ESCAPED_END, ESCAPED_ESCAPE

__all__ = ["FrameSender", "sent_layout"]


def sent_layout():
    """A word of a frame, of which the first is its header; the ``last`` is followed by the checksum."""
    return data.StructLayout({"word": 32, "last": 1})


class FrameSender(wiring.Component):
    """Puts words between two of END, with a checksum behind them, and escapes what would be one.

    Throughput is a byte in two cycles; a word is taken after its last byte.

    Members
    -------
    i : stream of words
    o : stream of bytes
    """

    def __init__(self):
        super().__init__({"i": In(stream.Signature(sent_layout())), "o": Out(stream.Signature(8))})

    def elaborate(self, platform):
        m = Module()
        m.submodules.crc = crc = CRC32_ETHERNET(8).create()
        place, escapes, checks = Signal(2), Signal(), Signal()
        checksum = Signal(32, reset_less=True)
        chosen, byte, special = Signal(8), Signal(8, reset_less=True), Signal(reset_less=True)
        m.d.comb += [
            chosen.eq(Mux(checks, checksum, self.i.payload.word).word_select(place, 8)),
            crc.data.eq(byte),
        ]
        with m.FSM():
            with m.State("idle"):
                m.d.comb += [self.o.payload.eq(END), self.o.valid.eq(self.i.valid), crc.start.eq(1)]
                m.d.sync += [place.eq(0), checks.eq(0), escapes.eq(0)]
                with m.If(self.i.valid & self.o.ready):
                    m.next = "choose"
            with m.State("choose"):
                m.d.sync += [byte.eq(chosen), special.eq((chosen == END) | (chosen == ESCAPE))]
                with m.If(self.i.valid | checks):
                    m.next = "byte"
            with m.State("byte"):
                m.d.comb += [
                    self.o.valid.eq(1),
                    self.o.payload.eq(Mux(escapes, Mux(byte == END, ESCAPED_END, ESCAPED_ESCAPE),
                                          Mux(special, ESCAPE, byte))),
                ]
                with m.If(self.o.ready):
                    m.d.sync += escapes.eq(special & ~escapes)
                    with m.If(escapes | ~special):
                        m.d.comb += crc.valid.eq(~checks)
                        m.d.sync += place.eq(place + 1)
                        m.next = "choose"
                        with m.If(place == 3):
                            m.next = "word"
            with m.State("word"):
                m.d.comb += self.i.ready.eq(~checks)
                m.next = "choose"
                with m.If(checks):
                    m.next = "end"
                with m.Elif(self.i.payload.last):
                    m.next = "checksum"
            with m.State("checksum"):
                m.d.sync += [checks.eq(1), checksum.eq(crc.crc)]
                m.next = "choose"
            with m.State("end"):
                m.d.comb += [self.o.payload.eq(END), self.o.valid.eq(1)]
                with m.If(self.o.ready):
                    m.next = "idle"
        return m
