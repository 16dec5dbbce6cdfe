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

    A vector a cycle, but for one that is to be stored after another: a pause comes first.

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

        # The job at work: its origin first, then one direction after the other; and the one to follow, so that who is
        # asked for it does not wait within a cycle for how far the one at work is.
        current, following = (Signal(self._current, name=name, reset_less=True) for name in ("current", "following"))
        active, has_following = Signal(), Signal()
        origin_next, first = Signal(reset_less=True), Signal(reset_less=True)
        has_shader = self._has_shader
        shared = current.shared if has_shader else Const(1, 1)
        remaining, mask = Signal(PACKET_RAYS, reset_less=True), Signal(PACKET_RAYS, reset_less=True)
        ray, others = lowest_ray(m, remaining)
        stores, following_stores, has_origin = (Signal(name=name, reset_less=True)
                                                for name in ("stores", "following_stores", "has_origin"))
        last, last_next = Signal(reset_less=True), Signal()
        boundary, moves, lately = Signal(), Signal(), Signal()
        room, comes, coming_stores = Signal(init=1), Signal(), Signal()
        # Between the vectors of two packets for the ray store goes a pause: it takes three cycles for one of the same
        # origin or ray. A step may be of the same ray as the one before.
        if has_shader:
            stored = Signal()
            m.d.sync += stored.eq(active & stores)
            m.d.comb += lately.eq(active & stores | stored)
        else:
            m.d.comb += lately.eq(active & stores)
        m.d.comb += [
            boundary.eq(~active | last),
            moves.eq(boundary & has_following & ~(lately & following_stores)),
        ]
        with m.If(boundary):
            m.d.sync += active.eq(0)
        # An origin is never the last vector, as a mask is never empty.
        with m.If(origin_next):
            m.d.sync += origin_next.eq(0)
            m.d.comb += last_next.eq(~others.any())
        with m.Else():
            m.d.sync += [remaining.eq(others), origin_next.eq(~shared), first.eq(0)]
            m.d.comb += last_next.eq(shared & others.any() & ~(others & (others - 1)).any())
        with m.If(moves):
            m.d.sync += [current.eq(following), stores.eq(following_stores), active.eq(1), remaining.eq(mask),
                         origin_next.eq(has_origin), first.eq(1)]
            m.d.comb += last_next.eq(~has_origin)
        m.d.sync += last.eq(last_next)

        def take(kind, rays, *, to_store, origin=1):
            m.d.sync += [following.kind.eq(kind), mask.eq(rays), has_origin.eq(origin)]
            m.d.comb += coming_stores.eq(to_store)

        # Where there is room something is put, whether it is there or not: many a bit waits for who it is.
        if has_shader:
            m.d.comb += comes.eq(self._take_step(m, following, room, stored, take))
        else:
            m.d.comb += comes.eq(self._take_primary(m, following, room, take))
        # Said a cycle before, as 400 flip-flops wait for it: nothing is to follow then, or it moves for sure.
        has_following_next, following_stores_next, boundary_next = (
            Signal(name=name) for name in ("has_following_next", "following_stores_next", "boundary_next"))
        m.d.comb += [
            has_following_next.eq(Mux(room, comes, has_following & ~moves)),
            following_stores_next.eq(Mux(room, coming_stores, following_stores)),
            boundary_next.eq(boundary & ~moves | last_next),
        ]
        m.d.sync += [
            has_following.eq(has_following_next),
            following_stores.eq(following_stores_next),
            room.eq(~has_following_next | boundary_next & ~following_stores_next),
        ]

        token, about = current.job.token, self.vector.about
        m.d.comb += [
            self.valid.eq(active),
            *(about[name].eq(current[name]) for name in self._about_job),
            about.is_origin.eq(origin_next),
            about.first.eq(first),
            about.last.eq(last),
            about.ray.eq(ray),
            *(self.vector[name].eq(current[name]) for name in ("matrix", *self._screen)),
            self.vector_address.valid.eq(active & (current.kind != Kind.STEP) & (current.kind != Kind.CAMERA)),
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

    def _take_primary(self, m, following, room, take):
        """Takes a packet to make before one to transform; returns whether there is any."""
        m.d.comb += [
            self.primary.ready.eq(room),
            self.matrix.ready.eq(room & ~self.primary.valid),
        ]
        with m.If(room):
            self._take_matrix(m, following, take)
            with m.If(self.primary.valid):
                take(Kind.CAMERA, self.primary.payload.token.mask, to_store=1)
                m.d.sync += [
                    following.job.token.eq(self.primary.payload.token),
                    following.matrix.rows.eq(self.camera.rows),
                    following.x.eq(self.primary.payload.x),
                    following.y.eq(self.primary.payload.y),
                ]
        return self.primary.valid | self.matrix.valid

    def _take_step(self, m, following, room, stored, take):
        """Takes a vector of the shader before a packet to transform, unless both would go to the ray store.

        Returns whether there is any.
        """
        matrix, step = self.matrix.payload, self.step.payload
        m.submodules.origins = origins = memory.Memory(shape=1, depth=1 << thread_width(self._num_threads), init=[])
        write, read = origins.write_port(), origins.read_port(domain="comb")
        stores, is_step = Signal(), Signal()
        m.d.comb += [
            stores.eq(step.store != Store.NOWHERE),
            # Late by a cycle, as 400 flip-flops wait for it; who comes first is a matter of speed alone.
            is_step.eq(self.step.valid & ~(stores & stored & self.matrix.valid)),
            self.step.ready.eq(room & is_step),
            self.matrix.ready.eq(room & ~is_step),
            write.addr.eq(self.shared.thread),
            write.data.eq(self.shared.shared),
            write.en.eq(self.shared.valid),
            read.addr.eq(matrix.payload.token.thread),
        ]
        with m.If(room):
            self._take_matrix(m, following, take)
            m.d.sync += [following.shared.eq(read.data), following.tag.eq(step.tag), following.store.eq(step.store)]
            with m.If(is_step):
                take(Kind.STEP, 1 << step.ray, to_store=stores, origin=0)
                m.d.sync += [
                    following.job.token.thread.eq(step.thread),
                    following.matrix.rows.eq(step.rows),
                    # No point is mapped, so its place is free.
                    following.matrix.center.eq(step.vector),
                ]
        return self.step.valid | self.matrix.valid

    def _take_matrix(self, m, following, take):
        matrix = self.matrix.payload
        take(Mux(matrix.payload.instance, Kind.INSTANCE, Kind.TRIANGLE), matrix.payload.token.mask,
             to_store=matrix.payload.instance)
        m.d.sync += [following.job.eq(matrix.payload), following.matrix.eq(matrix.item)]
