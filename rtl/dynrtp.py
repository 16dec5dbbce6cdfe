"""DynRTP, a ray-tracing pipeline: the units of the paper's figure 2 and the paths between them."""

from amaranth.hdl import Cat, Module
from amaranth.lib import data, stream, wiring
from amaranth.lib.wiring import In, Out

from .arithmetic import ARITHMETICS
from .cache import WORD_WIDTH, Cache
from .intersection import Intersection
from .layout import (
    NODE_BITS,
    PACKET_RAYS,
    camera_layout,
    job_layout,
    matrix_layout,
    thread_width,
    token_layout,
    with_token,
)
from .mailboxed_list import MailboxedList
from .memory_ports import cache_names, memory_members
from .microcode import lane_width
from .observation import UNITS, events_layout, observe
from .queue import Queue, merged
from .ray_generation import packet_layout
from .ray_store import RayStore
from .requests import shader_shapes
from .shaders import Shaders
from .stack import TraversalStack
from .texture import Texture
from .threads import Threads
from .transformation import Transformation
from .traversal import Traversal
from .write_out import WriteOut, pixel_layout

__all__ = ["DynRTP"]


class DynRTP(wiring.Component):
    """A ray-tracing pipeline: draws the packets that it is given.

    Parameters
    ----------
    config : :class:`~rtl.config.ChipConfig`
        What it is built with.

    Members
    -------
    camera, root, width, height, background : the picture; constant while it is drawn
    flush : forget what the caches hold; to be held until ``flushed``, while no packet is at work
    flushed : all caches are empty
    ready : no packet is at work
    packet : stream of :func:`~rtl.ray_generation.packet_layout`
    NAME_request, NAME_data : for each of :func:`~rtl.memory_ports.memory_ports`, see :class:`~rtl.cache.Cache`;
        without a program the shading memory has a word a triangle, and ``shading_request`` is for words
    pixel : stream of pixels
    events : what happens in this cycle, see :func:`~rtl.observation.events_layout`
    probe : for each of :data:`~rtl.observation.UNITS`, whether a thread enters it, and which
    """

    def __init__(self, config):
        self.config = config
        self._token = token_layout(num_threads=config.num_threads, stack_depth=config.stack_depth)
        self._node = with_token(self._token, node=config.index_width)
        self._place = with_token(self._token, list=config.index_width)
        self._has_shader = config.program is not None
        self._job = job_layout(self._token, index_width=config.index_width, solid=self._has_shader)
        fmt = config.fmt
        super().__init__({
            "camera": In(camera_layout(fmt)),
            "root": In(config.index_width),
            "width": In(config.coord_width),
            "height": In(config.coord_width),
            "background": In(24),
            "flush": In(1),
            "flushed": Out(1),
            "ready": Out(1),
            "packet": In(stream.Signature(packet_layout(config.coord_width))),
            **memory_members(config),
            "pixel": Out(stream.Signature(pixel_layout(fmt=fmt, index_width=config.index_width,
                                                       coord_width=config.coord_width))),
            "events": Out(events_layout(config)),
            "probe": Out(data.ArrayLayout(data.StructLayout({"valid": 1, "thread": thread_width(config.num_threads)}),
                                          len(UNITS))),
        })

    def _queue(self, m, name, source, shape):
        """A queue after ``source``, with room for every thread's token."""
        queue = Queue(shape, depth=self.config.num_threads, always_ready=True)
        m.submodules[f"{name}_queue"] = queue
        m.d.comb += [queue.i.payload.eq(source.payload), queue.i.valid.eq(source.valid)]
        return queue.o

    def _cache(self, m, name, **parameters):
        """A cache between its memory's port and whoever asks it."""
        config = self.config
        cache = Cache(index_width=config.index_width, num_fetches=config.num_fetches, **parameters)
        m.submodules[f"{name}_cache"] = cache
        self._connect_cache(m, name, cache)
        return cache

    def _connect_cache(self, m, name, cache):
        wiring.connect(m, cache.line_request, wiring.flipped(getattr(self, f"{name}_request")))
        wiring.connect(m, wiring.flipped(getattr(self, f"{name}_data")), cache.line_data)

    def elaborate(self, platform):
        m = Module()
        config = self.config
        fmt, has_shader = config.fmt, self._has_shader
        token = dict(num_threads=config.num_threads, stack_depth=config.stack_depth)
        widths = dict(**token, index_width=config.index_width)
        floats = dict(fmt=fmt, latencies=config.latencies)
        computing = dict(**floats, arithmetic=ARITHMETICS[config.arithmetic])
        waiting = dict(num_waiting=config.num_threads)
        caches = {
            "nodes": self._cache(m, "nodes", item_width=NODE_BITS, payload_shape=self._token,
                                 num_lines=config.node_lines, line_items=config.node_line_items, **waiting),
            "lists": self._cache(m, "lists", item_width=WORD_WIDTH, payload_shape=self._place,
                                 num_lines=config.list_lines, line_items=config.list_line_items, **waiting),
            "matrices": self._cache(m, "matrices", item_width=matrix_layout(fmt).size, payload_shape=self._job,
                                    num_lines=config.matrix_lines, **waiting),
        }
        shader_parameters = dict(fmt=fmt, num_threads=config.num_threads, index_width=config.index_width,
                                 program=config.program, ray_stack_depth=config.ray_stack_depth)
        num_readers = config.num_shaders if has_shader else 1
        tag = shader_shapes(**shader_parameters)["tag"] if has_shader else None
        m.submodules.threads = threads = Threads(
            **token, coord_width=config.coord_width, num_readers=num_readers)
        m.submodules.ray_store = store = RayStore(fmt=fmt, num_threads=config.num_threads)
        m.submodules.stack = stack = TraversalStack(**floats, **widths)
        m.submodules.traversal = traversal = Traversal(**computing, **widths)
        m.submodules.mailboxed_list = mailboxed_list = MailboxedList(
            mailbox_entries=config.mailbox_entries, solid=has_shader, **widths)
        m.submodules.transformation = transformation = Transformation(
            **computing, coord_width=config.coord_width, tag=tag, solid=has_shader,
            scaled=config.edge_tolerance > 0, **widths)
        m.submodules.intersection = intersection = Intersection(
            **computing, limited=has_shader, near=has_shader and config.shader.passes,
            num_readers=num_readers, tolerance=config.edge_tolerance, **widths)

        exhausted = self._trace(m, caches, stack, traversal, mailboxed_list, transformation, intersection)
        m.d.comb += [
            store.write.eq(transformation.write),
            store.vector_address.eq(transformation.vector_address),
            transformation.stored_vector.eq(store.vector),
            store.step_address.eq(traversal.step_address),
            traversal.step_rays.eq(store.step_rays),
            stack.push.eq(traversal.push),
            stack.popping.eq(traversal.popping),
            stack.popped_address.eq(traversal.popped_address),
            traversal.popped_intervals.eq(stack.popped_intervals),
            intersection.hit_address.eq(stack.hit_address),
            stack.hit_distances.eq(intersection.hit_distances),
            intersection.entered.eq(transformation.entered),
            threads.width.eq(self.width),
            threads.height.eq(self.height),
        ]
        wiring.connect(m, wiring.flipped(self.packet), threads.packet)
        if has_shader:
            color = Shaders(**shader_parameters, stack_depth=config.stack_depth, coord_width=config.coord_width,
                            offset_log2=config.offset_log2, num_shaders=config.num_shaders)
            m.submodules.shader = color
            self._connect_shader(m, caches, color, transformation, intersection)
            wiring.connect(m, threads.primary, color.primary)
            m.d.comb += mailboxed_list.begin.valid.eq(color.start.valid)
            m.d.comb += mailboxed_list.begin.thread.eq(color.start.payload.thread)
        else:
            color = WriteOut(fmt=fmt, coord_width=config.coord_width, may_be_none=config.edge_tolerance > 0,
                             **widths)
            m.submodules.write_out = color
            wiring.connect(m, color.color_request, wiring.flipped(self.shading_request))
            wiring.connect(m, wiring.flipped(self.shading_data), color.color_data)
            wiring.connect(m, threads.primary, transformation.primary)
            m.d.comb += [
                mailboxed_list.begin.eq(threads.begin),
                transformation.camera.eq(self.camera),
                transformation.root.eq(self.root),
                color.width.eq(self.width),
                color.height.eq(self.height),
                color.background.eq(self.background),
            ]
        wiring.connect(m, exhausted, color.packet)
        wiring.connect(m, color.finished, threads.finished)
        wiring.connect(m, color.pixel, wiring.flipped(self.pixel))
        for number in range(num_readers):
            def port(name, number=number):
                return getattr(color, name)[number] if has_shader else getattr(color, name)

            m.d.comb += [
                intersection.record_address[number].eq(port("record_address")),
                port("record").eq(intersection.record[number]),
                threads.position_address[number].eq(port("position_address")),
                port("position").eq(threads.position[number]),
            ]
        m.d.comb += [
            self.ready.eq(threads.ready & color.idle),
            self.flushed.eq(Cat(cache.flushed for cache in caches.values()).all()),
        ]
        m.d.comb += [cache.flush.eq(self.flush) for cache in caches.values()]
        observe(m, events=self.events, probe=self.probe, caches=caches, threads=threads, stack=stack,
                traversal=traversal, mailboxed_list=mailboxed_list, transformation=transformation,
                intersection=intersection, color=color)
        return m

    def _trace(self, m, caches, stack, traversal, mailboxed_list, transformation, intersection):
        """The loop of a thread from its start to where there is nothing left to visit; returns the stream of those."""
        # Nodes to visit come from a step, from the stack, and from rays that begin.
        starts = [self._queue(m, "start", transformation.start, self._node)]
        if self._has_shader:
            self._scene_start = stream.Signature(self._node, always_ready=True).create(path=("scene_start",))
            starts.append(self._queue(m, "scene_start", self._scene_start, self._node))
        visits = merged(m, "visit_merge", [
            self._queue(m, "child", traversal.child, self._node),
            self._queue(m, "resume", stack.resume, self._node),
            *starts,
        ])
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

        pops = merged(m, "pop_merge", [
            self._queue(m, "nowhere", traversal.pop, self._token),
            mailboxed_list.pop,
        ])
        wiring.connect(m, pops, stack.pop)

        # An instance that is left goes on with its list; a packet that is left is to be coloured.
        left, traced = (stream.Signature(self._token, always_ready=True).create(path=(name,))
                        for name in ("left", "traced"))
        m.d.comb += [
            left.payload.eq(stack.exhausted.payload),
            left.payload.level.eq(0),
            left.valid.eq(stack.exhausted.valid & stack.exhausted.payload.level),
            traced.payload.eq(stack.exhausted.payload),
            traced.valid.eq(stack.exhausted.valid & ~stack.exhausted.payload.level),
        ]
        wiring.connect(m, self._queue(m, "left", left, self._token), mailboxed_list.left)
        return self._queue(m, "traced", traced, self._token)

    def _connect_shader(self, m, caches, shader, transformation, intersection):
        config = self.config
        num_rays = PACKET_RAYS * config.num_threads
        records = self._cache(m, "shading", item_width=12 * lane_width(config.fmt), num_lines=config.shading_lines,
                              payload_shape=shader.load.payload.payload.shape(), num_waiting=num_rays)
        caches["shading"] = records
        if "textures" in cache_names(config):
            m.submodules.texture = texture = Texture(
                fmt=config.fmt, payload_shape=shader.texture.payload.payload.shape(), num_lines=config.texture_lines,
                line_items=config.texture_line_items, num_fetches=config.num_fetches, index_width=config.index_width)
            self._connect_cache(m, "textures", texture)
            caches["textures"] = texture
            wiring.connect(m, shader.texture, texture.request)
            wiring.connect(m, texture.response, shader.texel)
        wiring.connect(m, shader.load, records.request)
        wiring.connect(m, records.response, shader.loaded)
        wiring.connect(m, shader.step, transformation.step)
        wiring.connect(m, shader.limit, intersection.limit)
        m.d.comb += [
            shader.camera.eq(self.camera),
            shader.stepped.eq(transformation.stepped),
            transformation.shared.eq(shader.shared),
            self._scene_start.valid.eq(shader.start.valid),
            self._scene_start.payload.token.eq(shader.start.payload),
            self._scene_start.payload.node.eq(self.root),
        ]
