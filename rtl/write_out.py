"""Write-out: a finished packet's hits become pixels."""

from amaranth.hdl import Cat, Module, Mux, Signal
from amaranth.lib import data, stream, wiring
from amaranth.lib.wiring import In, Out

from fpu import Delay, FloatToInt

from .cache import WORD_WIDTH
from .intersection import hit_layout
from .layout import PACKET_RAYS, thread_width, token_layout
from .queue import Queue

__all__ = ["INTENSITY_BITS", "WriteOut", "pixel_layout"]

#: Fraction bits of the light on a surface: 256 stands for |D′z| ≥ 1.
INTENSITY_BITS = 8


def pixel_layout(*, fmt, index_width, coord_width):
    """A pixel: where it is, what its ray has hit, and its colour (blue in the lowest byte)."""
    return data.StructLayout({
        "x": coord_width, "y": coord_width, "is_hit": 1,
        "hit": hit_layout(fmt=fmt, index_width=index_width), "color": 24,
    })


class WriteOut(wiring.Component):
    """Colours each ray of a packet by its triangle's colour × |D′z|, and writes its pixel; a pixel a clock.

    The colour of triangle i is word i of the shading memory. |D′z|, the free dot product of §2.1.3, is cut to
    eight fraction bits and counts as 1 above 1; a channel is (colour · intensity) >> 8.

    Parameters
    ----------
    fmt : :class:`~fpu.FloatFormat`
        Format of hits.
    num_threads, stack_depth, index_width, coord_width : int
        See :class:`~rtl.config.ChipConfig`.

    may_be_none : bool
        A record of triangle number all ones is that of no hit.

    Members
    -------
    width, height : size of the picture; what lies outside is not written
    background : colour of rays that hit nothing
    packet : stream of tokens: packets whose rays are traced
    finished : stream of tokens: the packet's thread is free
    position_address, position : to and from the :class:`~rtl.ray_generation.RayGeneration`
    record_address, record : to and from the :class:`~rtl.intersection.Intersection`
    color_request : stream of triangle numbers, to the shading memory
    color_data : stream of words from the shading memory, in the order requested
    pixel : stream of pixels
    idle : no pixel is under way
    """

    #: Colours that can be on their way.
    num_requests = 16

    def __init__(self, *, fmt, num_threads, stack_depth, index_width, coord_width, may_be_none=False):
        self._fmt = fmt
        self._may_be_none = may_be_none
        self._token = token = token_layout(num_threads=num_threads, stack_depth=stack_depth)
        self._record = hit_layout(fmt=fmt, index_width=index_width)
        self._coord_width = coord_width
        self._index_width = index_width
        self._pixel = pixel_layout(fmt=fmt, index_width=index_width, coord_width=coord_width)
        position = data.StructLayout({"x": coord_width, "y": coord_width})
        super().__init__({
            "width": In(coord_width),
            "height": In(coord_width),
            "background": In(24),
            "packet": In(stream.Signature(token)),
            "finished": Out(stream.Signature(token, always_ready=True)),
            "position_address": Out(thread_width(num_threads)),
            "position": In(position),
            "record_address": Out(data.StructLayout({"ray": range(PACKET_RAYS), "thread": thread_width(num_threads)})),
            "record": In(self._record),
            "color_request": Out(stream.Signature(index_width)),
            "color_data": In(stream.Signature(WORD_WIDTH, always_ready=True)),
            "pixel": Out(stream.Signature(self._pixel)),
            "idle": Out(1),
        })

    def elaborate(self, platform):
        m = Module()
        depth = self.num_requests
        pending_layout = data.StructLayout({"pixel": self._pixel, "intensity": INTENSITY_BITS + 1})
        m.submodules.wanted = wanted = Queue(self._index_width, depth=depth, always_ready=True)
        m.submodules.pending = pending = Queue(pending_layout, depth=depth, always_ready=True)
        m.submodules.colors = colors = Queue(24, depth=depth, always_ready=True)
        wiring.connect(m, wanted.o, wiring.flipped(self.color_request))

        # A ray a clock, while all that are under way have room to wait for their colours.
        ray = Signal(range(PACKET_RAYS))
        take = Signal()
        last = Signal()
        under_way = Signal(range(depth + 1))
        moves, outside, moved, left = Signal(), Signal(), Signal(), Signal()
        token = self.packet.payload
        m.d.comb += [
            take.eq(self.packet.valid & (under_way < depth)),
            last.eq(ray == PACKET_RAYS - 1),
            self.packet.ready.eq(take & last),
            self.finished.valid.eq(take & last),
            self.finished.payload.eq(token),
            self.position_address.eq(token.thread),
            self.record_address.ray.eq(ray),
            self.record_address.thread.eq(token.thread),
        ]
        # Whether a pixel moves is known late, from whoever takes it; that there is room, a cycle later is soon enough.
        m.d.sync += [moved.eq(moves), left.eq(outside), under_way.eq(under_way + take - moved - left)]
        with m.If(take):
            m.d.sync += ray.eq(ray + 1)

        # From the record to the light on the surface.
        place_layout = data.StructLayout({"x": self._coord_width, "y": self._coord_width, "is_hit": 1})
        read_latency, convert_latency = 2, 2
        m.submodules.place = place = Delay(place_layout, cycles=read_latency + convert_latency)
        m.submodules.hit = hit = Delay(self._record, cycles=convert_latency)
        m.submodules.bright = bright = Delay(1, cycles=convert_latency)
        m.submodules.convert = convert = FloatToInt(
            self._fmt, int_width=INTENSITY_BITS + 1, signed=False, latency=convert_latency)
        valid = Signal(read_latency + convert_latency + 1)
        cosine = self.record.cosine
        m.d.comb += [
            place.i.x.eq(self.position.x + ray[0]),
            place.i.y.eq(self.position.y + ray[1]),
            place.i.is_hit.eq(token.hit.bit_select(ray, 1)),
            hit.i.eq(self.record),
            # Below 1 the exponent can be raised by INTENSITY_BITS without overflow, unless there are too few.
            bright.i.eq(cosine.exp >= self._fmt.bias),
            convert.a.frac.eq(cosine.frac),
            convert.a.exp.eq(Mux(cosine.exp == 0, 0, cosine.exp + INTENSITY_BITS)),
            valid[0].eq(take),
        ]
        m.d.sync += valid[1:].eq(valid[:-1])
        is_inside = Signal()
        is_hit = place.o.is_hit
        if self._may_be_none:
            is_hit = Signal()
            m.d.comb += is_hit.eq(place.o.is_hit & ~hit.o.triangle.all())
        m.d.comb += [
            is_inside.eq((place.o.x < self.width) & (place.o.y < self.height)),
            outside.eq(valid[-1] & ~is_inside),
            pending.i.valid.eq(valid[-1] & is_inside),
            pending.i.payload.pixel.x.eq(place.o.x),
            pending.i.payload.pixel.y.eq(place.o.y),
            pending.i.payload.pixel.is_hit.eq(is_hit),
            pending.i.payload.pixel.hit.eq(hit.o),
            pending.i.payload.intensity.eq(Mux(bright.o, 1 << INTENSITY_BITS, convert.r)),
            wanted.i.valid.eq(pending.i.valid & is_hit),
            wanted.i.payload.eq(hit.o.triangle),
            colors.i.valid.eq(self.color_data.valid),
            colors.i.payload.eq(self.color_data.payload),
        ]

        pixel = Signal(self._pixel, reset_less=True)
        pixel_valid = Signal()
        waiting = pending.o.payload
        m.d.comb += [
            moves.eq(pending.o.valid & (colors.o.valid | ~waiting.pixel.is_hit) & (~pixel_valid | self.pixel.ready)),
            pending.o.ready.eq(moves),
            colors.o.ready.eq(moves & waiting.pixel.is_hit),
            self.pixel.payload.eq(pixel),
            self.pixel.valid.eq(pixel_valid),
            self.idle.eq(~under_way.any() & ~pixel_valid),
        ]
        with m.If(moves):
            m.d.sync += [pixel.eq(waiting.pixel), pixel.color.eq(self.background), pixel_valid.eq(1)]
            with m.If(waiting.pixel.is_hit):
                m.d.sync += pixel.color.eq(Cat(
                    ((colors.o.payload[8 * channel:8 * channel + 8] * waiting.intensity) >> INTENSITY_BITS)[:8]
                    for channel in range(3)))
        with m.Elif(self.pixel.ready):
            m.d.sync += pixel_valid.eq(0)
        return m
