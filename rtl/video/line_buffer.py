"""Two lines of a picture: the one that is shown, and the next."""

from amaranth.hdl import Cat, Module, Mux, Signal
from amaranth.lib import data, stream, wiring
from amaranth.lib.wiring import In, Out

from ..block_memory import BlockMemory
from .timing_generator import place_layout

__all__ = ["LineBuffer", "pixel_layout"]


def pixel_layout():
    """A pixel of a picture, the ``first`` of a frame marked."""
    return data.StructLayout({"color": 24, "first": 1})


class LineBuffer(wiring.Component):
    """Shows a stream of a picture's pixels, each as ``scale`` × ``scale`` pixels.

    Of a picture, row r is kept until it has been shown, while row r + 1 comes. A row that is not there when it is to be
    shown is black, and counted; its pixels are dropped when they come, so the rows behind it are where they belong.
    Between two frames it drops all until the first pixel of a frame.

    Latency 2 cycles, throughput a pixel a cycle.

    Parameters
    ----------
    mode : :class:`~.mode.VideoMode`
        What the picture is shown in.
    scale : int
        1 or 2.

    Members
    -------
    place : see :func:`~.timing_generator.place_layout`
    i : stream of pixels
    color : red, green and blue, 8 bits each, red in the highest
    late : a line begins that is not there

    Raises
    ------
    ValueError
        If the screen is no multiple of ``scale``.
    """

    #: In cycles
    latency = 2

    def __init__(self, mode, *, scale=1):
        if scale not in (1, 2) or mode.width % scale or mode.height % scale:
            raise ValueError(f"{mode.name}: pixels are shown {scale}-fold; a scale is 1 or 2, and divides the screen")
        self._mode = mode
        self._scale = scale
        super().__init__({
            "place": In(place_layout(mode)),
            "i": In(stream.Signature(pixel_layout())),
            "color": Out(24),
            "late": Out(1),
        })

    def elaborate(self, platform):
        m = Module()
        scale, place = self._scale, self.place
        width, height = self._mode.width // scale, self._mode.height // scale
        doubles = scale.bit_length() - 1
        column_width = (width - 1).bit_length()
        m.submodules.rows = rows = BlockMemory(24, depth=2 << column_width)

        # The row that is shown, or will be next; what comes before ``place.active`` belongs to the row after it.
        shown, showing, good = Signal(range(height + 2)), Signal(), Signal()
        begins, ends = Signal(), Signal()
        was_active, was_blank = Signal(), Signal()
        m.d.sync += [was_active.eq(place.active), was_blank.eq(place.blank)]
        m.d.comb += [begins.eq(place.active & ~was_active), ends.eq(was_active & ~place.active)]
        first, last = Signal(init=1), Signal(init=1)
        if doubles:
            m.d.comb += [first.eq(~place.y[0]), last.eq(place.y[0])]
        # A pixel that is written must not meet the first that is read.
        with m.If(begins):
            m.d.sync += showing.eq(1)
        with m.If(ends & last):
            m.d.sync += [showing.eq(0), shown.eq(shown + 1)]

        filled, column, seeks = Signal(range(height + 1)), Signal(range(width)), Signal(init=1)
        there, is_there, taken, kept = Signal(), Signal(), Signal(), Signal()
        m.d.comb += [
            # What comes after a row has begun is dropped, so that it is not there when it is repeated either.
            is_there.eq(Mux(first, filled > shown, there)),
            self.late.eq(begins & ~is_there),
            # Up to one row ahead, and none behind the last.
            self.i.ready.eq(seeks | (filled <= shown + 1) & (filled != height)),
            taken.eq(self.i.valid & self.i.ready & (~seeks | self.i.payload.first)),
            kept.eq(taken & ~((filled < shown) | (filled == shown) & (showing | place.active))),
            rows.write.valid.eq(kept),
            rows.write.address.eq(Cat(column, filled[0])),
            rows.write.data.eq(self.i.payload.color),
            rows.address.eq(Cat((place.x >> doubles)[:column_width], shown[0])),
            rows.reading.eq(place.active),
            self.color.eq(Mux(good, rows.data, 0)),
        ]
        with m.If(taken):
            m.d.sync += [seeks.eq(0), column.eq(column + 1)]
            with m.If(column == width - 1):
                m.d.sync += [column.eq(0), filled.eq(filled + 1)]
        # Behind the last line of a frame
        with m.If(place.blank & ~was_blank):
            m.d.sync += [shown.eq(0), showing.eq(0), filled.eq(0), column.eq(0), seeks.eq(1)]
        m.d.sync += [there.eq(Mux(begins, is_there, there)), good.eq(there)]
        return m
