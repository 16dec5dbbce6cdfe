"""Transformation: one affine map of one vector a clock, for rays, instances and triangles alike."""

from amaranth.hdl import Module, Mux, Signal
from amaranth.lib import data, stream, wiring
from amaranth.lib.wiring import In, Out

from fpu import Delay, IntToFloat

from .affine_map import affine_map
from .arithmetic import ARITHMETICS
from .layout import PACKET_RAYS, IntervalSource, matrix_layout, scale_layout, token_layout, vector_layout, with_token
from .microcode import Store
from .ray_store import RayStore, ray_store_ports
from .transformation_jobs import Kind, TransformationJobs

__all__ = ["Transformation", "affine_map"]

#: Of a primary ray's place on the screen
_CONVERT_LATENCY = 5


class Transformation(wiring.Component):
    """Maps the rays of packets: from the screen into the scene, into an instance, into a triangle's space.

    A packet's origin is mapped once, then the direction of each ray that takes part, a vector a clock. Primary
    rays take the camera's origin as it is and map (x, y, 1) by its rows.

    With a shader, that makes all rays itself, there is no camera here, but the shader's vectors are mapped, and rays
    of a packet may have origins of their own: then each is mapped before its ray's direction.

    Parameters
    ----------
    fmt : :class:`~fpu.FloatFormat`
        Format of coordinates.
    num_threads, stack_depth, index_width, coord_width : int
        See :class:`~rtl.config.ChipConfig`.
    latencies : dict
        Of the operators, see :class:`~fpu.Datapath`.
    arithmetic : :class:`~rtl.arithmetic.Arithmetic`
        How it computes.
    tag : shape-like, optional
        What the shader sends with a vector; None if there is none.
    solid : bool
        Whether it is known of triangles if they let light through.
    scaled : bool
        Whether vectors in a triangle's space come with their scale.

    Members
    -------
    camera : the map of primary rays (without a shader)
    root : the node at which primary rays begin (without a shader)
    primary : stream of ``{"token", "x", "y"}``: a packet to make; x and y of ray 0 in half pixels from the
        middle of the picture, x to the right, y upwards (without a shader)
    step : stream of :func:`~rtl.step.step_layout` (with a shader)
    stepped : ``{"valid", "tag", "vector"}``: the result of a step (with a shader)
    shared : ``{"valid", "thread", "shared"}``: whether the rays that the thread begins have one origin (with a shader)
    matrix : stream of ``{"item", "payload": {"token", "index", "instance"}}``: from the matrix cache
    write : to the :class:`~rtl.ray_store.RayStore`
    start : stream of ``{"token", "node"}``: rays are in the store and begin at a node
    vector : stream of ``{"token", "index", "is_origin", "ray", "first", "last", "vector", "scale"}``: in a triangle's
        space; ``first`` is the first direction
    entered : ``{"valid", "thread", "index"}``: the packet's next hits belong to that instance
    busy : a vector is taken in
    """

    def __init__(self, *, fmt, num_threads, stack_depth, index_width, coord_width, latencies=None,
                 arithmetic=ARITHMETICS[0], tag=None, solid=False, scaled=False):
        self._fmt = fmt
        self._scaled = scaled
        self._latencies = latencies
        self._arithmetic = arithmetic
        self._half_width = coord_width + 2
        self._tag = tag
        self._jobs = jobs = TransformationJobs(
            fmt=fmt, num_threads=num_threads, stack_depth=stack_depth, index_width=index_width,
            coord_width=coord_width, tag=tag, solid=solid)
        token = token_layout(num_threads=num_threads, stack_depth=stack_depth)
        store = ray_store_ports(fmt=fmt, num_threads=num_threads)
        taken = jobs.signature.members
        if tag is None:
            own = {"root": In(index_width), **{name: taken[name] for name in ("camera", "primary")}}
        else:
            own = {"stepped": Out(data.StructLayout({"valid": 1, "tag": tag, "vector": vector_layout(fmt)})),
                   **{name: taken[name] for name in ("step", "shared")}}
        super().__init__({
            **own,
            **{name: taken[name] for name in ("matrix", "vector_address", "entered")},
            "write": Out(store["write"]),
            "stored_vector": In(store["vector"]),
            "start": Out(stream.Signature(with_token(token, node=index_width), always_ready=True)),
            "vector": Out(stream.Signature(with_token(
                token, index=index_width, is_origin=1, ray=range(PACKET_RAYS), first=1, last=1,
                solid=int(solid), vector=vector_layout(fmt), scale=scale_layout(fmt, is_there=scaled)),
                always_ready=True)),
            "busy": Out(1),
        })

    def elaborate(self, platform):
        m = Module()
        m.submodules.jobs = jobs = self._jobs
        wiring.connect(m, wiring.flipped(self.matrix), jobs.matrix)
        if self._tag is None:
            wiring.connect(m, wiring.flipped(self.primary), jobs.primary)
            m.d.comb += jobs.camera.eq(self.camera)
        else:
            wiring.connect(m, wiring.flipped(self.step), jobs.step)
            m.d.comb += jobs.shared.eq(self.shared)
        m.d.comb += [self.entered.eq(jobs.entered), self.busy.eq(jobs.valid)]
        # Whose turn it is takes a while to find out.
        given, active = Signal.like(jobs.vector, name="given", reset_less=True), Signal()
        address = Signal.like(jobs.vector_address, name="address", reset_less=True)
        m.d.sync += [given.eq(jobs.vector), address.eq(jobs.vector_address), active.eq(jobs.valid)]
        if self._tag is None:
            ray = jobs.vector.about.ray
            m.d.sync += [given.x.eq(jobs.vector.x + 2 * ray[0]), given.y.eq(jobs.vector.y - 2 * ray[1])]
        # Stored vectors are read while x and y of primary rays are converted.
        waits = _CONVERT_LATENCY - RayStore.read_latency if self._tag is None else 0
        m.submodules.to_store = to_store = Delay(address.shape(), cycles=waits)
        m.d.comb += [to_store.i.eq(address), self.vector_address.eq(to_store.o)]
        self._map(m, given, active)
        return m

    def _map(self, m, given, active):
        """From a vector's address to its results, in all the places where they go."""
        has_shader = self._tag is not None
        to_choose = RayStore.read_latency if has_shader else _CONVERT_LATENCY
        # Which of the vectors it is, is a stage of its own.
        read_latency = to_choose + 1
        about_layout = given.about.shape()
        to_map_layout = data.StructLayout({"about": about_layout, "matrix": matrix_layout(self._fmt)})
        m.submodules.to_map = to_map = Delay(to_map_layout, cycles=to_choose)
        chosen = Signal(to_map_layout, reset_less=True)
        vector = Signal(vector_layout(self._fmt), reset_less=True)
        m.d.comb += [to_map.i.about.eq(given.about), to_map.i.matrix.eq(given.matrix)]
        m.d.sync += [chosen.eq(to_map.o), vector.eq(self.stored_vector)]
        if has_shader:
            with m.If(to_map.o.about.kind == Kind.STEP):
                m.d.sync += vector.eq(to_map.o.matrix.center)
        else:
            screen = self._screen(m, given, latency=_CONVERT_LATENCY)
            with m.If(to_map.o.about.kind == Kind.CAMERA):
                m.d.sync += [vector.x.eq(screen[0]), vector.y.eq(screen[1]), vector.z.eq(self._fmt.const(1.0))]

        graph = affine_map(self._fmt, latencies=self._latencies, arithmetic=self._arithmetic, scaled=self._scaled)
        m.submodules.map = mapping = graph.component()
        m.d.comb += mapping.is_point.eq(chosen.about.is_origin)
        for axis in "xyz":
            m.d.comb += [
                getattr(mapping, f"vector_{axis}").eq(getattr(vector, axis)),
                getattr(mapping, f"center_{axis}").eq(getattr(chosen.matrix.center, axis)),
                *(getattr(mapping, f"row{row}_{axis}").eq(getattr(chosen.matrix.rows[row], axis))
                  for row in range(3)),
            ]
        m.submodules.about = about = Delay(about_layout, cycles=mapping.latency, registered=True)
        valid = Signal(read_latency + mapping.latency + 1)
        m.d.comb += [about.i.eq(chosen.about), valid[0].eq(active)]
        m.d.sync += valid[1:].eq(valid[:-1])

        out = about.o
        token = out.job.token
        mapped = Signal(vector_layout(self._fmt))
        for axis in "xyz":
            m.d.comb += getattr(mapped, axis).eq(getattr(mapping, f"result_{axis}"))
        is_origin, own = Signal(), Signal()
        m.d.comb += is_origin.eq(out.is_origin)
        # What of it is for whom is known a cycle later.
        result = Signal.like(mapped, reset_less=True)
        write_valid, vector_valid, stepped_valid = Signal(), Signal(), Signal()
        write, vector_about = (Signal.like(member, name=name, reset_less=True)
                               for name, member in (("writing", self.write), ("about_vector", self.vector.payload)))
        m.d.sync += [
            result.eq(mapped),
            write_valid.eq(valid[-1] & (out.kind != Kind.TRIANGLE)),
            write.level.eq(out.kind == Kind.INSTANCE),
            write.is_origin.eq(is_origin),
            write.thread.eq(token.thread),
            vector_valid.eq(valid[-1] & (out.kind == Kind.TRIANGLE)),
            vector_about.token.eq(token),
            vector_about.index.eq(out.job.index),
            vector_about.solid.eq(out.job.solid),
            vector_about.is_origin.eq(is_origin),
            vector_about.ray.eq(out.ray),
            vector_about.first.eq(out.first),
            vector_about.last.eq(out.last),
        ]
        m.d.comb += [
            self.write.eq(write),
            self.write.valid.eq(write_valid),
            self.write.vector.eq(result),
            self.vector.payload.eq(vector_about),
            self.vector.payload.vector.eq(result),
            self.vector.valid.eq(vector_valid),
        ]
        if self._scaled:
            m.d.sync += [vector_about.scale[number].eq(getattr(mapping, f"result_scale_{axis}").exp)
                         for number, axis in enumerate("xyz")]
        if has_shader:
            is_step = out.kind == Kind.STEP
            tag = Signal.like(out.tag, name="stepped_tag", reset_less=True)
            with m.If(is_step):
                m.d.sync += write_valid.eq(valid[-1] & (out.store != Store.NOWHERE))
                m.d.comb += is_origin.eq(out.store == Store.ORIGIN)
            m.d.comb += own.eq(is_step | ~out.shared)
            m.d.sync += [
                write.own.eq(own),
                write.ray.eq(Mux(is_origin & ~own, 0, out.ray)),
                stepped_valid.eq(valid[-1] & is_step),
                tag.eq(out.tag),
            ]
            m.d.comb += [self.stepped.valid.eq(stepped_valid), self.stepped.tag.eq(tag), self.stepped.vector.eq(result)]
        else:
            m.d.sync += write.ray.eq(Mux(is_origin, 0, out.ray))
            with m.If((out.kind == Kind.CAMERA) & out.is_origin):
                m.d.comb += mapped.eq(self.camera.origin)
        self._start(m, out, valid[-1])

    def _screen(self, m, given, *, latency):
        """x and y of a primary ray become floats while stored vectors are read."""
        screen = []
        for name, value in (("x", given.x), ("y", given.y)):
            convert = IntToFloat(self._fmt, int_width=self._half_width, signed=True, latency=latency)
            m.submodules[f"screen_{name}"] = convert
            m.d.comb += convert.i.eq(value)
            screen.append(convert.r)
        return screen

    def _start(self, m, out, valid):
        """The start is announced when the store has the last vector, which goes there a cycle later."""
        stages = RayStore.write_latency + 1
        start = [Signal(self.start.payload.shape(), name=f"start{k}", reset_less=True) for k in range(stages + 1)]
        starting = Signal(stages + 1)
        starts = out.kind == Kind.INSTANCE
        if self._tag is None:
            starts |= out.kind == Kind.CAMERA
        m.d.comb += [
            start[0].token.eq(out.job.token),
            start[0].token.sp.eq(0),
            start[0].node.eq(out.job.index),
            start[0].token.level.eq(1),
            start[0].token.interval.eq(IntervalSource.FRESH),
            starting[0].eq(valid & starts & out.last),
            self.start.payload.eq(start[stages]),
            self.start.valid.eq(starting[stages]),
        ]
        if self._tag is None:
            with m.If(out.kind == Kind.CAMERA):
                m.d.comb += [
                    start[0].token.level.eq(0),
                    start[0].token.hit.eq(0),
                    start[0].node.eq(self.root),
                ]
        for stage in range(stages):
            m.d.sync += [start[stage + 1].eq(start[stage]), starting[stage + 1].eq(starting[stage])]
