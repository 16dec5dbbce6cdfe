"""All of a board's FPGA but its clocks and pins: chip, memory, host and screen."""

from amaranth.hdl import Cat, Module, Signal
from amaranth.lib import data, wiring
from amaranth.lib.wiring import In, Out

from .host.host_link import HostLink
from .memory_system import FRAME_STRIDE, MemorySystem
from .sdram.commands import pins_signature
from .top_map import TopMap
from .video.display import Display
from .video.dvi_transmitter import NUM_CHANNELS

__all__ = ["Top"]

#: On a word's way to the SDRAM and back
_PIN_REGISTERS = 2


class Top(wiring.Component):
    """A chip that a host loads with a scene over a cable, and that draws it on a screen.

    A picture goes into the frame that is not shown, and is shown when it is done, from the next end of a frame of the
    screen on. Domains: ``sync``; ``pixel`` and ``shift`` of the screen, see :class:`~rtl.video.serializer.Serializer`.

    Parameters
    ----------
    config : :class:`~rtl.config.ChipConfig`
        What the chip is built with.
    timing : :class:`~rtl.sdram.timing.SdramTiming`
        The SDRAM, and the clock ``sync``.
    mode : :class:`~rtl.video.mode.VideoMode`
        Of the screen.
    scale : int
        2 for pictures of half its width and height.
    divisor : int
        Cycles of a bit of the cable, see :func:`~rtl.host.uart.uart_divisor`.

    Members
    -------
    rx, tx : the cable
    pins : to the SDRAM, through a register in each pin and for each direction
    pairs : to the screen, see :class:`~rtl.video.dvi_transmitter.DviTransmitter`
    lamps : for people: a picture may be started; one is drawn; a line of the screen was late, ever
    """

    def __init__(self, config, *, timing, mode, scale=2, divisor):
        self.map = TopMap(config)
        chip = timing.chip
        self._system = MemorySystem(config, timing=timing, host=True, display=True, input_delay=_PIN_REGISTERS)
        self._display = Display(mode, chip=chip, scale=scale, stride=FRAME_STRIDE)
        self._link = HostLink(divisor=divisor, word_width=chip.word_width, num_registers=len(self.map.registers),
                              num_values=len(self.map.values), num_guarded=self.map.num_guarded)
        super().__init__({
            "rx": In(1, init=1),
            "tx": Out(1, init=1),
            "pins": Out(pins_signature(chip)),
            "pairs": Out(data.ArrayLayout(2, NUM_CHANNELS)),
            "lamps": Out(3),
        })

    def elaborate(self, platform):
        m = Module()
        m.submodules.system = system = self._system
        m.submodules.display = display = self._display
        m.submodules.link = link = self._link
        wiring.connect(m, wiring.flipped(self.pins), system.pins)
        wiring.connect(m, link.write, system.host_write)
        wiring.connect(m, link.request, system.host_request)
        wiring.connect(m, system.host_data, link.data)
        wiring.connect(m, display.frame, system.display_frame)
        wiring.connect(m, system.display_word, display.word)

        drawing, ready, late = Signal(), Signal(), Signal()
        m.d.comb += [
            link.rx.eq(self.rx), self.tx.eq(link.tx), link.written.eq(system.written),
            ready.eq(system.ready & ~drawing & ~display.pending),
            link.ready.eq(ready),
            system.start.eq(link.start),
            display.swap.eq(drawing & system.ready),
            display.ready.eq(system.ready), system.frame_base.eq(display.draw),
            # Pixels go to the memory alone.
            system.pixel.ready.eq(1),
            self.pairs.eq(display.pairs),
            self.lamps.eq(Cat(ready, drawing, late)),
        ]
        m.d.sync += late.eq(display.late != 0)
        with m.If(link.start):
            m.d.sync += drawing.eq(1)
        with m.Elif(system.ready):
            m.d.sync += drawing.eq(0)

        registers = dict(zip(self.map.registers, link.registers, strict=True))
        size = registers["size"]
        m.d.comb += [
            system.camera.eq(Cat(registers[f"camera{word}"] for word in range(self.map.num_camera_words))),
            system.width.eq(size[:16]), system.height.eq(size[16:]),
            *(getattr(system, name).eq(register) for name, register in registers.items()
              if name in ("root", "background") or (name.endswith("_base") and not name.startswith("frame"))),
            *(display.bases[number].eq(registers[f"frame{number}_base"]) for number in range(2)),
            display.test.eq(registers["options"][0]),
        ]
        values = {"identity": self.map.identity, "status": Cat(ready, display.pending, display.shown),
                  "frames": display.frames, "late": display.late}
        m.d.comb += [link.values[number].eq(values[name] if name in values else getattr(system.counters, name))
                     for number, name in enumerate(self.map.values)]
        return m
