"""Bytes over one wire each way: a start bit, eight bits with the lowest first, a stop bit."""

from amaranth.hdl import Cat, Const, Module, Mux, Signal
from amaranth.lib import stream, wiring
from amaranth.lib.cdc import FFSynchronizer
from amaranth.lib.wiring import In, Out

__all__ = ["UartReceiver", "UartTransmitter", "uart_divisor"]

#: Both ends together may be off by half a bit in ten, of which each gets less than a half.
_TOLERANCE = 0.02
_FRAME = 10
_MIN_DIVISOR = 4


def uart_divisor(*, clock_hz, baud):
    """Clocks of a bit.

    Raises
    ------
    ValueError
        If whole clocks do not make the rate.
    """
    divisor = max(1, round(clock_hz / baud))
    error = clock_hz / divisor / baud - 1
    if divisor < _MIN_DIVISOR or abs(error) > _TOLERANCE:
        raise ValueError(f"{baud:g} baud at {clock_hz / 1e6:g} MHz: {divisor} clocks a bit are {error:+.1%} off; it "
                         f"must be within {_TOLERANCE:.0%}, and at least {_MIN_DIVISOR} clocks")
    return divisor


class UartReceiver(wiring.Component):
    """Bytes from a wire; one whose stop bit is not high is dropped, and none begins before the wire is high again.

    Throughput is a byte in 10 · ``divisor`` cycles, of which half a bit less is enough; a byte comes in the middle of
    its stop bit.

    Parameters
    ----------
    divisor : int
        Cycles of a bit.

    Members
    -------
    rx : the wire, of no clock
    o : stream of bytes, which nobody may refuse
    """

    def __init__(self, *, divisor):
        self._divisor = divisor
        super().__init__({"rx": In(1, init=1), "o": Out(stream.Signature(8, always_ready=True))})

    def elaborate(self, platform):
        m = Module()
        level, before = Signal(init=1), Signal()
        m.submodules.synchronizer = FFSynchronizer(self.rx, level, init=1)
        left, wait = Signal(range(_FRAME + 1)), Signal(range(self._divisor))
        bits = Signal(8, reset_less=True)
        m.d.comb += self.o.payload.eq(bits)
        m.d.sync += [before.eq(level), self.o.valid.eq(0)]
        with m.If(left == 0):
            # From the edge of the start bit to its middle, two cycles of which have passed.
            m.d.sync += wait.eq(max(0, self._divisor // 2 - 2))
            with m.If(before & ~level):
                m.d.sync += left.eq(_FRAME)
        with m.Elif(wait != 0):
            m.d.sync += wait.eq(wait - 1)
        with m.Else():
            m.d.sync += [wait.eq(self._divisor - 1), left.eq(left - 1)]
            with m.If(left == _FRAME):
                # A spike is no start bit.
                with m.If(level):
                    m.d.sync += left.eq(0)
            with m.Elif(left == 1):
                m.d.sync += self.o.valid.eq(level)
            with m.Else():
                m.d.sync += bits.eq(Cat(bits[1:], level))
        return m


class UartTransmitter(wiring.Component):
    """Bytes to a wire, one in 10 · ``divisor`` cycles.

    Parameters
    ----------
    divisor : int
        Cycles of a bit.

    Members
    -------
    i : stream of bytes
    tx : the wire, from a register
    """

    def __init__(self, *, divisor):
        self._divisor = divisor
        super().__init__({"i": In(stream.Signature(8)), "tx": Out(1, init=1)})

    def elaborate(self, platform):
        m = Module()
        bits, left, wait = Signal(_FRAME, init=-1), Signal(range(_FRAME + 1)), Signal(range(self._divisor))
        m.d.comb += [self.i.ready.eq((left == 0) | (left == 1) & (wait == 0)), self.tx.eq(bits[0])]
        m.d.sync += wait.eq(Mux(wait == 0, self._divisor - 1, wait - 1))
        with m.If(self.i.ready):
            m.d.sync += [left.eq(0), bits.eq(-1)]
            with m.If(self.i.valid):
                m.d.sync += [bits.eq(Cat(Const(0, 1), self.i.payload, Const(1, 1))), left.eq(_FRAME),
                             wait.eq(self._divisor - 1)]
        with m.Elif(wait == 0):
            m.d.sync += [bits.eq(Cat(bits[1:], Const(1, 1))), left.eq(left - 1)]
        return m
