"""Delay by a fixed number of cycles."""

from amaranth.hdl import Module, Mux, Shape, Signal, Value
from amaranth.lib import memory, wiring
from amaranth.lib.wiring import In, Out

__all__ = ["Delay"]


class Delay(wiring.Component):
    """o(t) = i(t - cycles).

    Flip-flops for a short delay; for a long one a memory that is read just ahead of where it is written. What comes
    out before the first value went in is undefined.

    Parameters
    ----------
    shape : shape-like
        Shape of the value.
    cycles : int
        Cycles from ``i`` to ``o``; none is a wire.
    memory_from : int or None
        Cycles from which on a memory is used, at least 2. By default 5, and 17 for less than four bits, where a memory
        of ECP5, 16 deep and 4 wide, and its counter save nothing.
    registered : bool
        Whether what comes out of a memory comes out of flip-flops behind it, at the beginning of its cycle.

    Members
    -------
    i : In(shape)
        Value.
    o : Out(shape)
        The same, ``cycles`` later.

    Raises
    ------
    ValueError
        If ``cycles`` is negative or ``memory_from`` is less than 2.
    """

    def __init__(self, shape, *, cycles, memory_from=None, registered=False):
        if cycles < 0:
            raise ValueError(f"Delay must not be negative, but is {cycles!r} cycles")
        if memory_from is None:
            memory_from = 5 if Shape.cast(shape).width >= 4 else 17
        if memory_from < 2:
            raise ValueError(f"A memory delays by at least 2 cycles, not {memory_from!r}")
        self.cycles = cycles
        self._uses_memory = cycles >= memory_from
        self._registered = registered
        super().__init__({"i": In(shape), "o": Out(shape)})

    def elaborate(self, platform):
        m = Module()
        if self._uses_memory:
            self._remember(m)
        else:
            value = Value.cast(self.i)
            for _ in range(self.cycles):
                following = Signal(value.shape(), name="stage", reset_less=True)
                m.d.sync += following.eq(value)
                value = following
            m.d.comb += Value.cast(self.o).eq(value)
        return m

    def _remember(self, m):
        depth = self.cycles - self._registered
        m.submodules.memory = ring = memory.Memory(shape=Shape.cast(self.i.shape()), depth=depth, init=[])
        write, read = ring.write_port(), ring.read_port(domain="comb" if self._registered else "sync")
        position = Signal(range(depth), reset_less=True)
        following = Signal.like(position)
        m.d.comb += [
            following.eq(Mux(position == depth - 1, 0, position + 1)),
            write.addr.eq(position), write.data.eq(self.i), write.en.eq(1),
        ]
        m.d.sync += position.eq(following)
        if self._registered:
            # The oldest value, while it is being replaced.
            oldest = Signal.like(Value.cast(self.o), name="oldest", reset_less=True)
            m.d.comb += [read.addr.eq(position), Value.cast(self.o).eq(oldest)]
            m.d.sync += oldest.eq(read.data)
        else:
            # The oldest value, to be replaced in the next cycle: never the one being written.
            m.d.comb += [read.addr.eq(following), self.o.eq(read.data)]
