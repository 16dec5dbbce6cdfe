"""The shader: makes rays, and colours of what they hit, by a program (paper §2.2, §3.2)."""

from amaranth.hdl import Cat, Const, Module, Signal
from amaranth.lib import data, stream, wiring
from amaranth.lib.wiring import In, Out

from fpu import Delay

from .color_unit import ColorUnit
from .control_unit import CONTROL_OPS, ControlUnit
from .instruction_fetch import InstructionFetch, ray_token_layout
from .intersection import hit_layout
from .layout import PACKET_RAYS, camera_layout, thread_width, token_layout
from .microcode import Op, lane_width
from .new_rays import NewRays
from .pixel_encoder import PixelEncoder
from .queue import Queue
from .register_file import lanes_layout
from .rendezvous import Rendezvous, stop_layout
from .requests import Unpack, shader_shapes, tag_layout
from .results import WriteBack, in_lanes, result_layout
from .step import put_step, step_layout

__all__ = ["Shader"]

#: Operations of the colour unit.
_COLOR_OPS = {Op.ROOT, Op.CUT, Op.COLOR_MULTIPLY, Op.COLOR_ADD, Op.COLOR_SUBTRACT, Op.DECODE, Op.BYTES, Op.OFFSET}
_QUEUE_DEPTH = 16


