"""Queues and the merging of streams."""

from amaranth.hdl import Assert, Module, Mux, Shape, Signal
from amaranth.lib import fifo, stream, wiring
from amaranth.lib.wiring import In, Out

__all__ = ["Merge", "Queue", "merged"]


class Queue(wiring.Component):
    """First in, first out; an element written in one cycle can be read in the next.

    Parameters
    ----------
    shape : :ref:`shape-like <lang-shapelike>`
        Shape of an element.
    depth : int
        Elements that fit.
    always_ready : bool
        The writer does not look at ``ready``, having other grounds to know that there is room: a token queue
        as deep as there are threads, say. That it is right is asserted in simulation.

    Members
    -------
    i, o : stream of ``shape``
    level : elements held
    """

    def __init__(self, shape, *, depth, always_ready=False):
        self._width = Shape.cast(shape).width
        self._depth = depth
        super().__init__({
            "i": In(stream.Signature(shape, always_ready=always_ready)),
            "o": Out(stream.Signature(shape)),
            "level": Out(range(depth + 1)),
        })

    def elaborate(self, platform):
        m = Module()
        m.submodules.fifo = queue = fifo.SyncFIFO(width=self._width, depth=self._depth)
        m.d.comb += [
            queue.w_data.eq(self.i.payload),
            queue.w_en.eq(self.i.valid),
            self.o.payload.eq(queue.r_data),
            self.o.valid.eq(queue.r_rdy),
            queue.r_en.eq(self.o.ready),
            self.level.eq(queue.level),
        ]
        if self.i.signature.always_ready:
            m.d.sync += Assert(~self.i.valid | queue.w_rdy, "a queue overflows")
        else:
            m.d.comb += self.i.ready.eq(queue.w_rdy)
        return m


class Merge(wiring.Component):
    """Joins streams into one, fairly: after a transfer the next input in turn goes first.

    What is offered is offered until it is taken, if inputs do so.

    Parameters
    ----------
    shape : :ref:`shape-like <lang-shapelike>`
        Shape of an element.
    num_inputs : int
        Streams to join.

    Members
    -------
    i : array of streams of ``shape``
    o : stream of ``shape``; combinational from ``i``
    """

    def __init__(self, shape, *, num_inputs):
        self._num_inputs = num_inputs
        super().__init__({
            "i": In(stream.Signature(shape)).array(num_inputs),
            "o": Out(stream.Signature(shape)),
        })

    def elaborate(self, platform):
        m = Module()
        turn = Signal(range(self._num_inputs))
        with m.Switch(turn):
            for first in range(self._num_inputs):
                with m.Case(first):
                    # The last assignment wins, so the input whose turn it is comes last.
                    for offset in reversed(range(self._num_inputs)):
                        number = (first + offset) % self._num_inputs
                        candidate = self.i[number]
                        with m.If(candidate.valid):
                            m.d.comb += [
                                self.o.payload.eq(candidate.payload),
                                self.o.valid.eq(1),
                                [other.ready.eq(0) for other in self.i],
                                candidate.ready.eq(self.o.ready),
                            ]
                            m.d.sync += turn.eq(Mux(self.o.ready, (number + 1) % self._num_inputs, number))
        return m


def merged(m, name, sources):
    """One stream of several, by a :class:`Merge` that is the submodule ``name`` of ``m``; of one, itself."""
    first, *others = sources
    if not others:
        return first
    m.submodules[name] = merge = Merge(first.payload.shape(), num_inputs=len(sources))
    for source, target in zip(sources, merge.i, strict=True):
        wiring.connect(m, source, target)
    return merge.o
