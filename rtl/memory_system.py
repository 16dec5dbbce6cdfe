"""A chip with its memory: one SDRAM for the scene and the picture."""

from amaranth.hdl import Cat, Module, Value
from amaranth.lib import stream, wiring
from amaranth.lib.wiring import In, Out

from .dynrtc import DynRTC
from .memory_ports import memory_members, memory_ports
from .sdram.commands import PLACE_WIDTH, pins_signature
from .sdram.memory import SdramMemory
from .sdram.write_port import write_layout

__all__ = ["FRAME_STRIDE", "MemorySystem"]

#: Words from one row of a picture to the next
FRAME_STRIDE = 1024


class MemorySystem(wiring.Component):
    """A :class:`~rtl.dynrtc.DynRTC` that reads its scene from an SDRAM, and writes its pixels there.

    What a host writes is counted from the memory's beginning, in words.

    Parameters
    ----------
    config : :class:`~rtl.config.ChipConfig`
        What the chip is built with.
    timing : :class:`~rtl.sdram.timing.SdramTiming`
        The SDRAM and the clock.
    host, display : bool
        Whether a host reads and writes words there, and a display reads pictures.
    input_delay : int
        See :class:`~rtl.sdram.controller.Controller`.

    Members
    -------
    start, camera, root, width, height, background, counters, probe : the chip's
    ready : the chip is ready, all pixels are written, and the SDRAM is initialised
    NAME_base : where each of its memories begins, see :class:`~rtl.sdram.line_port.LinePort`
    frame_base : where the picture begins, likewise; pixel (x, y) is word ``y`` · 1024 + ``x`` of it
    pixel : stream of pixels, each taken when it can also be written
    delivered : for each memory, a word of it comes; what only a simulation looks at
    host_request, host_data, host_write : if there is a host, streams of addresses, of the words there, and of words to
        write, see :func:`~rtl.sdram.write_port.write_layout`
    written : all words taken are where whoever reads them finds them
    display_frame, display_word : if there is a display, see :class:`~rtl.sdram.display_port.DisplayPort`
    pins : to the SDRAM
    """

    #: Not all its outputs come from registers.
    latency = 0

    def __init__(self, config, *, timing, host=False, display=False, input_delay=0):
        self._config = config
        self._chip = DynRTC(config)
        self._outer = (*(("host_request", "host_data") if host else ()),
                       *(("display_frame", "display_word") if display else ()))
        self._has_host = host
        readers = memory_ports(config) | ({"host": (1, timing.chip.word_width)} if host else {})
        self._memory = memory = SdramMemory(timing=timing, readers=readers, num_writers=1 + host, display=display,
                                            input_delay=input_delay)
        base = In(timing.chip.word_width - PLACE_WIDTH)
        inner = memory_members(config)
        super().__init__({
            **{name: member for name, member in self._chip.signature.members.items() if name not in inner},
            **{f"{name}_base": base for name in memory_ports(config)},
            "frame_base": base,
            "delivered": Out(len(memory_ports(config))),
            **{name: memory.signature.members[name] for name in self._outer},
            **({"host_write": In(stream.Signature(write_layout(timing.chip)))} if host else {}),
            "written": Out(1),
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
        for name in self._outer:
            wiring.connect(m, wiring.flipped(getattr(self, name)), getattr(memory, name))
        if self._has_host:
            wiring.connect(m, wiring.flipped(self.host_write), memory.write[1])
        for name in ("start", "camera", "root", "width", "height", "background"):
            m.d.comb += Value.cast(getattr(chip, name)).eq(Value.cast(getattr(self, name)))
        for name in ("counters", "probe"):
            m.d.comb += Value.cast(getattr(self, name)).eq(Value.cast(getattr(chip, name)))
        write, pixel = memory.write[0], chip.pixel.payload
        column_width = FRAME_STRIDE.bit_length() - 1
        m.d.comb += [
            self.ready.eq(chip.ready & memory.ready & memory.written),
            self.written.eq(memory.written),
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
