"""Memories in block RAM."""

from amaranth.hdl import Assert, Module, Signal
from amaranth.lib import data, memory, wiring
from amaranth.lib.wiring import In, Out

__all__ = ["APART", "BlockMemory"]

#: Name of the memory in every :class:`BlockMemory`, by which synthesis knows that its reads and writes keep apart.
APART = "apart"


class BlockMemory(wiring.Component):
    """A memory that is written at one port and read at another, of which no read meets a write to its place.

    Block RAM answers such a read with anything, or needs a table and a flip-flop a bit for an answer. That it does
    not happen is asserted in simulation.

    Latency is 2 cycles, one of them a register behind the memory, whose own output comes late in its cycle (of an ECP5
    it becomes the block RAM's own, see ``boards.netlist``, if nothing but its data is between them); without
    ``registered`` it is 1, and ``data`` stays while ``reading`` is low. Throughput is a read and a write a cycle.

    Parameters
    ----------
    shape : :ref:`shape-like <lang-shapelike>`
        Shape of a row.
    depth : int
        Rows.
    registered : bool
        Whether there is a register behind the memory.

    Members
    -------
    write : ``{"valid", "address", "data"}``
    reading, address : a row is read
    data : the row, ``latency`` cycles later
    """

    def __init__(self, shape, *, depth, registered=True):
        self._shape = shape
        self._depth = depth
        self._registered = registered
        self.latency = 2 if registered else 1
        super().__init__({
            "write": In(data.StructLayout({"valid": 1, "address": range(depth), "data": shape})),
            "reading": In(1),
            "address": In(range(depth)),
            "data": Out(shape),
        })

    def elaborate(self, platform):
        m = Module()
        # Without the attribute what is shallow becomes tables.
        rows = memory.Memory(shape=self._shape, depth=self._depth, init=[], attrs={"ram_style": "block"})
        m.submodules[APART] = rows
        read, write = rows.read_port(), rows.write_port()
        m.d.comb += [
            write.addr.eq(self.write.address),
            write.data.eq(self.write.data),
            write.en.eq(self.write.valid),
            read.addr.eq(self.address),
        ]
        m.d.sync += Assert(~(self.reading & self.write.valid & (self.address == self.write.address)),
                           "a row is read while it is written")
        if self._registered:
            row = Signal(self._shape, reset_less=True)
            m.d.sync += row.eq(read.data)
            m.d.comb += self.data.eq(row)
        else:
            m.d.comb += [read.en.eq(self.reading), self.data.eq(read.data)]
        return m
