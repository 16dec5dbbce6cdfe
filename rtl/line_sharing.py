"""Several caches on one memory port."""

from amaranth.hdl import Module, Signal
from amaranth.lib import stream, wiring
from amaranth.lib.wiring import In, Out
from amaranth.utils import ceil_log2

from .cache import WORD_WIDTH
from .queue import Queue, merged

__all__ = ["LineSharing"]


class LineSharing(wiring.Component):
    """Passes line requests on, in turn, and the words that come back to whoever asked.

    Parameters
    ----------
    num_users, num_fetches : int
        Caches, and lines that each may have requested at a time.
    line_width : int
        Bits of a line's number.
    line_words : int
        Words of a line.

    Members
    -------
    request : array of streams of line numbers
    data : array of streams of words
    line_request, line_data : to and from the memory, which answers in order
    """

    def __init__(self, *, num_users, num_fetches, line_width, line_words):
        self._num_users = num_users
        self._num_fetches = num_fetches
        self._line_words = line_words
        word = stream.Signature(WORD_WIDTH, always_ready=True)
        super().__init__({
            "request": In(stream.Signature(line_width)).array(num_users),
            "data": Out(word).array(num_users),
            "line_request": Out(stream.Signature(line_width)),
            "line_data": In(word),
        })

    def elaborate(self, platform):
        m = Module()
        m.submodules.owners = owners = Queue(max(ceil_log2(self._num_users), 1), always_ready=True,
                                             depth=self._num_users * self._num_fetches)
        number = Signal(range(self._num_users))
        word = Signal(range(self._line_words))
        last = Signal()
        for user, request in enumerate(self.request):
            with m.If(request.valid & request.ready):
                m.d.comb += number.eq(user)
        requests = merged(m, "merge", [wiring.flipped(request) for request in self.request])
        wiring.connect(m, requests, wiring.flipped(self.line_request))
        m.d.comb += [
            owners.i.payload.eq(number),
            owners.i.valid.eq(self.line_request.valid & self.line_request.ready),
            last.eq(word == self._line_words - 1),
            owners.o.ready.eq(self.line_data.valid & last),
        ]
        for user, target in enumerate(self.data):
            m.d.comb += [target.payload.eq(self.line_data.payload),
                         target.valid.eq(self.line_data.valid & (owners.o.payload == user))]
        with m.If(self.line_data.valid):
            m.d.sync += word.eq(word + 1)
            with m.If(last):
                m.d.sync += word.eq(0)
        return m
