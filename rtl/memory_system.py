"""A chip with its memory: one SDRAM for the scene and the picture."""

from amaranth.hdl import Cat, Module, Value
from amaranth.lib import wiring
from amaranth.lib.wiring import In, Out

from .dynrtc import DynRTC
from .memory_ports import memory_members, memory_ports
from .sdram.commands import PLACE_WIDTH, pins_signature
from .sdram.memory import SdramMemory

__all__ = ["FRAME_STRIDE", "MemorySystem"]

#: Words from one row of a picture to the next
FRAME_STRIDE = 1024


class MemorySystem(wiring.Component):
    """A :class:`~rtl.dynrtc.DynRTC` that reads its scene from an SDRAM, and writes its pixels there.

    Parameters
    ----------
    config : :class:`~rtl.config.ChipConfig`
        What the chip is built with.
    timing : :class:`~rtl.sdram.timing.SdramTiming`
        The SDRAM and the clock.

    Members
    -------
    start, camera, root, width, height, background, counters, probe : the chip's
    ready : the chip is ready, all pixels are written, and the SDRAM is initialised
    NAME_base : where each of its memories begins, see :class:`~rtl.sdram.line_port.LinePort`
    frame_base : where the picture begins, likewise; pixel (x, y) is word ``y`` · 1024 + ``x`` of it
    pixel : stream of pixels, each taken when it can also be written
    delivered : for each memory, a word of it comes; what only a simulation looks at
    pins : to the SDRAM
    """

    #: Not all its outputs come from registers.
    latency = 0

    def __init__(self, config, *, timing):
        self._config = config
        self._chip = DynRTC(config)
        self._memory = SdramMemory(timing=timing, readers=memory_ports(config), num_writers=1)
        base = In(timing.chip.word_width - PLACE_WIDTH)
        inner = memory_members(config)
        super().__init__({
            **{name: member for name, member in self._chip.signature.members.items() if name not in inner},
            **{f"{name}_base": base for name in memory_ports(config)},
            "frame_base": base,
            "delivered": Out(len(memory_ports(config))),
            "pins": Out(pins_signature(timing.chip)),
        })

    def elaborate(self, platform):
        m = Module()
        m.submodules.chip = chip = self._chip
        m.submodules.memory = memory = self._memory
        names = memory_ports(self._config)
        for name in names:
            wiring.connect(m, getattr(chip, f"{name}_request"), getattr(memory, f"{name}_request"))
            wiring.connect(m, getattr(memory, f"{name}_data"), getattr(chip, f"{name}_data"))
            m.d.comb += getattr(memory, f"{name}_base").eq(getattr(self, f"{name}_base"))
        wiring.connect(m, wiring.flipped(self.pins), memory.pins)
        for name in ("start", "camera", "root", "width", "height", "background"):
            m.d.comb += Value.cast(getattr(chip, name)).eq(Value.cast(getattr(self, name)))
        for name in ("counters", "probe"):
            m.d.comb += Value.cast(getattr(self, name)).eq(Value.cast(getattr(chip, name)))
        write, pixel = memory.write[0], chip.pixel.payload
        column_width = FRAME_STRIDE.bit_length() - 1
        m.d.comb += [
            self.ready.eq(chip.ready & memory.ready & memory.written),
            self.delivered.eq(Cat(getattr(memory, f"{name}_data").valid for name in names)),
            self.pixel.payload.eq(pixel),
            self.pixel.valid.eq(chip.pixel.valid & write.ready),
            write.valid.eq(chip.pixel.valid & self.pixel.ready),
            chip.pixel.ready.eq(write.ready & self.pixel.ready),
            write.payload.address.eq((self.frame_base << PLACE_WIDTH) + (pixel.y << column_width) + pixel.x),
            write.payload.word.eq(pixel.color),
            write.payload.mask.eq(-1),
        ]
        return m
