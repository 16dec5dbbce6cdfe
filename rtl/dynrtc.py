"""DynRTC, the dynamic ray-tracing core: the units of the paper's figure 2 and the paths between them."""

from amaranth.hdl import Module, Signal
from amaranth.lib import data, stream, wiring
from amaranth.lib.wiring import In, Out
from amaranth.utils import exact_log2

from .arithmetic import ARITHMETICS
from .cache import WORD_WIDTH, Cache
from .config import ChipConfig
from .counters import Counters
from .intersection import Intersection
from .layout import NODE_BITS, camera_layout, matrix_layout, thread_width, token_layout, with_token
from .mailboxed_list import MailboxedList
from .queue import Merge, Queue
from .ray_generation import RayGeneration
from .ray_store import RayStore
from .stack import TraversalStack
from .transformation import Transformation
from .traversal import Traversal
from .write_out import WriteOut, pixel_layout

__all__ = ["CACHES", "COUNTERS", "UNITS", "DynRTC", "line_words"]

#: The three caches, by what they keep.
CACHES = ("nodes", "lists", "matrices")

#: What the chip counts: cycles, packets and rays, busy cycles of each unit, hits and misses of each cache.
COUNTERS = ("cycles", "packets", "busy_traversal", "busy_list", "busy_transformation", "busy_intersection",
            *(f"{event}_{cache}" for cache in CACHES for event in ("hit", "miss")))

#: Where a thread can be, in the order of the bits of ``probe``.
UNITS = ("ray generation", "node cache", "traversal", "stack", "list cache", "mailboxed list", "matrix cache",
         "transformation", "intersection", "write-out")