class Shader(wiring.Component):
    """Runs the program for each ray of each packet, an instruction a clock of whichever ray is ready.

    Vectors go to the transformation unit, records and texels are asked for from caches, colours and roots are computed
    here. What the program does not use is not built.

    Parameters
    ----------
    fmt : :class:`~fpu.FloatFormat`
        Format of floats.
    num_threads, stack_depth, index_width, coord_width : int
        See :class:`~rtl.config.ChipConfig`.
    program : :class:`~rtl.microcode.Program`
        What it does.
    ray_stack_depth : int
        Registers on a ray's stack.
    offset_log2 : int
        See :attr:`~rtl.microcode.Op.OFFSET`.
    bank_bits : int
        See :class:`~rtl.register_file.RegisterFile`.

    Members
    -------
    camera : map and origin of primary rays, constants of the program
    primary : stream of ``{"token", "x", "y"}``: a packet to draw, see :class:`~rtl.transformation.Transformation`
    step, stepped, shared : to and from the :class:`~rtl.transformation.Transformation`
    limit, record_address, record : to and from the :class:`~rtl.intersection.Intersection`
    start, packet : streams of tokens: packets to trace, and those that are traced
    finished : stream of tokens: the packet's thread is free
    load, loaded, texture, texel : requests and answers, see :func:`~rtl.requests.shader_shapes` (the latter two with
        textures)
    position_address, position : to and from the :class:`~rtl.threads.Threads`
    pixel : stream of pixels; of their hits only that they are none
    idle : no pixel is under way
    busy : an instruction is taken up
    """

    def __init__(self, *, fmt, num_threads, stack_depth, index_width, coord_width, program, ray_stack_depth,
                 offset_log2=1, bank_bits=0):
        self._fmt = fmt
        self._ops = program.ops
        token = token_layout(num_threads=num_threads, stack_depth=stack_depth)
        rays = dict(num_threads=num_threads, program=program)
        self._ray = ray_token_layout(**rays, stack_depth=ray_stack_depth)
        bank = dict(bank_bits=bank_bits)
        self._fetch = InstructionFetch(fmt=fmt, **rays, **bank, stack_depth=ray_stack_depth)
        self._control = ControlUnit(fmt=fmt, **rays, **bank, stack_depth=ray_stack_depth, index_width=index_width)
        self._rendezvous = Rendezvous(fmt=fmt, **rays, **bank, stack_depth=stack_depth, index_width=index_width,
                                      ray_stack_depth=ray_stack_depth)
        self._result = result_layout(self._ray, lanes_layout(fmt))
        self._color = ColorUnit(fmt=fmt, offset_log2=offset_log2, operations=self._ops & _COLOR_OPS)
        self._shapes = shapes = shader_shapes(fmt=fmt, index_width=index_width, **rays,
                                              ray_stack_depth=ray_stack_depth)
        self._new_rays = NewRays(fmt=fmt, num_threads=num_threads, stack_depth=stack_depth, coord_width=coord_width,
                                 result=self._result)
        self._pixels = PixelEncoder(fmt=fmt, num_threads=num_threads, index_width=index_width, coord_width=coord_width)
        vector = step_layout(fmt=fmt, num_threads=num_threads, tag=shapes["tag"])
        texture = {} if Op.TEXTURE not in self._ops else {
            "texture": Out(stream.Signature(shapes["texture"])),
            "texel": In(stream.Signature(shapes["texel"]))}
        super().__init__({
            "camera": In(camera_layout(fmt)),
            "primary": self._new_rays.signature.members["primary"],
            "step": Out(stream.Signature(vector)),
            "stepped": In(data.StructLayout({"valid": 1, "tag": shapes["tag"], "vector": vector["vector"].shape})),
            "shared": Out(self._rendezvous.shared.shape()),
            "limit": Out(self._rendezvous.limit.signature),
            "record_address": Out(data.StructLayout({"ray": range(PACKET_RAYS), "thread": thread_width(num_threads)})),
            "record": In(hit_layout(fmt=fmt, index_width=index_width)),
            "start": Out(stream.Signature(token, always_ready=True)),
            "packet": In(stream.Signature(token)),
            "finished": Out(stream.Signature(token, always_ready=True)),
            "load": Out(stream.Signature(shapes["load"])),
            "loaded": In(stream.Signature(shapes["loaded"])),
            **texture,
            "position_address": Out(thread_width(num_threads)),
            "position": In(self._pixels.position.shape()),
            "pixel": Out(self._pixels.pixel.signature),
            "idle": Out(1),
            "busy": Out(1),
        })

    def elaborate(self, platform):
        m = Module()
        m.submodules.fetch = fetch = self._fetch
        m.submodules.control = control = self._control
        m.submodules.rendezvous = self._rendezvous
        m.submodules.new_rays = self._new_rays
        m.submodules.pixels = self._pixels
        out = fetch.out
        m.d.comb += [
            fetch.camera.eq(self.camera),
            self.busy.eq(out.valid),
            control.i.valid.eq(out.valid & self._is_one_of(out.instruction.op, CONTROL_OPS)),
            *(control.i[name].eq(out[name]) for name in ("token", "instruction", "a", "x")),
            self.record_address.eq(control.record_address),
            control.record.eq(self.record),
        ]
        rooms = []
        sources = [
            self._control_results(m, control, rooms),
            self._color_results(m, out, control.following, rooms),
            self._loads(m, out, control.following, rooms),
            self._new_rays.ray,
            self._returning_rays(m),
        ]
        if Op.TEXTURE in self._ops:
            sources.append(self._textures(m, out, control.following, rooms))
        self._steps(m, out, control.following, rooms)
        self._stops(m, out, control.following, rooms)
        m.d.comb += fetch.admit.eq(Cat(rooms).all())
        self._write_back(m, sources)
        self._begin_and_end(m)
        return m

    def _is_one_of(self, op, ops):
        used = [candidate for candidate in Op if candidate in ops and candidate in self._ops]
        return Cat(op == candidate for candidate in used).any() if used else Const(0)

    def _request_queue(self, m, name, shape, *, when, rooms):
        """A queue for instructions of one kind; none is taken up unless it has room for all that are.

        Whether it has is looked up a cycle before, in which one more may have been taken up.
        """
        queue = Queue(shape, depth=_QUEUE_DEPTH, always_ready=True)
        m.submodules[f"{name}_queue"] = queue
        m.d.comb += queue.i.valid.eq(when)
        has_room = Signal(name=f"{name}_has_room")
        m.d.sync += has_room.eq(queue.level + self._fetch.under_way < _QUEUE_DEPTH - 2)
        rooms.append(has_room)
        return queue

    def _result_queue(self, m, name, valid, result, rooms, *, latency):
        """A queue for results of a unit that does not wait."""
        depth = _QUEUE_DEPTH + latency
        queue = Queue(self._result, depth=depth, always_ready=True)
        m.submodules[f"{name}_results"] = queue
        begun = Signal(name=f"{name}_begun")
        pending = Signal(range(depth + 1), name=f"{name}_pending")
        m.d.comb += [queue.i.payload.eq(result), queue.i.valid.eq(valid)]
        taken = Signal(name=f"{name}_taken")
        m.d.sync += [taken.eq(queue.o.valid & queue.o.ready), pending.eq(pending + begun - taken)]
        has_room = Signal(name=f"{name}_has_room")
        m.d.sync += has_room.eq(pending + self._fetch.under_way < depth - 2)
        rooms.append(has_room)
        return queue.o, begun

    def _control_results(self, m, control, rooms):
        stream_, begun = self._result_queue(m, "control", control.o.valid, control.o.result, rooms,
                                            latency=control.latency)
        m.d.comb += begun.eq(control.i.valid)
        return stream_

    def _color_results(self, m, out, following, rooms):
        m.submodules.color = color = self._color
        m.submodules.color_tag = beside = Delay(tag_layout(self._ray), cycles=color.latency)
        valid = Signal(color.latency + 1, name="color_valid")
        result = Signal(self._result)
        m.d.comb += [
            color.op.eq(out.instruction.op),
            color.a.eq(out.a),
            color.x.eq(out.x),
            valid[0].eq(out.valid & self._is_one_of(out.instruction.op, _COLOR_OPS)),
            *self._tagged(beside.i, out, following),
            *(result[name].eq(beside.o[name]) for name in ("token", "dst", "mask")),
            result.last.eq(1),
            result.value.eq(color.r),
        ]
        m.d.sync += valid[1:].eq(valid[:-1])
        stream_, begun = self._result_queue(m, "color", valid[-1], result, rooms, latency=color.latency)
        m.d.comb += begun.eq(valid[0])
        return stream_

    def _tagged(self, tag, out, following):
        return [tag.token.eq(following), tag.dst.eq(out.instruction.dst), tag.mask.eq(out.instruction.mask)]

    def _unpack(self, m, name, answer, registers, *, num_registers):
        """The results that an answer becomes."""
        unpack = Unpack(answer.payload.shape(), registers, num_registers=num_registers, result=self._result)
        m.submodules[f"{name}_registers"] = unpack
        wiring.connect(m, wiring.flipped(answer), unpack.answer)
        return unpack.result

    def _loads(self, m, out, following, rooms):
        width = lane_width(self._fmt)
        queue = self._request_queue(m, "load", self._shapes["load"], rooms=rooms,
                                    when=out.valid & (out.instruction.op == Op.LOAD))
        base = out.a.as_value().word_select(out.instruction.select[1].as_value()[:2], width)
        m.d.comb += [queue.i.payload.index.eq(out.x[0] + base),
                     *self._tagged(queue.i.payload.payload, out, following)]
        wiring.connect(m, queue.o, wiring.flipped(self.load))
        return self._unpack(
            m, "record", self.loaded,
            lambda record: [record.item[3 * width * number:][:3 * width] for number in range(4)], num_registers=4)

    def _textures(self, m, out, following, rooms):
        queue = self._request_queue(m, "texture", self._shapes["texture"], rooms=rooms,
                                    when=out.valid & (out.instruction.op == Op.TEXTURE))
        request, fmt = queue.i.payload, self._fmt
        m.d.comb += [
            request.s.eq(out.x[0][:fmt.width]),
            request.t.eq(out.x[1][:fmt.width]),
            request.base.eq(out.a[0]),
            Cat(request.log2_width, request.log2_height, request.filtered, request.folded).eq(out.a[1]),
            *self._tagged(request.payload, out, following),
        ]
        wiring.connect(m, queue.o, wiring.flipped(self.texture))
        return self._unpack(
            m, "texel", self.texel,
            lambda texel: [in_lanes(fmt, *texel.color), in_lanes(fmt, *[texel.opacity] * 3)], num_registers=2)

    def _steps(self, m, out, following, rooms):
        """Vectors for the transformation unit."""
        queue = self._request_queue(m, "step", self.step.payload.shape(), rooms=rooms,
                                    when=out.valid & (out.instruction.op == Op.VECTOR))
        put_step(m, queue.i.payload, out, fmt=self._fmt)
        m.d.comb += self._tagged(queue.i.payload.tag, out, following)
        wiring.connect(m, queue.o, wiring.flipped(self.step))

    def _stops(self, m, out, following, rooms):
        """Rays that stop, and packets that go to traversal."""
        rendezvous = self._rendezvous
        op = out.instruction.op
        queue = self._request_queue(m, "stop", stop_layout(self._ray, lanes_layout(self._fmt)), rooms=rooms,
                                    when=out.valid & ((op == Op.TRACE) | (op == Op.EMIT)))
        m.d.comb += [
            queue.i.payload.token.eq(following),
            queue.i.payload.is_trace.eq(op == Op.TRACE),
            queue.i.payload.flags.eq(out.instruction.bit),
            queue.i.payload.a.eq(out.a),
            queue.i.payload.x.eq(out.x),
            self.shared.eq(rendezvous.shared),
        ]
        wiring.connect(m, queue.o, rendezvous.stop)
        wiring.connect(m, rendezvous.limit, wiring.flipped(self.limit))
        wiring.connect(m, rendezvous.start, wiring.flipped(self.start))
        wiring.connect(m, rendezvous.finished, wiring.flipped(self.finished))
        wiring.connect(m, wiring.flipped(self.packet), rendezvous.packet)

    def _returning_rays(self, m):
        results = stream.Signature(self._result).create(path=("returning",))
        ray = self._rendezvous.ray
        m.d.comb += [results.valid.eq(ray.valid), results.payload.token.eq(ray.payload), results.payload.last.eq(1),
                     ray.ready.eq(results.ready)]
        return results

    def _write_back(self, m, sources):
        """Results go to their registers, and rays with the last of them to where they are ready."""
        m.submodules.results = back = WriteBack(fmt=self._fmt, num_inputs=len(sources), tag=self._shapes["tag"],
                                                result=self._result)
        for source, target in zip(sources, back.i, strict=True):
            wiring.connect(m, source, target)
        result, write = back.o.result, self._fetch.write
        m.d.comb += [
            back.stepped.eq(self.stepped),
            write.valid.eq(back.o.valid),
            write.thread.eq(result.token.thread),
            write.ray.eq(result.token.ray),
            write.number.eq(result.dst),
            write.mask.eq(result.mask),
            write.value.eq(result.value),
            self._fetch.ray.payload.eq(result.token),
            self._fetch.ray.valid.eq(back.o.valid & result.last),
        ]

    def _begin_and_end(self, m):
        """New packets, and the pixels of rays that have ended."""
        rendezvous, pixels = self._rendezvous, self._pixels
        wiring.connect(m, wiring.flipped(self.primary), self._new_rays.primary)
        wiring.connect(m, self._new_rays.begin, rendezvous.begin)
        m.d.comb += [
            pixels.ended.eq(rendezvous.ended),
            rendezvous.may_end.eq(pixels.may_end),
            self.position_address.eq(pixels.position_address),
            pixels.position.eq(self.position),
            self.idle.eq(pixels.idle),
        ]
        wiring.connect(m, pixels.pixel, wiring.flipped(self.pixel))
