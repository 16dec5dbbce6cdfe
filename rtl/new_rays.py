"""Where the rays of a packet begin in the shader."""

from amaranth.hdl import Module, Signal, signed
from amaranth.lib import data, stream, wiring
from amaranth.lib.wiring import In, Out

from fpu import Delay, IntToFloat

from .layout import PACKET_RAYS, thread_width, token_layout, with_token
from .lowest_ray import lowest_ray
from .queue import Queue

__all__ = ["NewRays"]

_CONVERT_LATENCY = 5
_QUEUE_DEPTH = 16


class NewRays(wiring.Component):
    """Makes a packet's rays, one a cycle: (x, y, 1) of the screen, x and y as floats, goes to register 0 of each.

    Parameters
    ----------
    fmt : :class:`~fpu.FloatFormat`
        Format of floats.
    num_threads, stack_depth, coord_width : int
        See :class:`~rtl.config.ChipConfig`.
    result : StructLayout
        See :func:`~rtl.results.result_layout`.

    Members
    -------
    primary : stream of ``{"token", "x", "y"}``: a packet to draw, see :class:`~rtl.transformation.Transformation`
    begin : stream of ``{"thread", "mask"}``: a packet that is begun with so many rays, before they are made
    ray : stream of results: a ray with its register
    """

    def __init__(self, *, fmt, num_threads, stack_depth, coord_width, result):
        self._fmt = fmt
        self._half_width = coord_width + 2
        self._result = result
        self._place = data.StructLayout({"thread": thread_width(num_threads), "ray": range(PACKET_RAYS)})
        token = token_layout(num_threads=num_threads, stack_depth=stack_depth)
        half = signed(self._half_width)
        super().__init__({
            "primary": In(stream.Signature(with_token(token, x=half, y=half))),
            "begin": Out(stream.Signature(data.StructLayout({"thread": thread_width(num_threads),
                                                             "mask": PACKET_RAYS}))),
            "ray": Out(stream.Signature(result)),
        })

    def elaborate(self, platform):
        m = Module()
        m.submodules.queue = queue = Queue(self._result, depth=_QUEUE_DEPTH, always_ready=True)
        # So that who makes packets does not wait within a cycle for who waits for rays.
        m.submodules.packets = packets = Queue(self.primary.payload.shape(), depth=2)
        wiring.connect(m, wiring.flipped(self.primary), packets.i)
        packet = Signal(self.primary.payload.shape(), reset_less=True)
        remaining = Signal(PACKET_RAYS)
        ray, others = lowest_ray(m, remaining)
        pending = Signal(range(_QUEUE_DEPTH + 1))
        has_packet, has_room, issue, is_first, taken = Signal(), Signal(), Signal(), Signal(), Signal()
        m.d.comb += [
            has_packet.eq(remaining.any()),
            packets.o.ready.eq(~has_packet),
            has_room.eq(pending < _QUEUE_DEPTH),
            self.begin.valid.eq(has_packet & is_first & has_room),
            self.begin.payload.thread.eq(packet.token.thread),
            self.begin.payload.mask.eq(packet.token.mask),
            issue.eq(has_packet & has_room & (~is_first | self.begin.ready)),
        ]
        m.d.sync += [taken.eq(self.ray.valid & self.ray.ready), pending.eq(pending + issue - taken)]
        with m.If(issue):
            m.d.sync += [remaining.eq(others), is_first.eq(0)]
        with m.Elif(packets.o.valid & ~has_packet):
            m.d.sync += [packet.eq(packets.o.payload), remaining.eq(packets.o.payload.token.mask), is_first.eq(1)]

        m.submodules.beside = beside = Delay(self._place, cycles=_CONVERT_LATENCY + 1)
        valid = Signal(_CONVERT_LATENCY + 2)
        made = queue.i.payload
        m.d.comb += [
            valid[0].eq(issue),
            beside.i.thread.eq(packet.token.thread),
            beside.i.ray.eq(ray),
            queue.i.valid.eq(valid[-1]),
            made.token.thread.eq(beside.o.thread),
            made.token.ray.eq(beside.o.ray),
            made.last.eq(1),
            made.mask.eq(0b111),
            made.value[2].eq(self._fmt.const(1.0)),
        ]
        m.d.sync += valid[1:].eq(valid[:-1])
        for lane, value in enumerate((packet.x + 2 * ray[0], packet.y - 2 * ray[1])):
            convert = IntToFloat(self._fmt, int_width=self._half_width, signed=True, latency=_CONVERT_LATENCY)
            m.submodules[f"screen{lane}"] = convert
            halves = Signal(signed(self._half_width), name=f"halves{lane}", reset_less=True)
            m.d.sync += halves.eq(value)
            m.d.comb += [convert.i.eq(halves), made.value[lane].eq(convert.r)]
        wiring.connect(m, queue.o, wiring.flipped(self.ray))
        return m
