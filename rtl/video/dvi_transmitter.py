"""From pixels to the pins of a DVI connector."""

from amaranth.hdl import Cat, DomainRenamer, Module
from amaranth.lib import data, wiring
from amaranth.lib.wiring import In, Out

from .serializer import Serializer
from .tmds_encoder import TmdsEncoder

__all__ = ["NUM_CHANNELS", "DviTransmitter"]

#: Blue, green and red, and the clock
NUM_CHANNELS = 4
#: High for the first five of ten bits
_CLOCK = 0b0000011111


class DviTransmitter(wiring.Component):
    """Three TMDS channels and their clock, as pairs of bits; the syncs are the controls of channel 0.

    Throughput is a pixel a clock of the domain ``pixel``; pairs are of the domain ``shift``, five times as fast.
    Latency is the encoder's 3 pixel clocks and the serialiser's.

    Members
    -------
    color : red, green and blue, 8 bits each, red in the highest
    active : there is a pixel
    h_sync, v_sync : levels of the syncs
    pairs : of channels 0, 1, 2 and the clock, the next two bits
    """

    def __init__(self):
        super().__init__({"color": In(24), "active": In(1), "h_sync": In(1), "v_sync": In(1),
                          "pairs": Out(data.ArrayLayout(2, NUM_CHANNELS))})

    def elaborate(self, platform):
        m = Module()
        m.submodules.serializer = serializer = Serializer(num_channels=NUM_CHANNELS)
        for channel in range(NUM_CHANNELS - 1):
            encoder = TmdsEncoder()
            m.submodules[f"encoder{channel}"] = DomainRenamer("pixel")(encoder)
            m.d.comb += [
                encoder.byte.eq(self.color.word_select(channel, 8)),
                encoder.active.eq(self.active),
                serializer.symbols[channel].eq(encoder.symbol),
            ]
            if channel == 0:
                m.d.comb += encoder.control.eq(Cat(self.h_sync, self.v_sync))
        m.d.comb += [serializer.symbols[NUM_CHANNELS - 1].eq(_CLOCK), self.pairs.eq(serializer.pairs)]
        return m
