"""Where the rays of a packet end: their colours become pixels."""

from amaranth.hdl import Cat, Module, Signal
from amaranth.lib import data, stream, wiring
from amaranth.lib.wiring import In, Out

from fpu import Delay

from .encode import Encode
from .layout import PACKET_RAYS, thread_width
from .queue import Queue
from .register_file import lanes_layout
from .write_out import pixel_layout

__all__ = ["PixelEncoder", "ended_layout"]

_QUEUE_DEPTH = 16


def ended_layout(*, fmt, num_threads):
    """A ray that has ended, with three lanes of colour."""
    return data.StructLayout({"valid": 1, "thread": thread_width(num_threads), "ray": range(PACKET_RAYS),
                              "color": lanes_layout(fmt)})


class PixelEncoder(wiring.Component):
    """Encodes the colours of rays that have ended, one a cycle, see :class:`~rtl.encode.Encode`.

    Parameters
    ----------
    fmt : :class:`~fpu.FloatFormat`
        Format of floats.
    num_threads, index_width, coord_width : int
        See :class:`~rtl.config.ChipConfig`.

    Members
    -------
    ended : a ray that has ended, see :func:`ended_layout`
    may_end : there is room for one
    position_address, position : to and from the :class:`~rtl.threads.Threads`
    pixel : stream of pixels; of their hits only that they are none
    idle : no pixel is under way
    """

    def __init__(self, *, fmt, num_threads, index_width, coord_width):
        self._pixel = pixel_layout(fmt=fmt, index_width=index_width, coord_width=coord_width)
        self._place = data.StructLayout({"x": coord_width, "y": coord_width})
        super().__init__({
            "ended": In(ended_layout(fmt=fmt, num_threads=num_threads)),
            "may_end": Out(1),
            "position_address": Out(thread_width(num_threads)),
            "position": In(self._place),
            "pixel": Out(stream.Signature(self._pixel)),
            "idle": Out(1),
        })

    def elaborate(self, platform):
        m = Module()
        m.submodules.encode = encode = Encode()
        m.submodules.queue = queue = Queue(self._pixel, depth=_QUEUE_DEPTH, always_ready=True)
        m.submodules.place = place = Delay(self._place, cycles=encode.latency)
        valid = Signal(encode.latency + 1)
        pending = Signal(range(_QUEUE_DEPTH + 1))
        red, green, blue = encode.encoded
        m.d.comb += [
            self.position_address.eq(self.ended.thread),
            self.may_end.eq(pending < _QUEUE_DEPTH),
            valid[0].eq(self.ended.valid),
            place.i.x.eq(self.position.x + self.ended.ray[0]),
            place.i.y.eq(self.position.y + self.ended.ray[1]),
            *(encoded.eq(color) for encoded, color in zip(encode.color, self.ended.color, strict=True)),
            queue.i.valid.eq(valid[-1]),
            queue.i.payload.x.eq(place.o.x),
            queue.i.payload.y.eq(place.o.y),
            queue.i.payload.color.eq(Cat(blue, green, red)),
            self.idle.eq(~pending.any()),
        ]
        taken = Signal()
        m.d.sync += [valid[1:].eq(valid[:-1]), taken.eq(self.pixel.valid & self.pixel.ready),
                     pending.eq(pending + self.ended.valid - taken)]
        wiring.connect(m, queue.o, wiring.flipped(self.pixel))
        return m
