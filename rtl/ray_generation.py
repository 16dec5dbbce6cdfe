"""The ray generation controller: which packet a free thread takes next."""

from amaranth.hdl import Cat, Module, Mux, Signal, signed
from amaranth.lib import data, memory, stream, wiring
from amaranth.lib.wiring import In, Out

from .layout import PACKET_RAYS, thread_width, token_layout, with_token
from .queue import Queue

__all__ = ["TILE_BITS", "RayGeneration", "packet_order"]

#: A tile is a square of 2**TILE_BITS packets a side.
TILE_BITS = 3


def packet_order(width, height):
    """The packets of a picture in the order in which they are begun: pixel (x, y) of ray 0 of each.

    Tiles go row by row, packets of a tile along a Morton curve, so that packets at work together are close.
    """
    side = 2 << TILE_BITS
    for tile_y in range(0, height, side):
        for tile_x in range(0, width, side):
            for number in range(1 << 2 * TILE_BITS):
                x = tile_x + 2 * sum((number >> 2 * bit & 1) << bit for bit in range(TILE_BITS))
                y = tile_y + 2 * sum((number >> 2 * bit + 1 & 1) << bit for bit in range(TILE_BITS))
                if x < width and y < height:
                    yield x, y


class RayGeneration(wiring.Component):
    """Hands the packets of a picture to threads, a new one to each that has finished.

    Parameters
    ----------
    num_threads, stack_depth, coord_width : int
        See :class:`~rtl.config.ChipConfig`.

    Members
    -------
    width, height : size of the picture in pixels
    start : begin a picture; ``ready`` must be set
    ready : no picture is at work
    primary : stream of ``{"token", "x", "y"}``: a packet, see :class:`~rtl.transformation.Transformation`
    begin : ``{"valid", "thread"}``: the thread begins a packet
    finished : stream of tokens: the thread has nothing more to do
    position_address, position : a thread; pixel ``{"x", "y"}`` of its ray 0, combinational
    """

    def __init__(self, *, num_threads, stack_depth, coord_width):
        self._num_threads = num_threads
        self._token = token = token_layout(num_threads=num_threads, stack_depth=stack_depth)
        self._coord_width = coord_width
        self._position = data.StructLayout({"x": coord_width, "y": coord_width})
        half = signed(coord_width + 2)
        super().__init__({
            "width": In(coord_width),
            "height": In(coord_width),
            "start": In(1),
            "ready": Out(1),
            "primary": Out(stream.Signature(with_token(token, x=half, y=half))),
            "begin": Out(data.StructLayout({"valid": 1, "thread": thread_width(num_threads)})),
            "finished": In(stream.Signature(token, always_ready=True)),
            "position_address": In(thread_width(num_threads)),
            "position": Out(self._position),
        })

    def elaborate(self, platform):
        m = Module()
        threads = self._num_threads
        m.submodules.free = free = Queue(thread_width(threads), depth=threads, always_ready=True)
        m.submodules.positions = positions = memory.Memory(
            shape=self._position, depth=1 << thread_width(threads), init=[])
        write, read = positions.write_port(), positions.read_port(domain="comb")

        # At first every thread is free without having finished anything.
        unused = Signal(range(threads + 1), init=threads)
        at_work = Signal(range(threads + 1))
        thread = Signal(thread_width(threads))
        available = Signal()
        m.d.comb += [
            free.i.payload.eq(self.finished.payload.thread),
            free.i.valid.eq(self.finished.valid),
            thread.eq(Mux(unused.any(), unused - 1, free.o.payload)),
            available.eq(unused.any() | free.o.valid),
        ]

        side = 2 << TILE_BITS
        tile_x, tile_y = Signal(self._coord_width + 1), Signal(self._coord_width + 1)
        number = Signal(2 * TILE_BITS)
        x, y = Signal(self._coord_width + 1), Signal(self._coord_width + 1)
        drawing = Signal()
        inside = Signal()
        issued = Signal()
        advance = Signal()
        m.d.comb += [
            x.eq(tile_x + Cat(0, number[0::2])),
            y.eq(tile_y + Cat(0, number[1::2])),
            inside.eq((x < self.width) & (y < self.height)),
            self.primary.valid.eq(drawing & inside & available),
            issued.eq(self.primary.valid & self.primary.ready),
            advance.eq(issued | drawing & ~inside),
            free.o.ready.eq(issued & ~unused.any()),
            self.primary.payload.token.thread.eq(thread),
            self.primary.payload.x.eq(2 * x + 1 - self.width),
            self.primary.payload.y.eq(self.height - 1 - 2 * y),
            self.begin.valid.eq(issued),
            self.begin.thread.eq(thread),
            write.addr.eq(thread),
            write.data.x.eq(x),
            write.data.y.eq(y),
            write.en.eq(issued),
            read.addr.eq(self.position_address),
            self.position.eq(read.data),
            self.ready.eq(~drawing & ~at_work.any()),
        ]
        for ray in range(PACKET_RAYS):
            m.d.comb += self.primary.payload.token.mask[ray].eq(
                (x + (ray & 1) < self.width) & (y + (ray >> 1) < self.height))
        m.d.sync += at_work.eq(at_work + issued - self.finished.valid)
        with m.If(issued & unused.any()):
            m.d.sync += unused.eq(unused - 1)
        with m.If(self.start):
            m.d.sync += [drawing.eq(1), tile_x.eq(0), tile_y.eq(0), number.eq(0)]
        with m.Elif(advance):
            m.d.sync += number.eq(number + 1)
            with m.If(number.all()):
                m.d.sync += tile_x.eq(tile_x + side)
                with m.If(tile_x + side >= self.width):
                    m.d.sync += [tile_x.eq(0), tile_y.eq(tile_y + side)]
                    with m.If(tile_y + side >= self.height):
                        m.d.sync += drawing.eq(0)
        return m
