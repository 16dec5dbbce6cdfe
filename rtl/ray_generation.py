"""The ray generation controller: which packet is begun next, and by which pipeline."""

from amaranth.hdl import Cat, Module, Signal
from amaranth.lib import data, stream, wiring
from amaranth.lib.wiring import In, Out

from .layout import PACKET_RAYS
from .queue import Queue

__all__ = ["TILE_BITS", "RayGeneration", "packet_layout", "packet_order"]

#: A tile is a square of 2**TILE_BITS packets a side.
TILE_BITS = 3


def packet_order(width, height):
    """The packets of a picture in the order in which they are begun: pixel (x, y) of ray 0 of each.

    Tiles go row by row, packets of a tile along a Morton curve, so that packets at work together are close.
    """
    side = 2 << TILE_BITS
    for tile_y in range(0, height, side):
        for tile_x in range(0, width, side):
            for number in range(1 << 2 * TILE_BITS):
                x = tile_x + 2 * sum((number >> 2 * bit & 1) << bit for bit in range(TILE_BITS))
                y = tile_y + 2 * sum((number >> 2 * bit + 1 & 1) << bit for bit in range(TILE_BITS))
                if x < width and y < height:
                    yield x, y


def packet_layout(coord_width):
    """A packet of a picture: pixel (x, y) of ray 0, and which rays are inside the picture."""
    return data.StructLayout({"x": coord_width, "y": coord_width, "mask": PACKET_RAYS})


class RayGeneration(wiring.Component):
    """Hands the packets of a picture to the pipelines, each to the next that has room for one.

    The first is offered three cycles after ``start``; then one a cycle, a cycle without for each beyond the picture.

    Parameters
    ----------
    coord_width : int
        See :class:`~rtl.config.ChipConfig`.
    num_pipelines : int
        Pipelines, each with room for two packets that it has not begun if there are several.

    Members
    -------
    width, height : size of the picture in pixels
    start : begin a picture; ``ready`` must be set
    ready : all packets of the picture have been taken
    packet : array of streams of :func:`packet_layout`, one for each pipeline
    """

    def __init__(self, *, coord_width, num_pipelines=1):
        self._coord_width = coord_width
        self._num_pipelines = num_pipelines
        self._packet = packet_layout(coord_width)
        super().__init__({
            "width": In(coord_width),
            "height": In(coord_width),
            "start": In(1),
            "ready": Out(1),
            "packet": Out(stream.Signature(self._packet)).array(num_pipelines),
        })

    def elaborate(self, platform):
        m = Module()
        side = 2 << TILE_BITS
        tile_x, tile_y = Signal(self._coord_width + 1), Signal(self._coord_width + 1)
        number = Signal(2 * TILE_BITS)
        drawing, last_column, last_row = Signal(), Signal(), Signal()
        x, y, placed, inside = Signal(self._coord_width + 1), Signal(self._coord_width + 1), Signal(), Signal()
        packet, offered = Signal(self._packet), Signal()
        place, offer, issued, all_taken = Signal(), Signal(), Signal(), Signal(init=1)
        m.d.comb += [
            offer.eq(issued | ~offered),
            place.eq(offer | ~placed),
            inside.eq((x < self.width) & (y < self.height)),
            self.ready.eq(~drawing & ~placed & ~offered & all_taken),
        ]
        if self._num_pipelines == 1:
            target, = self.packet
            m.d.comb += [target.valid.eq(offered), target.payload.eq(packet), issued.eq(offered & target.ready)]
        else:
            self._distribute(m, packet, offered, issued, all_taken)

        with m.If(offer):
            m.d.sync += [offered.eq(placed & inside), packet.x.eq(x), packet.y.eq(y)]
            for ray in range(PACKET_RAYS):
                m.d.sync += packet.mask[ray].eq((x + (ray & 1) < self.width) & (y + (ray >> 1) < self.height))
        with m.If(place):
            m.d.sync += [placed.eq(drawing), x.eq(tile_x + Cat(0, number[0::2])), y.eq(tile_y + Cat(0, number[1::2]))]

        # Read when a tile ends, long after it has begun.
        m.d.sync += [last_column.eq(tile_x + side >= self.width), last_row.eq(tile_y + side >= self.height)]
        with m.If(self.start):
            m.d.sync += [drawing.eq(1), tile_x.eq(0), tile_y.eq(0), number.eq(0)]
        with m.Elif(drawing & place):
            m.d.sync += number.eq(number + 1)
            with m.If(number.all()):
                m.d.sync += tile_x.eq(tile_x + side)
                with m.If(last_column):
                    m.d.sync += [tile_x.eq(0), tile_y.eq(tile_y + side), drawing.eq(~last_row)]
        return m

    def _distribute(self, m, packet, offered, issued, all_taken):
        """To the pipeline whose turn it is, or the next one that has room."""
        queues = [Queue(self._packet, depth=2) for _ in range(self._num_pipelines)]
        turn = Signal(range(self._num_pipelines))
        m.d.comb += all_taken.eq(~Cat(queue.o.valid for queue in queues).any())
        for number, (queue, target) in enumerate(zip(queues, self.packet, strict=True)):
            m.submodules[f"queue{number}"] = queue
            wiring.connect(m, queue.o, wiring.flipped(target))
            m.d.comb += queue.i.payload.eq(packet)
        with m.Switch(turn):
            for first in range(self._num_pipelines):
                with m.Case(first):
                    # The last assignment wins, so the pipeline whose turn it is comes last.
                    for offset in reversed(range(self._num_pipelines)):
                        number = (first + offset) % self._num_pipelines
                        with m.If(queues[number].i.ready):
                            m.d.comb += [[queue.i.valid.eq(0) for queue in queues],
                                         queues[number].i.valid.eq(offered), issued.eq(offered)]
                            with m.If(offered):
                                m.d.sync += turn.eq((number + 1) % self._num_pipelines)
