"""The shader: makes rays, and colours of what they hit, by a program (paper §2.2, §3.2)."""

from amaranth.hdl import Cat, Const, Module, Mux, Signal, signed
from amaranth.lib import data, stream, wiring
from amaranth.lib.wiring import In, Out

from fpu import IntToFloat

from .color_unit import ColorUnit
from .control_unit import CONTROL_OPS, ControlUnit, result_layout
from .encode import Encode
from .instruction_fetch import InstructionFetch, ray_token_layout
from .intersection import hit_layout
from .layout import PACKET_RAYS, camera_layout, thread_width, token_layout, with_token
from .microcode import Mode, Op, lane_width
from .queue import Merge, Queue
from .register_file import lanes_layout
from .rendezvous import Rendezvous, stop_layout
from .transformation import step_layout
from .write_out import pixel_layout

__all__ = ["Shader", "shader_shapes"]

#: Operations of the colour unit.
_COLOR_OPS = {Op.ROOT, Op.CUT, Op.COLOR_MULTIPLY, Op.COLOR_ADD, Op.COLOR_SUBTRACT, Op.DECODE, Op.BYTES, Op.OFFSET}
_QUEUE_DEPTH = 16


def shader_shapes(*, fmt, num_threads, index_width, program, ray_stack_depth):
    """Shapes of what a shader sends away and gets back: its ``tag``, and requests for records and texels."""
    token = ray_token_layout(num_threads=num_threads, program=program, stack_depth=ray_stack_depth)
    tag = data.StructLayout({"token": token, "dst": 5, "mask": 3})
    texel = {"s": fmt, "t": fmt, "base": 24, "log2_width": 4, "log2_height": 4, "filtered": 1, "folded": 1}
    return {
        "tag": tag,
        "load": data.StructLayout({"index": index_width, "payload": tag}),
        "loaded": data.StructLayout({"item": 12 * lane_width(fmt), "payload": tag}),
        "texture": data.StructLayout({**texel, "payload": tag}),
        "texel": data.StructLayout({"color": data.ArrayLayout(17, 3), "opacity": 17, "payload": tag}),
    }


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
    load, loaded, texture, texel : requests and answers, see :func:`shader_shapes` (the latter two with textures)
    position_address, position : to and from the :class:`~rtl.ray_generation.RayGeneration`
    pixel : stream of pixels; of their hits only that they are none
    idle : no pixel is under way
    busy : an instruction is taken up
    """

    def __init__(self, *, fmt, num_threads, stack_depth, index_width, coord_width, program, ray_stack_depth,
                 offset_log2=1, bank_bits=0):
        self._fmt = fmt
        self._num_threads = num_threads
        self._coord_width = coord_width
        self._half_width = coord_width + 2
        self._program = program
        self._ops = {instruction["op"] for instruction in program.instructions}
        self._token = token = token_layout(num_threads=num_threads, stack_depth=stack_depth)
        self._pixel = pixel_layout(fmt=fmt, index_width=index_width, coord_width=coord_width)
        self._index_width = index_width
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
        half = signed(self._half_width)
        vector = step_layout(fmt=fmt, num_threads=num_threads, tag=shapes["tag"])
        texture = {} if Op.TEXTURE not in self._ops else {
            "texture": Out(stream.Signature(shapes["texture"])),
            "texel": In(stream.Signature(shapes["texel"]))}
        super().__init__({
            "camera": In(camera_layout(fmt)),
            "primary": In(stream.Signature(with_token(token, x=half, y=half))),
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
            "position": In(data.StructLayout({"x": coord_width, "y": coord_width})),
            "pixel": Out(stream.Signature(self._pixel)),
            "idle": Out(1),
            "busy": Out(1),
        })

    def elaborate(self, platform):
        m = Module()
        m.submodules.fetch = fetch = self._fetch
        m.submodules.control = control = self._control
        m.submodules.rendezvous = self._rendezvous
        out = fetch.out
        ins = out.instruction
        m.d.comb += [
            fetch.camera.eq(self.camera),
            self.busy.eq(out.valid),
            control.i.valid.eq(out.valid & self._is_one_of(ins.op, CONTROL_OPS)),
            *(control.i[name].eq(out[name]) for name in ("token", "instruction", "a", "x")),
            self.record_address.eq(control.record_address),
            control.record.eq(self.record),
        ]
        rooms = []
        sources = [
            self._control_results(m, out, control, rooms),
            self._color_results(m, out, control.following, rooms),
            self._loads(m, out, control.following, rooms),
            self._new_rays(m),
            self._returning_rays(m),
        ]
        if Op.TEXTURE in self._ops:
            sources.append(self._textures(m, out, control.following, rooms))
        self._steps(m, out, control.following, rooms)
        self._stops(m, out, control.following, rooms)
        m.d.comb += fetch.admit.eq(Cat(rooms).all())
        self._write_back(m, sources)
        self._pixels(m)
        return m

    def _is_one_of(self, op, ops):
        used = [candidate for candidate in Op if candidate in ops and candidate in self._ops]
        return Cat(op == candidate for candidate in used).any() if used else Const(0)

    def _request_queue(self, m, name, shape, *, when, rooms):
        """A queue for instructions of one kind; none is taken up unless it has room for all that are."""
        queue = Queue(shape, depth=_QUEUE_DEPTH, always_ready=True)
        m.submodules[f"{name}_queue"] = queue
        m.d.comb += queue.i.valid.eq(when)
        rooms.append(queue.level + self._fetch.under_way < _QUEUE_DEPTH - 1)
        return queue

    def _result_queue(self, m, name, valid, result, rooms, *, latency):
        """A queue for results of a unit that does not wait."""
        depth = _QUEUE_DEPTH + latency
        queue = Queue(self._result, depth=depth, always_ready=True)
        m.submodules[f"{name}_results"] = queue
        begun = Signal(name=f"{name}_begun")
        pending = Signal(range(depth + 1), name=f"{name}_pending")
        m.d.comb += [queue.i.payload.eq(result), queue.i.valid.eq(valid)]
        m.d.sync += pending.eq(pending + begun - (queue.o.valid & queue.o.ready))
        rooms.append(pending + self._fetch.under_way < depth - 1)
        return queue.o, begun

    def _control_results(self, m, out, control, rooms):
        stream_, begun = self._result_queue(m, "control", control.o.valid, control.o.result, rooms,
                                            latency=control.latency)
        m.d.comb += begun.eq(control.i.valid)
        return stream_

    def _color_results(self, m, out, following, rooms):
        m.submodules.color = color = self._color
        beside = data.StructLayout({"valid": 1, "token": self._ray, "dst": 5, "mask": 3})
        stages = [Signal(beside, name=f"color{stage}") for stage in range(color.latency + 1)]
        result = Signal(self._result)
        m.d.comb += [
            color.op.eq(out.instruction.op),
            color.a.eq(out.a),
            color.x.eq(out.x),
            stages[0].valid.eq(out.valid & self._is_one_of(out.instruction.op, _COLOR_OPS)),
            stages[0].token.eq(following),
            stages[0].dst.eq(out.instruction.dst),
            stages[0].mask.eq(out.instruction.mask),
            result.token.eq(stages[-1].token),
            result.last.eq(1),
            result.dst.eq(stages[-1].dst),
            result.mask.eq(stages[-1].mask),
            result.value.eq(color.r),
        ]
        for stage in range(color.latency):
            m.d.sync += stages[stage + 1].eq(stages[stage])
        stream_, begun = self._result_queue(m, "color", stages[-1].valid, result, rooms, latency=color.latency)
        m.d.comb += begun.eq(stages[0].valid)
        return stream_

    def _tagged(self, tag, out, following):
        return [tag.token.eq(following), tag.dst.eq(out.instruction.dst), tag.mask.eq(out.instruction.mask)]

    def _unpack(self, m, name, answer, registers):
        """Writes the registers of an answer one after the other, and then is ready for the next."""
        results = stream.Signature(self._result).create(path=(name,))
        number = Signal(range(len(registers)), name=f"{name}_number")
        tag = answer.payload.payload
        last = Signal(name=f"{name}_last")
        m.d.comb += [
            last.eq(number == len(registers) - 1),
            results.valid.eq(answer.valid),
            results.payload.token.eq(tag.token),
            results.payload.last.eq(last),
            results.payload.dst.eq(tag.dst + number),
            results.payload.mask.eq(tag.mask),
            answer.ready.eq(results.ready & last),
        ]
        with m.Switch(number):
            for place, value in enumerate(registers):
                with m.Case(place):
                    m.d.comb += results.payload.value.eq(value)
        with m.If(results.valid & results.ready):
            m.d.sync += number.eq(Mux(last, 0, number + 1))
        return results

    def _loads(self, m, out, following, rooms):
        width = lane_width(self._fmt)
        queue = self._request_queue(m, "load", self._shapes["load"], rooms=rooms,
                                    when=out.valid & (out.instruction.op == Op.LOAD))
        base = out.a.as_value().word_select(out.instruction.select[1].as_value()[:2], width)
        m.d.comb += [queue.i.payload.index.eq(out.x[0] + base),
                     *self._tagged(queue.i.payload.payload, out, following)]
        wiring.connect(m, queue.o, wiring.flipped(self.load))
        item = self.loaded.payload.item
        return self._unpack(m, "record", self.loaded,
                            [item[3 * width * number:][:3 * width] for number in range(4)])

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
        width, texel = lane_width(fmt), self.texel.payload

        def lanes(*values):
            return Cat(Cat(value, Const(0, width - len(value))) for value in values)

        return self._unpack(m, "texel_lanes", self.texel, [
            lanes(*(texel.color[lane] for lane in range(3))), lanes(texel.opacity, texel.opacity, texel.opacity)])

    def _steps(self, m, out, following, rooms):
        """Vectors for the transformation unit."""
        fmt = self._fmt
        queue = self._request_queue(m, "step", self.step.payload.shape(), rooms=rooms,
                                    when=out.valid & (out.instruction.op == Op.VECTOR))
        step = queue.i.payload

        def lane(register, place):
            return out[register][place][:fmt.width]

        m.d.comb += [
            step.thread.eq(out.token.thread),
            step.ray.eq(out.token.ray),
            step.store.eq(out.instruction.store),
            *self._tagged(step.tag, out, following),
            *(getattr(step.vector, axis).eq(lane("x", place)) for place, axis in enumerate("xyz")),
        ]
        with m.Switch(out.instruction.mode):
            with m.Case(Mode.COLUMNS):
                m.d.comb += [getattr(step.rows[row], axis).eq(lane(register, row))
                             for row in range(3) for axis, register in zip("xyz", "abc", strict=True)]
            with m.Case(Mode.ROWS):
                m.d.comb += [getattr(step.rows[row], axis).eq(lane(register, place))
                             for row, register in enumerate("abc") for place, axis in enumerate("xyz")]
            with m.Case(Mode.DIAGONAL):
                m.d.comb += [getattr(step.rows[row], axis).eq(lane("a", row))
                             for row, axis in enumerate("xyz")]
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

    def _new_rays(self, m):
        """A packet's rays with their screen coordinates in register 0."""
        rendezvous, latency = self._rendezvous, 3
        queue = Queue(self._result, depth=_QUEUE_DEPTH, always_ready=True)
        m.submodules.new_rays = queue
        packet = self.primary.payload
        done = Signal(PACKET_RAYS)
        remaining, others = Signal(PACKET_RAYS), Signal(PACKET_RAYS)
        ray = Signal(range(PACKET_RAYS))
        pending = Signal(range(_QUEUE_DEPTH + 1))
        issue, is_first = Signal(), Signal()
        for number in reversed(range(PACKET_RAYS)):
            with m.If(remaining[number]):
                m.d.comb += ray.eq(number)
        m.d.comb += [
            remaining.eq(packet.token.mask & ~done),
            others.eq(remaining & (remaining - 1)),
            is_first.eq(~done.any()),
            rendezvous.begin.valid.eq(self.primary.valid & is_first & (pending < _QUEUE_DEPTH)),
            rendezvous.begin.payload.thread.eq(packet.token.thread),
            rendezvous.begin.payload.mask.eq(packet.token.mask),
            issue.eq(self.primary.valid & (pending < _QUEUE_DEPTH) & (~is_first | rendezvous.begin.ready)),
            self.primary.ready.eq(issue & ~others.any()),
        ]
        m.d.sync += pending.eq(pending + issue - (queue.o.valid & queue.o.ready))
        with m.If(issue):
            m.d.sync += done.eq(Mux(others.any(), done | (1 << ray), 0))

        valid = Signal(latency + 1)
        places = [Signal(data.StructLayout({"thread": packet.token.thread.shape(), "ray": range(PACKET_RAYS)}),
                         name=f"place{stage}", reset_less=stage > 0) for stage in range(latency + 1)]
        m.d.comb += [valid[0].eq(issue), places[0].thread.eq(packet.token.thread), places[0].ray.eq(ray),
                     queue.i.valid.eq(valid[-1]),
                     queue.i.payload.token.thread.eq(places[-1].thread),
                     queue.i.payload.token.ray.eq(places[-1].ray),
                     queue.i.payload.last.eq(1),
                     queue.i.payload.mask.eq(0b111),
                     queue.i.payload.value[2].eq(self._fmt.const(1.0))]
        m.d.sync += valid[1:].eq(valid[:-1])
        for stage in range(latency):
            m.d.sync += places[stage + 1].eq(places[stage])
        for lane, value in enumerate((packet.x + 2 * ray[0], packet.y - 2 * ray[1])):
            convert = IntToFloat(self._fmt, int_width=self._half_width, signed=True, latency=latency)
            m.submodules[f"screen{lane}"] = convert
            m.d.comb += [convert.i.eq(value), queue.i.payload.value[lane].eq(convert.r)]
        return queue.o

    def _write_back(self, m, sources):
        """One result a clock: those of the transformation unit, which cannot wait, before others."""
        merge = Merge(self._result, num_inputs=len(sources))
        m.submodules.results = merge
        for source, target in zip(sources, merge.i, strict=True):
            wiring.connect(m, source, target)
        result, valid = Signal(self._result, reset_less=True), Signal()
        width = lane_width(self._fmt)
        m.d.comb += merge.o.ready.eq(~self.stepped.valid)
        m.d.sync += [result.eq(merge.o.payload), valid.eq(merge.o.valid | self.stepped.valid)]
        with m.If(self.stepped.valid):
            tag = self.stepped.tag
            m.d.sync += [result.token.eq(tag.token), result.last.eq(1), result.dst.eq(tag.dst),
                         result.mask.eq(tag.mask),
                         result.value.eq(Cat(Cat(getattr(self.stepped.vector, axis),
                                                 Const(0, width - self._fmt.width)) for axis in "xyz"))]
        write = self._fetch.write
        m.d.comb += [
            write.valid.eq(valid),
            write.thread.eq(result.token.thread),
            write.ray.eq(result.token.ray),
            write.number.eq(result.dst),
            write.mask.eq(result.mask),
            write.value.eq(result.value),
            self._fetch.ray.payload.eq(result.token),
            self._fetch.ray.valid.eq(valid & result.last),
        ]

    def _pixels(self, m):
        """Encodes the colours of rays that have ended."""
        m.submodules.encode = encode = Encode()
        queue = Queue(self._pixel, depth=_QUEUE_DEPTH, always_ready=True)
        m.submodules.pixels = queue
        rendezvous = self._rendezvous
        ended = rendezvous.ended
        place_layout = data.StructLayout({"x": self._coord_width, "y": self._coord_width})
        places = [Signal(place_layout, name=f"pixel{stage}", reset_less=stage > 0)
                  for stage in range(encode.latency + 1)]
        valid = Signal(encode.latency + 1)
        pending = Signal(range(_QUEUE_DEPTH + 1))
        m.d.comb += [
            self.position_address.eq(ended.thread),
            rendezvous.may_end.eq(pending < _QUEUE_DEPTH),
            valid[0].eq(ended.valid),
            places[0].x.eq(self.position.x + ended.ray[0]),
            places[0].y.eq(self.position.y + ended.ray[1]),
            *(encode.color[lane].eq(ended.color[lane]) for lane in range(3)),
            queue.i.valid.eq(valid[-1]),
            queue.i.payload.x.eq(places[-1].x),
            queue.i.payload.y.eq(places[-1].y),
            queue.i.payload.color.eq(Cat(encode.encoded[2], encode.encoded[1], encode.encoded[0])),
            self.idle.eq(~pending.any()),
        ]
        m.d.sync += [valid[1:].eq(valid[:-1]),
                     pending.eq(pending + ended.valid - (self.pixel.valid & self.pixel.ready))]
        for stage in range(encode.latency):
            m.d.sync += places[stage + 1].eq(places[stage])
        wiring.connect(m, queue.o, wiring.flipped(self.pixel))
