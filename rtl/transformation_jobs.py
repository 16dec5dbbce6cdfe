"""What the transformation unit takes up next: jobs in turn, and of each one vector after the other."""

from amaranth.hdl import Const, Module, Mux, Signal, signed
from amaranth.lib import data, enum, memory, stream, wiring
from amaranth.lib.wiring import In, Out

from .layout import PACKET_RAYS, camera_layout, job_layout, matrix_layout, thread_width, token_layout, with_token
from .lowest_ray import lowest_ray
from .microcode import Store
from .ray_store import ray_store_ports
from .step import step_layout

__all__ = ["Kind", "TransformationJobs"]


class Kind(enum.Enum, shape=2):
    """What a transformation is for."""

    CAMERA = 0
    INSTANCE = 1
    TRIANGLE = 2
    STEP = 3


class TransformationJobs(wiring.Component):
    """Takes jobs, those of the shader and new packets first, and says vector for vector what is to be transformed.

    Parameters
    ----------
    fmt, num_threads, stack_depth, index_width, coord_width, tag, solid
        See :class:`~rtl.transformation.Transformation`.

    Members
    -------
    camera, primary, step, shared, matrix, vector_address, entered
        See :class:`~rtl.transformation.Transformation`.
    valid : there is a vector
    vector : ``{"about", "matrix"}``, without a shader with ``x`` and ``y`` of a packet to make: a map, of a step with
        the vector in place of its centre, and ``{"job", "kind", "is_origin", "first", "last", "ray"}``, of a step with
        ``tag``, ``store`` and whether the packet's origin is ``shared``
    """

    def __init__(self, *, fmt, num_threads, stack_depth, index_width, coord_width, tag, solid):
        self._num_threads = num_threads
        self._has_shader = tag is not None
        token = token_layout(num_threads=num_threads, stack_depth=stack_depth)
        job = job_layout(token, index_width=index_width, solid=solid)
        half = signed(coord_width + 2)
        if self._has_shader:
            screen, of_step = {}, {"tag": tag, "store": Store, "shared": 1}
            sources = {
                "step": In(stream.Signature(step_layout(fmt=fmt, num_threads=num_threads, tag=tag))),
                "shared": In(data.StructLayout({"valid": 1, "thread": thread_width(num_threads), "shared": 1})),
            }
        else:
            screen, of_step = {"x": half, "y": half}, {}
            sources = {"camera": In(camera_layout(fmt)), "primary": In(stream.Signature(with_token(token, **screen)))}
        self._current = data.StructLayout({"job": job, "kind": Kind, "matrix": matrix_layout(fmt), **screen, **of_step})
        about = data.StructLayout({"job": job, "kind": Kind, "is_origin": 1, "first": 1, "last": 1,
                                   "ray": range(PACKET_RAYS), **of_step})
        # What of a job is said with each of its vectors.
        self._screen, self._about_job = tuple(screen), ("job", "kind", *of_step)
        super().__init__({
            **sources,
            "matrix": In(stream.Signature(data.StructLayout({"item": matrix_layout(fmt).size, "payload": job}))),
            "vector_address": Out(ray_store_ports(fmt=fmt, num_threads=num_threads)["vector_address"]),
            "entered": Out(data.StructLayout({"valid": 1, "thread": thread_width(num_threads), "index": index_width})),
            "valid": Out(1),
            "vector": Out(data.StructLayout({"about": about, "matrix": matrix_layout(fmt), **screen})),
        })

    def elaborate(self, platform):
        m = Module()

        # The job at work: its origin first, then one direction after the other.
        current = Signal(self._current, reset_less=True)
        active = Signal()
        origin_next, first = Signal(reset_less=True), Signal(reset_less=True)
        has_shader = self._has_shader
        shared = current.shared if has_shader else Const(1, 1)
        remaining = Signal(PACKET_RAYS, reset_less=True)
        ray, others = lowest_ray(m, remaining)
        last, boundary = Signal(), Signal()
        m.d.comb += [
            # A mask is never empty, so an origin is never the last vector.
            last.eq(~origin_next & ~others.any()),
            boundary.eq(~active | last),
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
        if not has_shader:
            m.d.comb += storing.eq(active & (current.kind != Kind.TRIANGLE))
            self._take_primary(m, current, boundary, storing, take)
        else:
            m.d.comb += storing.eq(active & ((current.kind == Kind.INSTANCE)
                                             | (current.kind == Kind.STEP) & (current.store != Store.NOWHERE)))
            self._take_step(m, current, boundary, storing, take)

        token, about = current.job.token, self.vector.about
        m.d.comb += [
            self.valid.eq(active),
            *(about[name].eq(current[name]) for name in self._about_job),
            about.is_origin.eq(origin_next),
            about.first.eq(first),
            about.last.eq(last),
            about.ray.eq(ray),
            *(self.vector[name].eq(current[name]) for name in ("matrix", *self._screen)),
            self.vector_address.thread.eq(token.thread),
            self.vector_address.level.eq(token.level),
            self.vector_address.is_origin.eq(origin_next),
            # The shader stores a ray's origin as its own, even if others have the same.
            self.vector_address.ray.eq(Mux(origin_next & shared & (token.level if has_shader else 1), 0, ray)),
            self.entered.valid.eq(active & origin_next & (current.kind == Kind.INSTANCE)),
            self.entered.thread.eq(token.thread),
            self.entered.index.eq(current.job.index),
        ]
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
