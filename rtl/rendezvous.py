"""Where the rays of a packet wait for each other before they are traced."""

from amaranth.hdl import Cat, Module, Mux, Signal
from amaranth.lib import data, memory, stream, wiring
from amaranth.lib.wiring import In, Out

from .instruction_fetch import ray_token_layout
from .intersection import limits_layout
from .layout import PACKET_RAYS, IntervalSource, thread_slots, thread_width, token_layout
from .lowest_ray import lowest_ray
from .pixel_encoder import ended_layout
from .register_file import lanes_layout

__all__ = ["Rendezvous", "TraceFlag", "stop_layout"]


class TraceFlag:
    """Bits of the field ``bit`` of :attr:`~rtl.microcode.Op.TRACE`."""

    ANY_HIT = 0
    HAS_FAR = 1
    SAME_ORIGIN = 2


def stop_layout(ray_token, lanes):
    """A ray that stops, its counter already at what follows, with the operands of its instruction."""
    return data.StructLayout({"token": ray_token, "is_trace": 1, "flags": 3, "a": lanes, "x": lanes})


class Rendezvous(wiring.Component):
    """Starts a packet when the last of its rays has stopped, and hands its rays back when they are traced.

    A ray stops to be traced or for good; a packet with rays to trace goes to traversal with those, one without is
    finished. One ray stops a cycle; what follows is said ``latency`` cycles later.

    Parameters
    ----------
    fmt : :class:`~fpu.FloatFormat`
        Format of floats.
    num_threads, stack_depth, index_width : int
        See :class:`~rtl.config.ChipConfig`.
    program : :class:`~rtl.microcode.Program`
        The shader's.
    ray_stack_depth : int
        Registers on a ray's stack.
    bank_bits : int
        See :class:`~rtl.register_file.RegisterFile`.

    Members
    -------
    begin : stream of ``{"thread", "mask"}``: a packet that is begun with so many rays
    stop : stream of ``{"token", "is_trace", "flags", "a", "x"}``: a ray stops, with the operands of its instruction
    limit : see :class:`~rtl.intersection.Intersection`
    start : stream of tokens: a packet to trace
    shared : see :class:`~rtl.transformation.Transformation`
    packet : stream of tokens: packets that are traced
    ray : stream of ray tokens: rays that go on
    ended : ``{"valid", "thread", "ray", "color"}``: a ray has ended with three lanes of colour
    may_end : there is room for one that ends
    finished : stream of tokens: the packet's thread is free
    """

    #: From the last ray of a packet that stops to its start or end.
    latency = 2

    def __init__(self, *, fmt, num_threads, stack_depth, index_width, program, ray_stack_depth, bank_bits=0):
        self._fmt = fmt
        self._index_width = index_width
        self._num_slots = thread_slots(num_threads, bank_bits)
        self._bank_bits = bank_bits
        self._token = token = token_layout(num_threads=num_threads, stack_depth=stack_depth)
        self._ray = ray = ray_token_layout(num_threads=num_threads, program=program, stack_depth=ray_stack_depth)
        lanes = lanes_layout(fmt)
        thread = thread_width(num_threads)
        limit = data.StructLayout({"thread": thread, "ray": range(PACKET_RAYS), "has_far": 1, "t_far": fmt,
                                   "limits": limits_layout(fmt=fmt, index_width=index_width)})
        super().__init__({
            "begin": In(stream.Signature(data.StructLayout({"thread": thread, "mask": PACKET_RAYS}))),
            "stop": In(stream.Signature(stop_layout(ray, lanes))),
            "limit": Out(stream.Signature(limit)),
            "start": Out(stream.Signature(token, always_ready=True)),
            "shared": Out(data.StructLayout({"valid": 1, "thread": thread, "shared": 1})),
            "packet": In(stream.Signature(token)),
            "ray": Out(stream.Signature(ray)),
            "ended": Out(ended_layout(fmt=fmt, num_threads=num_threads)),
            "may_end": In(1),
            "finished": Out(stream.Signature(token, always_ready=True)),
        })

    def elaborate(self, platform):
        m = Module()
        stop = self.stop.payload
        accept = Signal()
        m.d.comb += [
            accept.eq(self.stop.valid & Mux(stop.is_trace, self.limit.ready, self.may_end)),
            self.stop.ready.eq(accept),
            self.limit.valid.eq(self.stop.valid & stop.is_trace),
            self.limit.payload.thread.eq(stop.token.thread),
            self.limit.payload.ray.eq(stop.token.ray),
            self.limit.payload.has_far.eq(stop.flags[TraceFlag.HAS_FAR]),
            self.limit.payload.t_far.eq(stop.a[1]),
            self.limit.payload.limits.t_near.eq(stop.a[0]),
            self.limit.payload.limits.triangle.eq(stop.x[0]),
            self.limit.payload.limits.instance.eq(stop.x[1]),
            self.limit.payload.limits.any_hit.eq(stop.flags[TraceFlag.ANY_HIT]),
            self.ended.valid.eq(accept & ~stop.is_trace),
            self.ended.thread.eq(stop.token.thread),
            self.ended.ray.eq(stop.token.ray),
            self.ended.color.eq(stop.x),
        ]
        states = self._count(m, stop, accept)
        self._resume(m, stop, accept, running=states.read_port(domain="comb"))
        return m

    def _count(self, m, stop, accept):
        """Which rays of the packet have stopped, and what follows when all have: in the cycle after one stops."""
        thread = stop.token.thread[self._bank_bits:]
        # Origins are apart, as what is written there does not depend on what was: they are compared a cycle earlier.
        m.submodules.origins = origins = memory.Memory(shape=len(stop.x[2]), depth=self._num_slots, init=[])
        origin, origin_write = origins.read_port(domain="comb"), origins.write_port()
        counted = Signal(data.StructLayout({"thread": stop.token.thread.shape(), "is_trace": 1, "flags": 3,
                                            "stopped": PACKET_RAYS, "same": 1}), reset_less=True)
        counting = Signal()
        m.d.comb += [
            origin.addr.eq(thread),
            origin_write.addr.eq(thread),
            origin_write.data.eq(stop.x[2]),
            origin_write.en.eq(accept & stop.is_trace),
        ]
        m.d.sync += [
            counting.eq(accept),
            counted.thread.eq(stop.token.thread),
            counted.is_trace.eq(stop.is_trace),
            counted.flags.eq(stop.flags),
            counted.stopped.eq(1 << stop.token.ray),
            counted.same.eq(origin.data == stop.x[2]),
        ]

        state_layout = data.StructLayout({"running": PACKET_RAYS, "traced": PACKET_RAYS, "hit": PACKET_RAYS,
                                          "shared": 1})
        m.submodules.states = states = memory.Memory(shape=state_layout, depth=self._num_slots, init=[])
        read, write = states.read_port(domain="comb"), states.write_port()
        before, after = read.data, Signal(state_layout)
        same = Signal()
        all_stopped = Signal()
        m.d.comb += [
            read.addr.eq(counted.thread[self._bank_bits:]),
            same.eq(counted.flags[TraceFlag.SAME_ORIGIN] & (~before.traced.any() | before.shared & counted.same)),
            after.running.eq(before.running & ~counted.stopped),
            after.traced.eq(before.traced | Mux(counted.is_trace, counted.stopped, 0)),
            after.hit.eq(before.hit | Mux(counted.is_trace & counted.flags[TraceFlag.HAS_FAR], counted.stopped, 0)),
            after.shared.eq(Mux(counted.is_trace, same, before.shared)),
            all_stopped.eq(counting & ~after.running.any()),
            self.begin.ready.eq(~counting),
            write.en.eq(counting | self.begin.valid),
            write.addr.eq(Mux(counting, counted.thread, self.begin.payload.thread)[self._bank_bits:]),
        ]
        # Between packets only `running` matters: it is what is to come back.
        with m.If(~counting):
            m.d.comb += write.data.running.eq(self.begin.payload.mask)
        with m.Elif(all_stopped):
            m.d.comb += write.data.running.eq(after.traced)
        with m.Else():
            m.d.comb += write.data.eq(after)
        goes_on, ends = Signal(), Signal()
        begun = Signal(data.StructLayout({"thread": counted.thread.shape(), "state": state_layout}), reset_less=True)
        m.d.sync += [
            goes_on.eq(all_stopped & after.traced.any()),
            ends.eq(all_stopped & ~after.traced.any()),
            begun.thread.eq(counted.thread),
            begun.state.eq(after),
        ]
        m.d.comb += [
            self.start.valid.eq(goes_on),
            self.start.payload.thread.eq(begun.thread),
            self.start.payload.mask.eq(begun.state.traced),
            self.start.payload.hit.eq(begun.state.hit),
            self.start.payload.interval.eq(IntervalSource.FRESH),
            self.shared.valid.eq(goes_on),
            self.shared.thread.eq(begun.thread),
            self.shared.shared.eq(begun.state.shared),
            self.finished.valid.eq(ends),
            self.finished.payload.thread.eq(begun.thread),
        ]
        return states

    def _resume(self, m, stop, accept, *, running):
        """Hands the rays of a packet that is traced back, one a cycle."""
        kept_layout = data.StructLayout({"counter": self._ray["counter"].shape, "sp": self._ray["sp"].shape})
        m.submodules.kept = kept = memory.Memory(
            shape=kept_layout, depth=PACKET_RAYS * self._num_slots, init=[])
        read, write = kept.read_port(), kept.write_port()
        packet = self.packet.payload
        done = Signal(PACKET_RAYS)
        remaining = Signal(PACKET_RAYS)
        ray, others = lowest_ray(m, remaining)
        reading, moves = Signal(), Signal()
        token = Signal(self._ray, reset_less=True)
        m.d.comb += [
            # A packet's mask has lost rays on the way; all that are to come back have been counted as running.
            remaining.eq(running.data.running & ~done),
            running.addr.eq(packet.thread[self._bank_bits:]),
            moves.eq(self.packet.valid & (~reading | self.ray.ready)),
            self.packet.ready.eq(moves & ~others.any()),
            read.addr.eq(Cat(ray, packet.thread[self._bank_bits:])),
            read.en.eq(moves),
            write.addr.eq(Cat(stop.token.ray, stop.token.thread[self._bank_bits:])),
            write.data.counter.eq(stop.token.counter),
            write.data.sp.eq(stop.token.sp),
            write.en.eq(accept & stop.is_trace),
            self.ray.valid.eq(reading),
            self.ray.payload.eq(token),
            self.ray.payload.counter.eq(read.data.counter),
            self.ray.payload.sp.eq(read.data.sp),
        ]
        with m.If(~reading | self.ray.ready):
            m.d.sync += [reading.eq(moves), token.thread.eq(packet.thread), token.ray.eq(ray),
                         token.hit.eq(packet.hit.bit_select(ray, 1))]
        with m.If(moves):
            m.d.sync += done.eq(Mux(others.any(), done | (1 << ray), 0))
