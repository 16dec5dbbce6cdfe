"""Transition-minimised differential signalling: from bytes to ten bits."""

from amaranth.hdl import Cat, Module, Mux, Signal, signed
from amaranth.lib import wiring
from amaranth.lib.wiring import In, Out

__all__ = ["TmdsEncoder"]

#: Figure 3-5 of the specification, by C1 and C0, last bit first
_CONTROLS = (0b1101010100, 0b0010101011, 0b0101010100, 0b1010101011)


class TmdsEncoder(wiring.Component):
    """A channel's symbol of a byte, with few transitions and as many ones as zeros in the long run, or of two controls.

    With N1 the ones of byte ``d``, q₀ = d₀, qᵢ = qᵢ₋₁ ⊕ dᵢ and q₈ = 1, or qᵢ = ¬(qᵢ₋₁ ⊕ dᵢ) and q₈ = 0 if N1 > 4 or
    N1 = 4 and d₀ = 0. Then q₇…q₀ is inverted, and the last bit set, if that takes the running disparity towards zero.

    Latency 3 cycles, throughput a symbol a cycle. Source: DDWG, *Digital Visual Interface*, revision 1.0, §3.2.

    Members
    -------
    byte : what to send if ``active``
    control : two bits to send if not
    symbol : ten bits, of which bit 0 goes first
    """

    #: In cycles
    latency = 3

    def __init__(self):
        super().__init__({"byte": In(8), "active": In(1), "control": In(2), "symbol": Out(10)})

    def elaborate(self, platform):
        m = Module()
        # First, which of two chains has fewer transitions.
        byte, active, control = Signal(8, reset_less=True), Signal(2), Signal(4, reset_less=True)
        ones, inverts = Signal(range(9)), Signal(reset_less=True)
        m.d.comb += ones.eq(sum(self.byte[bit] for bit in range(8)))
        m.d.sync += [
            byte.eq(self.byte),
            inverts.eq((ones > 4) | (ones == 4) & ~self.byte[0]),
            active.eq(Cat(self.active, active[0])),
            control.eq(Cat(self.control, control[:2])),
        ]
        # Then the chain, and the ones in it.
        chain, word, excess = Signal(8), Signal(9, reset_less=True), Signal(signed(5), reset_less=True)
        m.d.comb += chain[0].eq(byte[0])
        for bit in range(1, 8):
            m.d.comb += chain[bit].eq(chain[bit - 1] ^ byte[bit] ^ inverts)
        count = Signal(range(9))
        m.d.comb += count.eq(sum(chain[bit] for bit in range(8)))
        # More ones than zeros
        m.d.sync += [word.eq(Cat(chain, ~inverts)), excess.eq((count << 1) - 8)]
        # Last, whether it is inverted.
        disparity, flips = Signal(signed(6)), Signal()
        symbol = Signal(10, init=_CONTROLS[0])
        m.d.comb += self.symbol.eq(symbol)
        with m.If((disparity == 0) | (excess == 0)):
            m.d.comb += flips.eq(~word[8])
        with m.Else():
            m.d.comb += flips.eq((disparity < 0) == (excess < 0))
        # The two last bits have 2 q₈ − 1 + 2 flips − 1 ones more than zeros.
        ends = Signal(signed(3))
        m.d.comb += ends.eq((word[8] << 1) + (flips << 1) - 2)
        with m.If(active[1]):
            m.d.sync += [
                symbol.eq(Cat(word[:8] ^ flips.replicate(8), word[8], flips)),
                disparity.eq(disparity + Mux(flips, -excess, excess) + ends),
            ]
        with m.Else():
            m.d.sync += disparity.eq(0)
            with m.Switch(control[2:]):
                for value, bits in enumerate(_CONTROLS):
                    with m.Case(value):
                        m.d.sync += symbol.eq(bits)
        return m
