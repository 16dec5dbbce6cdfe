"""DynRTC, the dynamic ray-tracing core: pipelines behind one ray generation controller and one memory."""

from amaranth.hdl import Cat, Module, Signal
from amaranth.lib import data, wiring
from amaranth.lib.wiring import In, Out

from .config import ChipConfig
from .counters import Counters
from .dynrtp import DynRTP
from .layout import camera_layout
from .line_sharing import LineSharing
from .memory_ports import memory_members, memory_ports
from .observation import UNITS, event_names
from .queue import merged
from .ray_generation import RayGeneration
from .write_out import WriteOut

__all__ = ["DynRTC", "counter_names"]


def counter_names(config):
    """What a chip counts: cycles, and the events of all its pipelines."""
    return ("cycles", *event_names(config))


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
    NAME_request, NAME_data : for each of :func:`~rtl.memory_ports.memory_ports`, line numbers and words that come back
    pixel : stream of pixels
    counters : one 32-bit count for each of :func:`counter_names`
    probe : for each unit of each pipeline, see :class:`~rtl.dynrtp.DynRTP`
    """

    def __init__(self, config=None):
        self.config = config = ChipConfig() if config is None else config
        self._pipelines = [DynRTP(config) for _ in range(config.num_pipelines)]
        self._names = counter_names(config)
        pipeline = self._pipelines[0]
        super().__init__({
            "start": In(1),
            "ready": Out(1),
            "camera": In(camera_layout(config.fmt)),
            "root": In(config.index_width),
            "width": In(config.coord_width),
            "height": In(config.coord_width),
            "background": In(24),
            **memory_members(config),
            "pixel": Out(pipeline.pixel.signature),
            "counters": Out(data.StructLayout({name: 32 for name in self._names})),
            "probe": Out(data.ArrayLayout(pipeline.probe.shape().elem_shape, len(UNITS) * config.num_pipelines)),
        })

    def elaborate(self, platform):
        m = Module()
        config, pipelines = self.config, self._pipelines
        m.submodules.ray_generation = rays = RayGeneration(
            coord_width=config.coord_width, num_pipelines=config.num_pipelines)
        m.d.comb += [rays.width.eq(self.width), rays.height.eq(self.height)]
        for number, (pipeline, packet) in enumerate(zip(pipelines, rays.packet, strict=True)):
            m.submodules[f"pipeline{number}"] = pipeline
            wiring.connect(m, packet, pipeline.packet)
            m.d.comb += [getattr(pipeline, name).eq(getattr(self, name))
                         for name in ("camera", "root", "width", "height", "background")]
            m.d.comb += [self.probe[number * len(UNITS) + unit].eq(pipeline.probe[unit]) for unit in range(len(UNITS))]
        self._share_memories(m)
        pixels = merged(m, "pixels", [pipeline.pixel for pipeline in pipelines])
        wiring.connect(m, pixels, wiring.flipped(self.pixel))

        # A picture begins with empty caches: the scene may be another.
        flushing = Signal()
        m.d.comb += [
            self.ready.eq(rays.ready & Cat(pipeline.ready for pipeline in pipelines).all() & ~flushing),
            rays.start.eq(flushing & Cat(pipeline.flushed for pipeline in pipelines).all()),
            *(pipeline.flush.eq(flushing) for pipeline in pipelines),
        ]
        with m.If(self.start):
            m.d.sync += flushing.eq(1)
        with m.Elif(rays.start):
            m.d.sync += flushing.eq(0)
        self._count(m)
        return m

    def _share_memories(self, m):
        for name, (words, line_width) in memory_ports(self.config).items():
            ports = [(getattr(pipeline, f"{name}_request"), getattr(pipeline, f"{name}_data"))
                     for pipeline in self._pipelines]
            if len(ports) == 1:
                request, words_back = ports[0]
            else:
                sharing = LineSharing(num_users=len(ports), num_fetches=self._num_fetches(name),
                                      line_width=line_width, line_words=words)
                m.submodules[f"{name}_sharing"] = sharing
                for number, (request, words_back) in enumerate(ports):
                    wiring.connect(m, request, sharing.request[number])
                    wiring.connect(m, sharing.data[number], words_back)
                request, words_back = sharing.line_request, sharing.line_data
            wiring.connect(m, request, wiring.flipped(getattr(self, f"{name}_request")))
            wiring.connect(m, wiring.flipped(getattr(self, f"{name}_data")), words_back)

    def _num_fetches(self, name):
        """Lines that a pipeline may have requested of a memory."""
        if name == "shading" and self.config.program is None:
            return WriteOut.num_requests
        return self.config.num_fetches

    def _count(self, m):
        m.submodules.counters = counters = Counters(
            self._names, num_sources=len(self._pipelines) * self.config.num_shaders)
        m.d.comb += [counters.clear.eq(self.start), counters.event_cycles.eq(~self.ready)]
        for name in self._names[1:]:
            m.d.comb += getattr(counters, f"event_{name}").eq(
                sum(pipeline.events[name] for pipeline in self._pipelines))
        m.d.comb += [getattr(self.counters, name).eq(getattr(counters, name)) for name in self._names]
