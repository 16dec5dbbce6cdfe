"""All of an FPGA without a memory: a chip with its scene in block RAM, and a screen."""

from amaranth.hdl import Array, Cat, Const, DomainRenamer, Module, Signal
from amaranth.lib import data, wiring
from amaranth.lib.cdc import PulseSynchronizer
from amaranth.lib.wiring import Out

from ..dynrtc import DynRTC
from ..layout import camera_layout
from ..memory_ports import memory_ports
from ..video.display import transmit
from ..video.dvi_transmitter import NUM_CHANNELS, DviTransmitter
from ..video.timing_generator import TimingGenerator
from .frame_store import FrameStore
from .scene_memory import SceneMemory

__all__ = ["StandaloneTop"]


class StandaloneTop(wiring.Component):
    """Draws a scene from one camera after the other, for ever, each at most once a frame of the screen.

    There is one picture, so what is drawn replaces what is shown as it comes. Domains as of :class:`~rtl.top.Top`.

    Parameters
    ----------
    config : :class:`~rtl.config.ChipConfig`
        What the chip is built with.
    memories : dict from str to list of int
        Of each of :func:`~rtl.memory_ports.memory_ports` its words.
    cameras : list of int
        :func:`~rtl.layout.camera_layout` as numbers.
    root : int
        Of the scene.
    background : int
        Red, green and blue, 8 bits each, red in the highest.
    mode : :class:`~rtl.video.mode.VideoMode`
        Of the screen.
    scale_log2, depth : int
        See :class:`~.frame_store.FrameStore`.

    Members
    -------
    pairs : to the screen, see :class:`~rtl.video.dvi_transmitter.DviTransmitter`
    lamps : for people: a picture is drawn; the lowest two bits of how many were
    """

    def __init__(self, config, *, memories, cameras, root, background, mode, scale_log2, depth=4):
        self._config = config
        self._chip = DynRTC(config)
        self._cameras = cameras
        self._root = root
        self._background = background
        self._mode = mode
        self._scale_log2 = scale_log2
        self._store = FrameStore(mode, scale_log2=scale_log2, depth=depth)
        self._memories = {name: SceneMemory(memories[name], line_words=words, line_width=width)
                          for name, (words, width) in memory_ports(config).items()}
        super().__init__({"pairs": Out(data.ArrayLayout(2, NUM_CHANNELS)), "lamps": Out(3)})

    def elaborate(self, platform):
        m = Module()
        mode = self._mode
        m.submodules.chip = chip = self._chip
        m.submodules.store = store = self._store
        for name, memory in self._memories.items():
            m.submodules[name] = memory
            wiring.connect(m, getattr(chip, f"{name}_request"), memory.request)
            wiring.connect(m, memory.data, getattr(chip, f"{name}_data"))
        pixel = chip.pixel.payload
        m.d.comb += [chip.pixel.ready.eq(1), store.write.valid.eq(chip.pixel.valid), store.write.x.eq(pixel.x),
                     store.write.y.eq(pixel.y), store.write.color.eq(pixel.color)]

        timing = TimingGenerator(mode)
        m.submodules.timing = DomainRenamer("pixel")(timing)
        m.submodules.dvi = dvi = DviTransmitter()
        m.submodules.blanks = blanks = PulseSynchronizer("pixel", "sync")
        was_blank, waits = Signal(), Signal()
        m.d.pixel += was_blank.eq(timing.place.blank)
        m.d.comb += [blanks.i.eq(timing.place.blank & ~was_blank), store.place.eq(timing.place),
                     self.pairs.eq(dvi.pairs)]
        transmit(m, mode, timing.place, store.color, dvi)

        number, drawn = Signal(range(len(self._cameras))), Signal(2)
        width = camera_layout(self._config.fmt).size
        m.d.comb += [
            chip.start.eq(waits & chip.ready),
            chip.camera.eq(Array(Const(camera, width) for camera in self._cameras)[number]),
            chip.root.eq(self._root), chip.background.eq(self._background),
            chip.width.eq(mode.width >> self._scale_log2), chip.height.eq(mode.height >> self._scale_log2),
            self.lamps.eq(Cat(~chip.ready, drawn)),
        ]
        with m.If(blanks.o):
            m.d.sync += waits.eq(1)
        with m.Elif(chip.start):
            m.d.sync += waits.eq(0)
        was_ready = Signal(init=1)
        m.d.sync += was_ready.eq(chip.ready)
        with m.If(chip.ready & ~was_ready):
            m.d.sync += [drawn.eq(drawn + 1), number.eq(number + 1)]
            with m.If(number == len(self._cameras) - 1):
                m.d.sync += number.eq(0)
        return m
