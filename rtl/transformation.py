"""Transformation: one affine map of one vector a clock, for rays, instances and triangles alike."""

from amaranth.hdl import Module, Mux, Signal, signed
from amaranth.lib import data, enum, stream, wiring
from amaranth.lib.wiring import In, Out

from fpu import Datapath, Delay, IntToFloat, Vector

from .arithmetic import ARITHMETICS
from .layout import (
    PACKET_RAYS,
    IntervalSource,
    camera_layout,
    matrix_layout,
    thread_width,
    token_layout,
    vector_layout,
    with_token,
)
from .ray_store import RayStore, ray_store_ports

__all__ = ["Transformation", "affine_map"]


class Kind(enum.Enum, shape=2):
    """What a transformation is for."""

    CAMERA = 0
    INSTANCE = 1
    TRIANGLE = 2


def affine_map(fmt, *, latencies=None, arithmetic=ARITHMETICS[0]):
    """``result`` = m·(X − C) for a point, m·X for a direction (paper §2.1.1, with C in place of N).

    Subtracting C first keeps the cancellation between a far origin and a far triangle out of the products; it
    takes as many operators as m·X + N. Each row is ((m₀·x + m₁·y) + m₂·z), or a fused dot product.

    Datapath: 9 adders, 9 multipliers; or 3 adders, 3 dot products.
    """
    dp = Datapath(fmt, latencies=latencies, **arithmetic.parameters)
    is_point = dp.flag("is_point")
    vector, center = dp.vector("vector"), dp.vector("center")
    rows = [dp.vector(f"row{row}") for row in range(3)]
    x, y, z = (dp.sub(getattr(vector, axis), dp.select(is_point, getattr(center, axis), dp.const(0.0)))
               for axis in "xyz")
    for row, name in zip(rows, "xyz", strict=True):
        if arithmetic.fused:
            result = dp.dot(row, Vector(x, y, z))
        else:
            result = dp.add(dp.add(dp.mul(row.x, x), dp.mul(row.y, y)), dp.mul(row.z, z))
        dp.output(f"result_{name}", result)
    return dp