def line_words(config):
    """Words in a line of each of a chip's memories: what one request asks for."""
    return {
        "nodes": config.node_line_items * NODE_BITS // WORD_WIDTH,
        "lists": config.list_line_items,
        "matrices": -(-matrix_layout(config.fmt).size // WORD_WIDTH),
        "shading": 1,
    }


class DynRTC(wiring.Component):
    """A ray-tracing core: draws a picture of a scene in memory.

    Parameters
    ----------
    config : :class:`~rtl.config.ChipConfig`
        What it is built with.

    Members
    -------
    start : draw a picture; only while ``ready``
    ready : the last picture is drawn
    camera, root, width, height, background : the picture; constant while it is drawn
    nodes_request, nodes_data : the node memory, see :class:`~rtl.cache.Cache`
    lists_request, lists_data : the list memory
    matrices_request, matrices_data : the matrix memory
    shading_request, shading_data : the shading memory, a word a triangle
    pixel : stream of pixels
    counters : one 32-bit count for each of :data:`COUNTERS`
    probe : for each of :data:`UNITS`, whether a thread enters it, and which
    """

    def __init__(self, config=None):
        self.config = config = ChipConfig() if config is None else config
        self._token = token_layout(num_threads=config.num_threads, stack_depth=config.stack_depth)
        self._node = with_token(self._token, node=config.index_width)
        self._place = with_token(self._token, list=config.index_width)
        self._job = with_token(self._token, index=config.index_width, instance=1)
        fmt = config.fmt
        word = stream.Signature(WORD_WIDTH, always_ready=True)
        members = {}
        line_items = dict(nodes=config.node_line_items, lists=config.list_line_items, matrices=1)
        for name in CACHES:
            line_width = config.index_width - exact_log2(line_items[name])
            members[f"{name}_request"] = Out(stream.Signature(line_width))
            members[f"{name}_data"] = In(word)
        super().__init__({
            "start": In(1),
            "ready": Out(1),
            "camera": In(camera_layout(fmt)),
            "root": In(config.index_width),
            "width": In(config.coord_width),
            "height": In(config.coord_width),
            "background": In(24),
            **members,
            "shading_request": Out(stream.Signature(config.index_width)),
            "shading_data": In(word),
            "pixel": Out(stream.Signature(pixel_layout(fmt=fmt, index_width=config.index_width,
                                                       coord_width=config.coord_width))),
            "counters": Out(data.StructLayout({name: 32 for name in COUNTERS})),
            "probe": Out(data.ArrayLayout(data.StructLayout({"valid": 1, "thread": thread_width(config.num_threads)}),
                                          len(UNITS))),
        })

    def _queue(self, m, name, source, shape):
        """A queue after ``source``, with room for every thread's token."""
        queue = Queue(shape, depth=self.config.num_threads, always_ready=True)
        m.submodules[f"{name}_queue"] = queue
        m.d.comb += [queue.i.payload.eq(source.payload), queue.i.valid.eq(source.valid)]
        return queue.o

    def _merge(self, m, name, sources, shape):
        merge = Merge(shape, num_inputs=len(sources))
        m.submodules[f"{name}_merge"] = merge
        for source, target in zip(sources, merge.i, strict=True):
            wiring.connect(m, source, target)
        return merge.o

    def elaborate(self, platform):
        m = Module()
        config = self.config
        fmt = config.fmt
        token = dict(num_threads=config.num_threads, stack_depth=config.stack_depth)
        widths = dict(**token, index_width=config.index_width)
        floats = dict(fmt=fmt, latencies=config.latencies)
        computing = dict(**floats, arithmetic=ARITHMETICS[config.arithmetic])
        cache = dict(num_waiting=config.num_threads, num_fetches=config.num_fetches, index_width=config.index_width)
        caches = {
            "nodes": Cache(item_width=NODE_BITS, payload_shape=self._token, num_lines=config.node_lines,
                           line_items=config.node_line_items, **cache),
            "lists": Cache(item_width=WORD_WIDTH, payload_shape=self._place, num_lines=config.list_lines,
                           line_items=config.list_line_items, **cache),
            "matrices": Cache(item_width=matrix_layout(fmt).size, payload_shape=self._job,
                              num_lines=config.matrix_lines, **cache),
        }
        rays = RayGeneration(**token, coord_width=config.coord_width)
        store = RayStore(fmt=fmt, num_threads=config.num_threads)
        stack = TraversalStack(**floats, **widths)
        traversal = Traversal(**computing, **widths)
        mailboxed_list = MailboxedList(mailbox_entries=config.mailbox_entries, **widths)
        transformation = Transformation(**computing, coord_width=config.coord_width, **widths)
        intersection = Intersection(**computing, **widths)
        write_out = WriteOut(fmt=fmt, coord_width=config.coord_width, **widths)
        for name, cache in caches.items():
            m.submodules[f"{name}_cache"] = cache
            wiring.connect(m, cache.line_request, wiring.flipped(getattr(self, f"{name}_request")))
            wiring.connect(m, wiring.flipped(getattr(self, f"{name}_data")), cache.line_data)
        m.submodules.ray_generation = rays
        m.submodules.ray_store = store
        m.submodules.stack = stack
        m.submodules.traversal = traversal
        m.submodules.mailboxed_list = mailboxed_list
        m.submodules.transformation = transformation
        m.submodules.intersection = intersection
        m.submodules.write_out = write_out

        # Nodes to visit come from a step, from the stack, and from rays that begin.
        visits = self._merge(m, "visit", [
            self._queue(m, "child", traversal.child, self._node),
            self._queue(m, "resume", stack.resume, self._node),
            self._queue(m, "start", transformation.start, self._node),
        ], self._node)
        nodes = caches["nodes"]
        m.d.comb += [
            nodes.request.valid.eq(visits.valid),
            nodes.request.payload.index.eq(visits.payload.node),
            nodes.request.payload.payload.eq(visits.payload.token),
            visits.ready.eq(nodes.request.ready),
            traversal.node.valid.eq(nodes.response.valid),
            traversal.node.payload.eq(nodes.response.payload),
            nodes.response.ready.eq(1),
        ]

        wiring.connect(m, self._queue(m, "leaf", traversal.leaf, self._place), mailboxed_list.leaf)
        wiring.connect(m, mailboxed_list.fetch, caches["lists"].request)
        wiring.connect(m, caches["lists"].response, mailboxed_list.entry)
        jobs = self._queue(m, "job", mailboxed_list.job, self._job)
        matrices = caches["matrices"]
        m.d.comb += [
            matrices.request.valid.eq(jobs.valid),
            matrices.request.payload.index.eq(jobs.payload.index),
            matrices.request.payload.payload.eq(jobs.payload),
            jobs.ready.eq(matrices.request.ready),
        ]
        wiring.connect(m, matrices.response, transformation.matrix)
        wiring.connect(m, transformation.vector, intersection.vector)
        wiring.connect(m, self._queue(m, "tested", intersection.tested, self._token), mailboxed_list.tested)

        pops = self._merge(m, "pop", [
            self._queue(m, "nowhere", traversal.pop, self._token),
            self._queue(m, "list_end", mailboxed_list.pop, self._token),
        ], self._token)
        wiring.connect(m, pops, stack.pop)

        # An instance that is left goes on with its list; a packet that is left is drawn.
        left, drawn = (stream.Signature(self._token, always_ready=True).create(path=(name,))
                       for name in ("left", "drawn"))
        m.d.comb += [
            left.payload.eq(stack.exhausted.payload),
            left.payload.level.eq(0),
            left.valid.eq(stack.exhausted.valid & stack.exhausted.payload.level),
            drawn.payload.eq(stack.exhausted.payload),
            drawn.valid.eq(stack.exhausted.valid & ~stack.exhausted.payload.level),
        ]
        wiring.connect(m, self._queue(m, "left", left, self._token), mailboxed_list.left)
        wiring.connect(m, self._queue(m, "drawn", drawn, self._token), write_out.packet)
        wiring.connect(m, write_out.finished, rays.finished)
        wiring.connect(m, rays.primary, transformation.primary)

        # What goes between units without waiting.
        m.d.comb += [
            store.write.eq(transformation.write),
            store.vector_address.eq(transformation.vector_address),
            transformation.stored_vector.eq(store.vector),
            store.step_address.eq(traversal.step_address),
            traversal.step_rays.eq(store.step_rays),
            stack.push.eq(traversal.push),
            stack.popped_address.eq(traversal.popped_address),
            traversal.popped_intervals.eq(stack.popped_intervals),
            intersection.hit_address.eq(stack.hit_address),
            stack.hit_distances.eq(intersection.hit_distances),
            intersection.entered.eq(transformation.entered),
            intersection.record_address.eq(write_out.record_address),
            write_out.record.eq(intersection.record),
            rays.position_address.eq(write_out.position_address),
            write_out.position.eq(rays.position),
            mailboxed_list.begin.eq(rays.begin),
            transformation.camera.eq(self.camera),
            transformation.root.eq(self.root),
            rays.width.eq(self.width),
            rays.height.eq(self.height),
            write_out.width.eq(self.width),
            write_out.height.eq(self.height),
            write_out.background.eq(self.background),
        ]
        wiring.connect(m, write_out.color_request, wiring.flipped(self.shading_request))
        wiring.connect(m, wiring.flipped(self.shading_data), write_out.color_data)
        wiring.connect(m, write_out.pixel, wiring.flipped(self.pixel))

        # A picture begins with empty caches: the scene may be another.
        flushing = Signal()
        idle = Signal()
        m.d.comb += [
            idle.eq(rays.ready & write_out.idle),
            self.ready.eq(idle & ~flushing),
            rays.start.eq(flushing & nodes.flushed & caches["lists"].flushed & matrices.flushed),
        ]
        m.d.comb += [cache.flush.eq(flushing) for cache in caches.values()]
        with m.If(self.start):
            m.d.sync += flushing.eq(1)
        with m.Elif(rays.start):
            m.d.sync += flushing.eq(0)

        self._count(m, caches, {
            "packets": rays.begin.valid,
            "busy_traversal": traversal.busy,
            "busy_list": mailboxed_list.busy,
            "busy_transformation": transformation.busy,
            "busy_intersection": intersection.busy,
        })

        def transfer(source, token):
            return source.valid & source.ready, token.thread

        lists = caches["lists"]
        entering = (
            (rays.begin.valid, rays.begin.thread),
            transfer(nodes.request, nodes.request.payload.payload),
            (traversal.node.valid, traversal.node.payload.payload.thread),
            transfer(stack.pop, stack.pop.payload),
            transfer(lists.request, lists.request.payload.payload.token),
            transfer(mailboxed_list.entry, mailboxed_list.entry.payload.payload.token),
            transfer(matrices.request, matrices.request.payload.payload.token),
            transfer(transformation.matrix, transformation.matrix.payload.payload.token),
            (intersection.vector.valid, intersection.vector.payload.token.thread),
            transfer(write_out.packet, write_out.packet.payload),
        )
        for probe, (valid, thread) in zip(self.probe, entering, strict=True):
            m.d.comb += [probe.valid.eq(valid), probe.thread.eq(thread)]
        return m

    def _count(self, m, caches, events):
        m.submodules.counters = counters = Counters(COUNTERS)
        events = {"cycles": ~self.ready, **events}
        for name, cache in caches.items():
            events |= {f"hit_{name}": cache.hit, f"miss_{name}": cache.miss}
        m.d.comb += counters.clear.eq(self.start)
        m.d.comb += [getattr(counters, f"event_{name}").eq(events[name]) for name in COUNTERS]
        m.d.comb += [getattr(self.counters, name).eq(getattr(counters, name)) for name in COUNTERS]
