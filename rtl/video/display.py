"""A monitor's picture out of a memory's frames."""

from amaranth.hdl import DomainRenamer, Module, Mux, Signal
from amaranth.lib import data, stream, wiring
from amaranth.lib.cdc import FFSynchronizer, PulseSynchronizer
from amaranth.lib.fifo import AsyncFIFOBuffered
from amaranth.lib.wiring import In, Out

from ..sdram.commands import PLACE_WIDTH
from ..sdram.display_port import frame_layout
from .color_bars import ColorBars
from .double_buffer import DoubleBuffer
from .dvi_transmitter import NUM_CHANNELS, DviTransmitter
from .frame_reader import FrameReader
from .line_buffer import LineBuffer, pixel_layout
from .timing_generator import TimingGenerator, place_layout

__all__ = ["BarScreen", "Display", "transmit"]

#: Pixels between two clocks; the memory's :class:`~rtl.sdram.display_port.DisplayPort` holds many more.
_CROSSING = 16


class BarScreen(wiring.Component):
    """A screen that shows the test picture, whatever else works: needs clocks ``pixel`` and ``shift``, and pins.

    Parameters
    ----------
    mode : :class:`~.mode.VideoMode`
        Of the screen.

    Members
    -------
    pairs : see :class:`~.dvi_transmitter.DviTransmitter`
    """

    def __init__(self, mode):
        self._mode = mode
        super().__init__({"pairs": Out(data.ArrayLayout(2, NUM_CHANNELS))})

    def elaborate(self, platform):
        m = Module()
        timing, bars = TimingGenerator(self._mode), ColorBars(self._mode)
        m.submodules.timing = DomainRenamer("pixel")(timing)
        m.submodules.bars = DomainRenamer("pixel")(bars)
        m.submodules.dvi = dvi = DviTransmitter()
        m.d.comb += [bars.place.eq(timing.place), self.pairs.eq(dvi.pairs)]
        transmit(m, self._mode, timing.place, bars.color, dvi)
        return m


class Display(wiring.Component):
    """Shows one of two frames in a memory, tear-free, or the test picture.

    The memory's side is in the domain ``sync``, the screen's in ``pixel`` and ``shift``. A line that the memory has not
    delivered in time is black, and counted.

    Parameters
    ----------
    mode : :class:`~.mode.VideoMode`
        Of the screen.
    chip : :class:`~rtl.sdram.timing.SdramChip`
        For the width of addresses.
    scale : int
        2 for pictures of half the screen's width and height.
    stride : int
        Words from row to row of a frame.

    Members
    -------
    test : the test picture instead
    ready : the memory answers; lines that are late before the next frame do not count
    bases, swap, pending, shown, draw : see :class:`~.double_buffer.DoubleBuffer`
    frame, word : to and from the memory's :class:`~rtl.sdram.display_port.DisplayPort`
    frames, late : count frames shown, and lines that were late, since reset
    pairs : see :class:`~.dvi_transmitter.DviTransmitter`
    """

    def __init__(self, mode, *, chip, scale=1, stride=1024):
        self._mode = mode
        self._chip = chip
        self._scale = scale
        self._stride = stride
        base_width = chip.word_width - PLACE_WIDTH
        super().__init__({
            "test": In(1),
            "ready": In(1, init=1),
            "bases": In(base_width).array(2),
            "swap": In(1),
            "pending": Out(1),
            "shown": Out(1),
            "draw": Out(base_width),
            "frame": Out(stream.Signature(frame_layout(chip))),
            "word": In(stream.Signature(32)),
            "frames": Out(32),
            "late": Out(32),
            "pairs": Out(data.ArrayLayout(2, NUM_CHANNELS)),
        })

    def elaborate(self, platform):
        m = Module()
        mode = self._mode
        in_pixel = DomainRenamer("pixel")
        timing, bars, lines = TimingGenerator(mode), ColorBars(mode), LineBuffer(mode, scale=self._scale)
        m.submodules.timing = in_pixel(timing)
        m.submodules.bars = in_pixel(bars)
        m.submodules.lines = in_pixel(lines)
        m.submodules.dvi = dvi = DviTransmitter()
        m.submodules.buffer = buffer = DoubleBuffer(base_width=len(self.draw))
        m.submodules.reader = reader = FrameReader(
            chip=self._chip, width=mode.width // self._scale, height=mode.height // self._scale, stride=self._stride)

        # From the memory's clock to the pixels', and back.
        m.submodules.crossing = crossing = AsyncFIFOBuffered(
            width=pixel_layout().size, depth=_CROSSING, w_domain="sync", r_domain="pixel")
        m.submodules.blanks = blanks = PulseSynchronizer("pixel", "sync")
        m.submodules.lates = lates = PulseSynchronizer("pixel", "sync")
        tests, was_blank = Signal(), Signal()
        m.submodules.tests = FFSynchronizer(self.test, tests, o_domain="pixel")
        m.d.pixel += was_blank.eq(timing.place.blank)
        m.d.comb += [
            crossing.w_data.eq(reader.pixel.payload), crossing.w_en.eq(reader.pixel.valid),
            reader.pixel.ready.eq(crossing.w_rdy),
            lines.i.payload.eq(crossing.r_data), lines.i.valid.eq(crossing.r_rdy),
            crossing.r_en.eq(lines.i.ready),
            blanks.i.eq(timing.place.blank & ~was_blank),
            lates.i.eq(lines.late),
        ]
        begun = Signal()
        m.d.sync += [begun.eq(begun | blanks.o & self.ready), self.frames.eq(self.frames + blanks.o),
                     self.late.eq(self.late + (lates.o & begun))]

        m.d.comb += [
            *(base.eq(given) for base, given in zip(buffer.bases, self.bases, strict=True)),
            buffer.swap.eq(self.swap), buffer.blank.eq(blanks.o),
            self.pending.eq(buffer.pending), self.shown.eq(buffer.shown), self.draw.eq(buffer.draw),
            reader.begin.eq(buffer.begin), reader.base.eq(buffer.show),
        ]
        wiring.connect(m, reader.frame, wiring.flipped(self.frame))
        wiring.connect(m, wiring.flipped(self.word), reader.word)

        color = Signal(24)
        m.d.comb += [lines.place.eq(timing.place), bars.place.eq(timing.place),
                     color.eq(Mux(tests, bars.color, lines.color)), self.pairs.eq(dvi.pairs)]
        transmit(m, mode, timing.place, color, dvi)
        return m


def transmit(m, mode, place, color, dvi):
    """A colour that has the latency of :class:`ColorBars`, with the place it belongs to."""
    for stage in range(ColorBars.latency):
        before, place = place, Signal(place_layout(mode), name=f"place{stage}", reset_less=True)
        m.d.pixel += place.eq(before)
    m.d.comb += [dvi.color.eq(color), dvi.active.eq(place.active), dvi.h_sync.eq(place.h_sync),
                 dvi.v_sync.eq(place.v_sync)]
