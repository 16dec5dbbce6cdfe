"""Which access goes to the controller next."""

from amaranth.hdl import Assert, Cat, Module, Mux, Signal
from amaranth.lib import stream, wiring
from amaranth.lib.wiring import In, Out

from ..least_recent import LeastRecent, selected
from .commands import access_layout

__all__ = ["Arbiter"]


class Arbiter(wiring.Component):
    """Chooses every other cycle among the accesses for whose bank the controller has room.

    The source served least recently goes first, so that nobody is passed over more than once by each other one in what
    both could have had. Those that are urgent go before all others, but only so often in a row; a batch of writes thus
    stays together, without reads for which the data lines would be turned round.

    Latency is 3 to 4 cycles; throughput an access in two cycles, as fast as single words can move, of which each source
    has at most every other one.

    Parameters
    ----------
    chip : :class:`~.timing.SdramChip`
        For the layout of addresses.
    tag_width : int
        Bits of an access's tag.
    num_sources : int
        How many there are.
    urgent_in_a_row : int
        How often urgent ones go first before another is chosen.

    Members
    -------
    source : array of streams of accesses, which stay until they are taken
    urgent : a bit for each source
    room : from the controller
    access : stream of accesses to the controller
    """

    def __init__(self, *, chip, tag_width, num_sources, urgent_in_a_row=8):
        self._chip = chip
        self._access = access_layout(chip, tag_width=tag_width)
        self._num_sources = num_sources
        self._urgent_in_a_row = urgent_in_a_row
        super().__init__({
            "source": In(stream.Signature(self._access)).array(num_sources),
            "urgent": In(num_sources),
            "room": In(1 << chip.bank_width),
            "access": Out(stream.Signature(self._access)),
        })

    def elaborate(self, platform):
        m = Module()
        low, high = self._chip.column_width - 1, self._chip.column_width - 1 + self._chip.bank_width
        m.submodules.turns = turns = LeastRecent(num_bidders=self._num_sources)
        chooses, is_urgent, in_a_row = Signal(), Signal(), Signal(range(self._urgent_in_a_row + 1))
        able, bids, granted = (Signal(self._num_sources) for _ in range(3))
        m.d.comb += [
            able.eq(Cat(source.valid & self.room.bit_select(source.payload.address[low:high], 1)
                        for source in self.source)),
            turns.bid.eq(bids),
            turns.served.eq(Mux(chooses, turns.grant, 0)),
        ]
        m.d.sync += [chooses.eq(~chooses), granted.eq(0), self.access.valid.eq(granted.any())]
        with m.If(chooses):
            m.d.sync += granted.eq(turns.grant)
            with m.If(bids.any()):
                m.d.sync += in_a_row.eq(Mux(is_urgent, in_a_row + 1, 0))
        with m.Else():
            # Whose access is taken now shows its next one only later.
            first, goes_on = Signal(self._num_sources), Signal()
            m.d.comb += [first.eq(able & self.urgent & ~granted), goes_on.eq((self.urgent & granted).any())]
            m.d.sync += [bids.eq(able & ~granted), is_urgent.eq(0)]
            with m.If((first.any() | goes_on) & (in_a_row != self._urgent_in_a_row)):
                m.d.sync += [bids.eq(first), is_urgent.eq(1)]
        m.d.sync += self.access.payload.eq(selected([(take, source.payload.as_value()) for take, source
                                                     in zip(granted, self.source, strict=True)]))
        m.d.comb += [source.ready.eq(take) for take, source in zip(granted, self.source, strict=True)]
        m.d.sync += Assert(~self.access.valid | self.access.ready, "a bank has less room than it said")
        return m
