"""The threads of a pipeline: a new packet to each that has finished."""

from amaranth.hdl import Module, Mux, Signal, signed
from amaranth.lib import data, memory, stream, wiring
from amaranth.lib.wiring import In, Out

from .layout import thread_width, token_layout, with_token
from .queue import Queue
from .ray_generation import packet_layout

__all__ = ["Threads"]


class Threads(wiring.Component):
    """Gives packets to threads, and remembers where in the picture they are.

    Parameters
    ----------
    num_threads, stack_depth, coord_width : int
        See :class:`~rtl.config.ChipConfig`.
    num_readers : int
        Positions that can be read at a time.

    Members
    -------
    width, height : size of the picture in pixels
    ready : no packet is at work
    packet : stream of :func:`~rtl.ray_generation.packet_layout`
    primary : stream of ``{"token", "x", "y"}``: the packet, see :class:`~rtl.transformation.Transformation`
    begin : ``{"valid", "thread"}``: the thread begins a packet
    finished : stream of tokens: the thread has nothing more to do
    position_address, position : for each reader, a thread; pixel ``{"x", "y"}`` of its ray 0, combinational
    """

    def __init__(self, *, num_threads, stack_depth, coord_width, num_readers=1):
        self._num_threads = num_threads
        self._token = token = token_layout(num_threads=num_threads, stack_depth=stack_depth)
        self._position = data.StructLayout({"x": coord_width, "y": coord_width})
        half = signed(coord_width + 2)
        super().__init__({
            "width": In(coord_width),
            "height": In(coord_width),
            "ready": Out(1),
            "packet": In(stream.Signature(packet_layout(coord_width))),
            "primary": Out(stream.Signature(with_token(token, x=half, y=half))),
            "begin": Out(data.StructLayout({"valid": 1, "thread": thread_width(num_threads)})),
            "finished": In(stream.Signature(token, always_ready=True)),
            "position_address": In(thread_width(num_threads)).array(num_readers),
            "position": Out(self._position).array(num_readers),
        })

    def elaborate(self, platform):
        m = Module()
        threads = self._num_threads
        m.submodules.free = free = Queue(thread_width(threads), depth=threads, always_ready=True)
        # So that who makes packets does not wait within a cycle for who draws them.
        m.submodules.packets = packets = Queue(self.packet.payload.shape(), depth=2)
        wiring.connect(m, wiring.flipped(self.packet), packets.i)
        m.submodules.positions = positions = memory.Memory(
            shape=self._position, depth=1 << thread_width(threads), init=[])
        write = positions.write_port()

        # At first every thread is free without having finished anything.
        unused = Signal(range(threads + 1), init=threads)
        at_work = Signal(range(threads + 1))
        thread = Signal(thread_width(threads))
        available, issued = Signal(), Signal()
        packet = packets.o.payload
        m.d.comb += [
            free.i.payload.eq(self.finished.payload.thread),
            free.i.valid.eq(self.finished.valid),
            thread.eq(Mux(unused.any(), unused - 1, free.o.payload)),
            available.eq(unused.any() | free.o.valid),
            self.primary.valid.eq(packets.o.valid & available),
            packets.o.ready.eq(self.primary.ready & available),
            issued.eq(self.primary.valid & self.primary.ready),
            free.o.ready.eq(issued & ~unused.any()),
            self.primary.payload.token.thread.eq(thread),
            self.primary.payload.token.mask.eq(packet.mask),
            self.primary.payload.x.eq(2 * packet.x + 1 - self.width),
            self.primary.payload.y.eq(self.height - 1 - 2 * packet.y),
            self.begin.valid.eq(issued),
            self.begin.thread.eq(thread),
            write.addr.eq(thread),
            write.data.x.eq(packet.x),
            write.data.y.eq(packet.y),
            write.en.eq(issued),
            self.ready.eq(~at_work.any() & ~packets.o.valid),
        ]
        for address, position in zip(self.position_address, self.position, strict=True):
            read = positions.read_port(domain="comb")
            m.d.comb += [read.addr.eq(address), position.eq(read.data)]
        m.d.sync += at_work.eq(at_work + issued - self.finished.valid)
        with m.If(issued & unused.any()):
            m.d.sync += unused.eq(unused - 1)
        return m