class Transformation(wiring.Component):
    """Maps the rays of packets: from the screen into the scene, into an instance, into a triangle's space.

    A packet's origin is mapped once, then the direction of each ray that takes part, a vector a clock. Primary
    rays take the camera's origin as it is and map (x, y, 1) by its rows.

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

    Members
    -------
    camera : the map of primary rays
    root : the node at which primary rays begin
    primary : stream of ``{"token", "x", "y"}``: a packet to make; x and y of ray 0 in half pixels from the
        middle of the picture, x to the right, y upwards
    matrix : stream of ``{"item", "payload": {"token", "index", "instance"}}``: from the matrix cache
    write : to the :class:`~rtl.ray_store.RayStore`
    start : stream of ``{"token", "node"}``: rays are in the store and begin at a node
    vector : stream of ``{"token", "index", "is_origin", "ray", "last", "vector"}``: in a triangle's space
    entered : ``{"valid", "thread", "index"}``: the packet's next hits belong to that instance
    busy : a vector is taken in
    """

    def __init__(self, *, fmt, num_threads, stack_depth, index_width, coord_width, latencies=None,
                 arithmetic=ARITHMETICS[0]):
        self._fmt = fmt
        self._latencies = latencies
        self._arithmetic = arithmetic
        self._half_width = coord_width + 2
        self._token = token = token_layout(num_threads=num_threads, stack_depth=stack_depth)
        self._job = with_token(token, index=index_width, instance=1)
        self._index_width = index_width
        store = ray_store_ports(fmt=fmt, num_threads=num_threads)
        super().__init__({
            "camera": In(camera_layout(fmt)),
            "root": In(index_width),
            "primary": In(stream.Signature(with_token(token, x=signed(self._half_width),
                                                      y=signed(self._half_width)))),
            "matrix": In(stream.Signature(data.StructLayout({"item": matrix_layout(fmt).size,
                                                             "payload": self._job}))),
            "write": Out(store["write"]),
            "vector_address": Out(store["vector_address"]),
            "stored_vector": In(store["vector"]),
            "start": Out(stream.Signature(with_token(token, node=index_width), always_ready=True)),
            "vector": Out(stream.Signature(with_token(
                token, index=index_width, is_origin=1, ray=range(PACKET_RAYS), last=1,
                vector=vector_layout(fmt)), always_ready=True)),
            "entered": Out(data.StructLayout({"valid": 1, "thread": thread_width(num_threads), "index": index_width})),
            "busy": Out(1),
        })

    def elaborate(self, platform):
        m = Module()

        # The job at work: its origin first, then one direction after the other.
        job_layout = data.StructLayout({"job": self._job, "kind": Kind, "matrix": matrix_layout(self._fmt),
                                        "x": signed(self._half_width), "y": signed(self._half_width)})
        current = Signal(job_layout, reset_less=True)
        active = Signal()
        origin_next = Signal(reset_less=True)
        remaining = Signal(PACKET_RAYS, reset_less=True)
        ray = Signal(range(PACKET_RAYS))
        others = Signal(PACKET_RAYS)
        last = Signal()
        stores, next_stores = Signal(), Signal()
        take = Signal()
        for number in reversed(range(PACKET_RAYS)):
            with m.If(remaining[number]):
                m.d.comb += ray.eq(number)
        m.d.comb += [
            # Without its lowest set bit; a mask is never empty, so an origin is never the last vector.
            others.eq(remaining & (remaining - 1)),
            last.eq(~origin_next & ~others.any()),
            # Between the vectors of two packets for the ray store goes a pause: it takes three cycles for one of
            # the same origin or ray.
            stores.eq(current.kind != Kind.TRIANGLE),
            next_stores.eq(self.primary.valid | self.matrix.payload.payload.instance),
            take.eq(~active | last & ~(stores & next_stores)),
            self.busy.eq(active),
            self.primary.ready.eq(take),
            self.matrix.ready.eq(take & ~self.primary.valid),
        ]
        with m.If(take):
            m.d.sync += [
                active.eq(self.primary.valid | self.matrix.valid),
                origin_next.eq(1),
            ]
            with m.If(self.primary.valid):
                m.d.sync += [
                    current.job.token.eq(self.primary.payload.token),
                    current.kind.eq(Kind.CAMERA),
                    current.matrix.rows.eq(self.camera.rows),
                    current.x.eq(self.primary.payload.x),
                    current.y.eq(self.primary.payload.y),
                    remaining.eq(self.primary.payload.token.mask),
                ]
            with m.Else():
                m.d.sync += [
                    current.job.eq(self.matrix.payload.payload),
                    current.kind.eq(Mux(self.matrix.payload.payload.instance, Kind.INSTANCE, Kind.TRIANGLE)),
                    current.matrix.eq(self.matrix.payload.item),
                    remaining.eq(self.matrix.payload.payload.token.mask),
                ]
        with m.Elif(origin_next):
            m.d.sync += origin_next.eq(0)
        with m.Elif(last):
            m.d.sync += active.eq(0)
        with m.Else():
            m.d.sync += remaining.eq(others)

        token = current.job.token
        m.d.comb += [
            self.vector_address.thread.eq(token.thread),
            self.vector_address.level.eq(token.level),
            self.vector_address.is_origin.eq(origin_next),
            self.vector_address.ray.eq(Mux(origin_next, 0, ray)),
            self.entered.valid.eq(active & origin_next & (current.kind == Kind.INSTANCE)),
            self.entered.thread.eq(token.thread),
            self.entered.index.eq(current.job.index),
        ]

        # Screen coordinates become floats while stored vectors are read.
        read_latency = RayStore.read_latency
        screen = []
        for name, value in (("x", current.x + 2 * ray[0]), ("y", current.y - 2 * ray[1])):
            convert = IntToFloat(self._fmt, int_width=self._half_width, signed=True, latency=read_latency)
            m.submodules[f"screen_{name}"] = convert
            m.d.comb += convert.i.eq(value)
            screen.append(convert.r)
        step_layout = data.StructLayout({"job": self._job, "kind": Kind, "is_origin": 1, "last": 1,
                                         "ray": range(PACKET_RAYS)})
        m.submodules.to_map = to_map = Delay(
            data.StructLayout({"step": step_layout, "matrix": matrix_layout(self._fmt)}), cycles=read_latency)
        m.d.comb += [
            to_map.i.step.job.eq(current.job),
            to_map.i.step.kind.eq(current.kind),
            to_map.i.step.is_origin.eq(origin_next),
            to_map.i.step.last.eq(last),
            to_map.i.step.ray.eq(ray),
            to_map.i.matrix.eq(current.matrix),
        ]
        vector = Signal(vector_layout(self._fmt))
        with m.If(to_map.o.step.kind == Kind.CAMERA):
            m.d.comb += [vector.x.eq(screen[0]), vector.y.eq(screen[1]), vector.z.eq(self._fmt.const(1.0))]
        with m.Else():
            m.d.comb += vector.eq(self.stored_vector)

        graph = affine_map(self._fmt, latencies=self._latencies, arithmetic=self._arithmetic)
        m.submodules.map = mapping = graph.component()
        m.d.comb += mapping.is_point.eq(to_map.o.step.is_origin)
        for axis in "xyz":
            m.d.comb += [
                getattr(mapping, f"vector_{axis}").eq(getattr(vector, axis)),
                getattr(mapping, f"center_{axis}").eq(getattr(to_map.o.matrix.center, axis)),
                *(getattr(mapping, f"row{row}_{axis}").eq(getattr(to_map.o.matrix.rows[row], axis))
                  for row in range(3)),
            ]
        m.submodules.beside = beside = Delay(step_layout, cycles=mapping.latency)
        valid = Signal(read_latency + mapping.latency + 1)
        m.d.comb += [beside.i.eq(to_map.o.step), valid[0].eq(active)]
        m.d.sync += valid[1:].eq(valid[:-1])

        step = beside.o
        out = step.job.token
        mapped = Signal(vector_layout(self._fmt))
        for axis in "xyz":
            m.d.comb += getattr(mapped, axis).eq(getattr(mapping, f"result_{axis}"))
        with m.If((step.kind == Kind.CAMERA) & step.is_origin):
            m.d.comb += mapped.eq(self.camera.origin)
        stored = Signal()
        m.d.comb += [
            stored.eq(valid[-1] & (step.kind != Kind.TRIANGLE)),
            self.write.valid.eq(stored),
            self.write.thread.eq(out.thread),
            self.write.level.eq(step.kind == Kind.INSTANCE),
            self.write.is_origin.eq(step.is_origin),
            self.write.ray.eq(Mux(step.is_origin, 0, step.ray)),
            self.write.vector.eq(mapped),
            self.vector.valid.eq(valid[-1] & (step.kind == Kind.TRIANGLE)),
            self.vector.payload.token.eq(out),
            self.vector.payload.index.eq(step.job.index),
            self.vector.payload.is_origin.eq(step.is_origin),
            self.vector.payload.ray.eq(step.ray),
            self.vector.payload.last.eq(step.last),
            self.vector.payload.vector.eq(mapped),
        ]

        # The start is announced when the store has the last vector.
        stages = RayStore.write_latency
        start = [Signal(self.start.payload.shape(), name=f"start{k}", reset_less=True) for k in range(stages + 1)]
        starting = Signal(stages + 1)
        m.d.comb += [
            start[0].token.eq(out),
            start[0].token.sp.eq(0),
            start[0].node.eq(step.job.index),
            start[0].token.level.eq(1),
            start[0].token.interval.eq(IntervalSource.FRESH),
            starting[0].eq(stored & step.last),
            self.start.payload.eq(start[stages]),
            self.start.valid.eq(starting[stages]),
        ]
        with m.If(step.kind == Kind.CAMERA):
            m.d.comb += [
                start[0].token.level.eq(0),
                start[0].token.hit.eq(0),
                start[0].node.eq(self.root),
            ]
        for stage in range(stages):
            m.d.sync += [start[stage + 1].eq(start[stage]), starting[stage + 1].eq(starting[stage])]
        return m

