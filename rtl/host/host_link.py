"""A host at the end of a serial cable."""

from amaranth.hdl import Module
from amaranth.lib import wiring
from amaranth.lib.wiring import In, Out

from .host_port import HostPort, host_members
from .uart import UartReceiver, UartTransmitter

__all__ = ["HostLink"]


class HostLink(wiring.Component):
    """A :class:`~.host_port.HostPort` behind a UART.

    Parameters
    ----------
    divisor : int
        Cycles of a bit, see :func:`~.uart.uart_divisor`.
    word_width, num_words, num_registers, num_values, num_guarded : int
        See :class:`~.host_port.HostPort`.

    Members
    -------
    rx, tx : the wires
    write, written, request, data, registers, values, start, ready : see :class:`~.host_port.HostPort`
    """

    def __init__(self, *, divisor, word_width, num_words=None, num_registers=1, num_values=1, num_guarded=0):
        self._divisor = divisor
        self._port = HostPort(word_width=word_width, num_words=num_words, num_registers=num_registers,
                              num_values=num_values, num_guarded=num_guarded)
        self._names = host_members(word_width=word_width, num_registers=num_registers, num_values=num_values)
        super().__init__({"rx": In(1, init=1), "tx": Out(1, init=1), **self._names})

    def elaborate(self, platform):
        m = Module()
        m.submodules.port = port = self._port
        m.submodules.receiver = receiver = UartReceiver(divisor=self._divisor)
        m.submodules.transmitter = transmitter = UartTransmitter(divisor=self._divisor)
        wiring.connect(m, receiver.o, port.i)
        wiring.connect(m, port.o, transmitter.i)
        m.d.comb += [receiver.rx.eq(self.rx), self.tx.eq(transmitter.tx)]
        for name in ("write", "request", "data"):
            inner, outer = getattr(port, name), wiring.flipped(getattr(self, name))
            wiring.connect(m, *((outer, inner) if name == "data" else (inner, outer)))
        for name in ("registers", "start"):
            m.d.comb += getattr(self, name).eq(getattr(port, name))
        for name in ("written", "values", "ready"):
            m.d.comb += getattr(port, name).eq(getattr(self, name))
        return m
