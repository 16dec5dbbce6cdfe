"""Transformation: one affine map of one vector a clock, for rays, instances and triangles alike."""

from amaranth.hdl import Const, Module, Mux, Signal, signed
from amaranth.lib import data, enum, memory, stream, wiring
from amaranth.lib.wiring import In, Out

from fpu import Delay, IntToFloat

from .affine_map import affine_map
from .arithmetic import ARITHMETICS
from .layout import (
    PACKET_RAYS,
    IntervalSource,
    camera_layout,
    job_layout,
    matrix_layout,
    thread_width,
    token_layout,
    vector_layout,
    with_token,
)
from .microcode import Store
from .ray_store import RayStore, ray_store_ports

__all__ = ["Transformation", "affine_map", "step_layout"]


class Kind(enum.Enum, shape=2):
    """What a transformation is for."""

    CAMERA = 0
    INSTANCE = 1
    TRIANGLE = 2
    STEP = 3


def step_layout(*, fmt, num_threads, tag):
    """A vector that the shader wants mapped by ``rows``; ``tag`` comes back with the result."""
    return data.StructLayout({"tag": tag, "thread": thread_width(num_threads), "ray": range(PACKET_RAYS),
                              "store": Store, "rows": data.ArrayLayout(vector_layout(fmt), 3),
                              "vector": vector_layout(fmt)})


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

    Members
    -------
    camera : the map of primary rays (without a shader)
    root : the node at which primary rays begin (without a shader)
    primary : stream of ``{"token", "x", "y"}``: a packet to make; x and y of ray 0 in half pixels from the
        middle of the picture, x to the right, y upwards (without a shader)
    step : stream of :func:`step_layout` (with a shader)
    stepped : ``{"valid", "tag", "vector"}``: the result of a step (with a shader)
    shared : ``{"valid", "thread", "shared"}``: whether the rays that the thread begins have one origin (with a shader)
    matrix : stream of ``{"item", "payload": {"token", "index", "instance"}}``: from the matrix cache
    write : to the :class:`~rtl.ray_store.RayStore`
    start : stream of ``{"token", "node"}``: rays are in the store and begin at a node
    vector : stream of ``{"token", "index", "is_origin", "ray", "first", "last", "vector"}``: in a triangle's space;
        ``first`` is the first direction
    entered : ``{"valid", "thread", "index"}``: the packet's next hits belong to that instance
    busy : a vector is taken in
    """

    def __init__(self, *, fmt, num_threads, stack_depth, index_width, coord_width, latencies=None,
                 arithmetic=ARITHMETICS[0], tag=None, solid=False):
        self._fmt = fmt
        self._latencies = latencies
        self._arithmetic = arithmetic
        self._num_threads = num_threads
        self._half_width = coord_width + 2
        self._tag = tag
        self._token = token = token_layout(num_threads=num_threads, stack_depth=stack_depth)
        self._job = job_layout(token, index_width=index_width, solid=solid)
        self._index_width = index_width
        store = ray_store_ports(fmt=fmt, num_threads=num_threads)
        if tag is None:
            own = {
                "camera": In(camera_layout(fmt)),
                "root": In(index_width),
                "primary": In(stream.Signature(with_token(token, x=signed(self._half_width),
                                                          y=signed(self._half_width)))),
            }
        else:
            own = {
                "step": In(stream.Signature(step_layout(fmt=fmt, num_threads=num_threads, tag=tag))),
                "stepped": Out(data.StructLayout({"valid": 1, "tag": tag, "vector": vector_layout(fmt)})),
                "shared": In(data.StructLayout({"valid": 1, "thread": thread_width(num_threads), "shared": 1})),
            }
        super().__init__({
            **own,
            "matrix": In(stream.Signature(data.StructLayout({"item": matrix_layout(fmt).size,
                                                             "payload": self._job}))),
            "write": Out(store["write"]),
            "vector_address": Out(store["vector_address"]),
            "stored_vector": In(store["vector"]),
            "start": Out(stream.Signature(with_token(token, node=index_width), always_ready=True)),
            "vector": Out(stream.Signature(with_token(
                token, index=index_width, is_origin=1, ray=range(PACKET_RAYS), first=1, last=1,
                solid=int(solid), vector=vector_layout(fmt)), always_ready=True)),
            "entered": Out(data.StructLayout({"valid": 1, "thread": thread_width(num_threads), "index": index_width})),
            "busy": Out(1),
        })

    def elaborate(self, platform):
        m = Module()

        # The job at work: its origin first, then one direction after the other.
        current_layout = data.StructLayout({
            "job": self._job, "kind": Kind, "matrix": matrix_layout(self._fmt),
            **({"x": signed(self._half_width), "y": signed(self._half_width)} if self._tag is None else
               {"tag": self._tag, "store": Store, "shared": 1})})
        current = Signal(current_layout, reset_less=True)
        active = Signal()
        origin_next, first = Signal(reset_less=True), Signal(reset_less=True)
        has_shader = self._tag is not None
        shared = current.shared if has_shader else Const(1, 1)
        remaining = Signal(PACKET_RAYS, reset_less=True)
        ray = Signal(range(PACKET_RAYS))
        others = Signal(PACKET_RAYS)
        last, boundary = Signal(), Signal()
        for number in reversed(range(PACKET_RAYS)):
            with m.If(remaining[number]):
                m.d.comb += ray.eq(number)
        m.d.comb += [
            # Without its lowest set bit; a mask is never empty, so an origin is never the last vector.
            others.eq(remaining & (remaining - 1)),
            last.eq(~origin_next & ~others.any()),
            boundary.eq(~active | last),
            self.busy.eq(active),
        ]
        with m.If(boundary):
            m.d.sync += active.eq(0)
        with m.If(origin_next):
            m.d.sync += origin_next.eq(0)
        with m.Else():
            m.d.sync += [remaining.eq(others), origin_next.eq(~shared), first.eq(0)]

        def take(kind, mask, has_origin=1):
            m.d.sync += [active.eq(1), origin_next.eq(has_origin), first.eq(1), current.kind.eq(kind),
                         remaining.eq(mask)]

        storing = Signal()
        if self._tag is None:
            m.d.comb += storing.eq(active & (current.kind != Kind.TRIANGLE))
            self._take_primary(m, current, boundary, storing, take)
        else:
            m.d.comb += storing.eq(active & ((current.kind == Kind.INSTANCE)
                                             | (current.kind == Kind.STEP) & (current.store != Store.NOWHERE)))
            self._take_step(m, current, boundary, storing, take)

        token = current.job.token
        m.d.comb += [
            self.vector_address.thread.eq(token.thread),
            self.vector_address.level.eq(token.level),
            self.vector_address.is_origin.eq(origin_next),
            # The shader stores a ray's origin as its own, even if others have the same.
            self.vector_address.ray.eq(Mux(origin_next & shared & (token.level if has_shader else 1), 0, ray)),
            self.entered.valid.eq(active & origin_next & (current.kind == Kind.INSTANCE)),
            self.entered.thread.eq(token.thread),
            self.entered.index.eq(current.job.index),
        ]
        self._map(m, current, active, origin_next, first, last, ray)
        return m

    def _take_primary(self, m, current, boundary, storing, take):
        """Takes a packet to make before one to transform."""
        matrix = self.matrix.payload
        allowed = Signal()
        m.d.comb += [
            # Between the vectors of two packets for the ray store goes a pause: it takes three cycles for one of
            # the same origin or ray.
            allowed.eq(boundary & ~(storing & (self.primary.valid | matrix.payload.instance))),
            self.primary.ready.eq(allowed),
            self.matrix.ready.eq(allowed & ~self.primary.valid),
        ]
        with m.If(allowed & self.primary.valid):
            take(Kind.CAMERA, self.primary.payload.token.mask)
            m.d.sync += [
                current.job.token.eq(self.primary.payload.token),
                current.matrix.rows.eq(self.camera.rows),
                current.x.eq(self.primary.payload.x),
                current.y.eq(self.primary.payload.y),
            ]
        with m.Elif(allowed & self.matrix.valid):
            self._take_matrix(m, current, take)

    def _take_step(self, m, current, boundary, storing, take):
        """Takes a vector of the shader before a packet to transform."""
        matrix, step = self.matrix.payload, self.step.payload
        m.submodules.origins = origins = memory.Memory(shape=1, depth=1 << thread_width(self._num_threads), init=[])
        write, read = origins.write_port(), origins.read_port(domain="comb")
        stored = Signal()
        lately = Signal()
        go_step = Signal()
        m.d.sync += stored.eq(storing)
        m.d.comb += [
            # The ray store takes three cycles for a vector, and a step may be of the same ray as the one before.
            lately.eq(storing | stored),
            self.step.ready.eq(boundary & ~(lately & (step.store != Store.NOWHERE))),
            go_step.eq(self.step.valid & self.step.ready),
            self.matrix.ready.eq(boundary & ~go_step & ~(lately & matrix.payload.instance)),
            write.addr.eq(self.shared.thread),
            write.data.eq(self.shared.shared),
            write.en.eq(self.shared.valid),
            read.addr.eq(matrix.payload.token.thread),
        ]
        with m.If(go_step):
            take(Kind.STEP, 1 << step.ray, has_origin=0)
            m.d.sync += [
                current.job.token.thread.eq(step.thread),
                current.tag.eq(step.tag),
                current.store.eq(step.store),
                current.matrix.rows.eq(step.rows),
                # No point is mapped, so its place is free.
                current.matrix.center.eq(step.vector),
            ]
        with m.Elif(self.matrix.valid & self.matrix.ready):
            self._take_matrix(m, current, take)
            m.d.sync += current.shared.eq(read.data)

    def _take_matrix(self, m, current, take):
        matrix = self.matrix.payload
        take(Mux(matrix.payload.instance, Kind.INSTANCE, Kind.TRIANGLE), matrix.payload.token.mask)
        m.d.sync += [current.job.eq(matrix.payload), current.matrix.eq(matrix.item)]

    def _map(self, m, current, active, origin_next, first, last, ray):
        """From a vector's address to its results, in all the places where they go."""
        read_latency = RayStore.read_latency
        has_shader = self._tag is not None
        beside_layout = data.StructLayout({
            "job": self._job, "kind": Kind, "is_origin": 1, "first": 1, "last": 1, "ray": range(PACKET_RAYS),
            **({"tag": self._tag, "store": Store, "shared": 1} if has_shader else {})})
        m.submodules.to_map = to_map = Delay(
            data.StructLayout({"beside": beside_layout, "matrix": matrix_layout(self._fmt)}), cycles=read_latency)
        m.d.comb += [
            to_map.i.beside.job.eq(current.job),
            to_map.i.beside.kind.eq(current.kind),
            to_map.i.beside.is_origin.eq(origin_next),
            to_map.i.beside.first.eq(first),
            to_map.i.beside.last.eq(last),
            to_map.i.beside.ray.eq(ray),
            to_map.i.matrix.eq(current.matrix),
        ]
        vector = Signal(vector_layout(self._fmt))
        m.d.comb += vector.eq(self.stored_vector)
        if has_shader:
            m.d.comb += [to_map.i.beside[name].eq(current[name]) for name in ("tag", "store", "shared")]
            with m.If(to_map.o.beside.kind == Kind.STEP):
                m.d.comb += vector.eq(to_map.o.matrix.center)
        else:
            screen = self._screen(m, current, ray, latency=read_latency)
            with m.If(to_map.o.beside.kind == Kind.CAMERA):
                m.d.comb += [vector.x.eq(screen[0]), vector.y.eq(screen[1]), vector.z.eq(self._fmt.const(1.0))]

        graph = affine_map(self._fmt, latencies=self._latencies, arithmetic=self._arithmetic)
        m.submodules.map = mapping = graph.component()
        m.d.comb += mapping.is_point.eq(to_map.o.beside.is_origin)
        for axis in "xyz":
            m.d.comb += [
                getattr(mapping, f"vector_{axis}").eq(getattr(vector, axis)),
                getattr(mapping, f"center_{axis}").eq(getattr(to_map.o.matrix.center, axis)),
                *(getattr(mapping, f"row{row}_{axis}").eq(getattr(to_map.o.matrix.rows[row], axis))
                  for row in range(3)),
            ]
        m.submodules.beside = beside = Delay(beside_layout, cycles=mapping.latency)
        valid = Signal(read_latency + mapping.latency + 1)
        m.d.comb += [beside.i.eq(to_map.o.beside), valid[0].eq(active)]
        m.d.sync += valid[1:].eq(valid[:-1])

        out = beside.o
        token = out.job.token
        mapped = Signal(vector_layout(self._fmt))
        for axis in "xyz":
            m.d.comb += getattr(mapped, axis).eq(getattr(mapping, f"result_{axis}"))
        is_origin = Signal()
        m.d.comb += [
            is_origin.eq(out.is_origin),
            self.write.valid.eq(valid[-1] & (out.kind != Kind.TRIANGLE)),
            self.write.level.eq(out.kind == Kind.INSTANCE),
            self.write.is_origin.eq(is_origin),
            self.write.thread.eq(token.thread),
            self.write.vector.eq(mapped),
            self.vector.valid.eq(valid[-1] & (out.kind == Kind.TRIANGLE)),
            self.vector.payload.token.eq(token),
            self.vector.payload.index.eq(out.job.index),
            self.vector.payload.solid.eq(out.job.solid),
            self.vector.payload.is_origin.eq(is_origin),
            self.vector.payload.ray.eq(out.ray),
            self.vector.payload.first.eq(out.first),
            self.vector.payload.last.eq(out.last),
            self.vector.payload.vector.eq(mapped),
        ]
        if has_shader:
            is_step = out.kind == Kind.STEP
            with m.If(is_step):
                m.d.comb += [self.write.valid.eq(valid[-1] & (out.store != Store.NOWHERE)),
                             is_origin.eq(out.store == Store.ORIGIN)]
            m.d.comb += [
                self.write.own.eq(is_step | ~out.shared),
                self.write.ray.eq(Mux(is_origin & ~self.write.own, 0, out.ray)),
                self.stepped.valid.eq(valid[-1] & is_step),
                self.stepped.tag.eq(out.tag),
                self.stepped.vector.eq(mapped),
            ]
        else:
            m.d.comb += self.write.ray.eq(Mux(is_origin, 0, out.ray))
            with m.If((out.kind == Kind.CAMERA) & out.is_origin):
                m.d.comb += mapped.eq(self.camera.origin)
        self._start(m, out, valid[-1])

    def _screen(self, m, current, ray, *, latency):
        """x and y of a primary ray become floats while stored vectors are read."""
        screen = []
        for name, value in (("x", current.x + 2 * ray[0]), ("y", current.y - 2 * ray[1])):
            convert = IntToFloat(self._fmt, int_width=self._half_width, signed=True, latency=latency)
            m.submodules[f"screen_{name}"] = convert
            m.d.comb += convert.i.eq(value)
            screen.append(convert.r)
        return screen

    def _start(self, m, out, valid):
        """The start is announced when the store has the last vector."""
        stages = RayStore.write_latency
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
