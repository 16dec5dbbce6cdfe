"""From linear colours to the frame buffer's bytes."""

from amaranth.hdl import Cat, Module, Mux, Signal
from amaranth.lib import data, memory, wiring
from amaranth.lib.wiring import In, Out

from .color_unit import COLOR_WIDTH
from .microcode import COLOR_FRAC_BITS
from .srgb import DARK_BITS, DARK_SHIFT, LIGHT_SHIFT, bright_bytes, dark_bytes

__all__ = ["Encode"]


class Encode(wiring.Component):
    """sRGB-encoded bytes of three colours, by table (IEC 61966-2-1); three a clock, ``latency`` cycles later.

    A colour c in units of 2^-16 becomes 255 from 1 on, dark_bytes()[c >> 2] below 1/16, else bright_bytes()[c >> 6].

    Members
    -------
    color : three colours, 8 integer and 16 fraction bits
    encoded : a byte for each

    Attributes
    ----------
    latency : int
        Cycles from ``color`` to ``encoded``.
    """

    latency = 2

    def __init__(self):
        super().__init__({"color": In(data.ArrayLayout(COLOR_WIDTH, 3)), "encoded": Out(data.ArrayLayout(8, 3))})

    def elaborate(self, platform):
        m = Module()
        table = [*dark_bytes(), *bright_bytes()]
        m.submodules.table = rom = memory.Memory(shape=8, depth=len(table), init=table)
        for number, color in enumerate(self.color):
            read = rom.read_port()
            is_dark, is_over = Signal(name=f"is_dark{number}"), Signal(name=f"is_over{number}")
            encoded = Signal(8, name=f"encoded{number}", reset_less=True)
            bright = color[LIGHT_SHIFT:COLOR_FRAC_BITS]
            m.d.comb += [
                is_dark.eq(~color[DARK_BITS:].any()),
                is_over.eq(color[COLOR_FRAC_BITS:].any()),
                # The brightest place of the table is 255.
                read.addr.eq(Mux(is_dark, color[DARK_SHIFT:DARK_BITS],
                                 Cat(bright | is_over.replicate(len(bright)), ~is_dark))),
                self.encoded[number].eq(encoded),
            ]
            m.d.sync += encoded.eq(read.data)
        return m
