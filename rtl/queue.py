"""Queues and the merging of streams."""

from amaranth.hdl import Assert, Cat, Module, Mux, Shape, Signal, Value
from amaranth.lib import memory, stream, wiring
from amaranth.lib.wiring import In, Out

from .block_memory import BlockMemory
from .least_recent import selected

__all__ = ["Merge", "Queue", "merged"]

#: Elements of a distributed memory of ECP5, of two in a row, and bits of a block RAM's word.
_ONE, _TWO, _WORD = 16, 32, 36


def _belongs_in_block(width, depth):
    """Whether block RAM is worth it: for what one distributed memory does not hold only if it is well used."""
    return depth > _TWO or (depth > _ONE and width / (-(-width // _WORD) * _WORD) > 3 / 5)


class Queue(wiring.Component):
    """First in, first out, with its oldest element in a register.

    What is written to an empty queue can be read in the next cycle. One element a cycle goes in and one comes out;
    from block RAM, a cycle may pass without one before an element that found only one other there.

    Parameters
    ----------
    shape : :ref:`shape-like <lang-shapelike>`
        Shape of an element.
    depth : int
        Elements that fit.
    always_ready : bool
        The writer does not look at ``ready``, having other grounds to know that there is room: a token queue
        as deep as there are threads, say. That it is right is asserted in simulation.
    block : bool or None
        Whether block RAM keeps them. By default what is more than the 32 elements of two distributed memories, and
        one in the register; and what is more than 16 and one if its words fill three fifths of block RAMs'.

    Members
    -------
    i, o : stream of ``shape``
    level : elements held
    """

    def __init__(self, shape, *, depth, always_ready=False, block=None):
        self._width = Shape.cast(shape).width
        self._depth = depth
        self._block = _belongs_in_block(self._width, depth - 1) if block is None else block
        super().__init__({
            "i": In(stream.Signature(shape, always_ready=always_ready)),
            "o": Out(stream.Signature(shape)),
            "level": Out(range(depth + 1)),
        })

    def elaborate(self, platform):
        m = Module()
        head, has_head = Signal(self._width, reset_less=True), Signal()
        accepted, taken, free = Signal(), Signal(), Signal()
        room = Signal(init=1)
        level = Signal.like(self.level)
        m.d.comb += [
            self.o.payload.eq(head),
            self.o.valid.eq(has_head),
            accepted.eq(self.i.valid & self.i.ready),
            taken.eq(has_head & self.o.ready),
            free.eq(~has_head | self.o.ready),
            level.eq(self.level + accepted - taken),
        ]
        m.d.sync += [self.level.eq(level), room.eq(level != self._depth)]
        if self.i.signature.always_ready:
            m.d.sync += Assert(~self.i.valid | room, "a queue overflows")
        else:
            m.d.comb += self.i.ready.eq(room)

        # Behind the head: what is next, and whether it and others are there.
        following, has_following, has_others = Signal(self._width), Signal(), Signal()
        stored = Signal()
        m.d.comb += stored.eq(accepted & ~(free & ~has_others))
        with m.If(free):
            m.d.sync += [has_head.eq(has_following | accepted & ~has_others),
                         head.eq(Mux(has_others, following, self.i.payload))]
        if self._block:
            self._keep_in_block(m, stored, free, following, has_following, has_others)
        elif self._depth > 1:
            self._keep(m, stored, free, following, has_following, has_others)
        return m

    def _keep(self, m, stored, free, following, has_following, has_others):
        depth = self._depth - 1
        m.submodules.storage = storage = memory.Memory(shape=self._width, depth=depth, init=[])
        read, write = storage.read_port(domain="comb"), storage.write_port()
        fetched = Signal()
        first, last, some = self._places(m, stored=stored, fetched=fetched, depth=depth)
        m.d.comb += [
            write.addr.eq(last),
            write.data.eq(self.i.payload),
            write.en.eq(stored),
            read.addr.eq(first),
            following.eq(read.data),
            has_following.eq(some),
            has_others.eq(some),
            fetched.eq(some & free),
        ]

    def _keep_in_block(self, m, stored, free, following, has_following, has_others):
        m.submodules.storage = storage = BlockMemory(self._width, depth=self._depth, registered=False)
        fetched = Signal()
        # What has been asked for is at the memory's output, and no longer among those between the places.
        first, last, some = self._places(m, stored=stored, fetched=fetched, depth=self._depth)
        m.d.comb += [
            storage.write.valid.eq(stored),
            storage.write.address.eq(last),
            storage.write.data.eq(self.i.payload),
            storage.address.eq(first),
            storage.reading.eq(fetched),
            following.eq(storage.data),
            has_others.eq(has_following | some),
            fetched.eq(some & (free | ~has_following)),
        ]
        m.d.sync += has_following.eq(fetched | has_following & ~free)

    @staticmethod
    def _places(m, *, stored, fetched, depth):
        """Where the first is, where the next goes, and whether there are any.

        What comes late, whether one is stored or fetched, does little more than enable registers.
        """
        first, second, last = Signal(range(depth)), Signal(range(depth), init=1 % depth), Signal(range(depth))
        for place, moves in ((last, stored), (second, fetched)):
            with m.If(moves):
                m.d.sync += place.eq(Mux(place == depth - 1, 0, place + 1))
        with m.If(fetched):
            m.d.sync += first.eq(second)
        # Many a bit is selected by it, so it comes from a register. With one place, the first is always the last one.
        some = Signal()
        m.d.sync += some.eq(stored | some & ~(fetched & (second == last)))
        return first, last, some


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
        turn, chosen = Signal(range(self._num_inputs)), Signal(self._num_inputs)
        valid = Cat(each.valid for each in self.i)
        with m.Switch(turn):
            for first in range(self._num_inputs):
                with m.Case(first):
                    for number in range(self._num_inputs):
                        earlier = [valid[(first + offset) % self._num_inputs]
                                   for offset in range((number - first) % self._num_inputs)]
                        m.d.comb += chosen[number].eq(valid[number] & ~Cat(earlier).any())
        for number, each in enumerate(self.i):
            m.d.comb += each.ready.eq(chosen[number] & self.o.ready)
            with m.If(chosen[number]):
                m.d.sync += turn.eq(Mux(self.o.ready, (number + 1) % self._num_inputs, number))
        # A bit of each of two inputs that may be chosen is a table, where a multiplexer by turns would be four.
        payload = selected([(chosen[number], Value.cast(each.payload)) for number, each in enumerate(self.i)])
        m.d.comb += [self.o.valid.eq(valid.any()), Value.cast(self.o.payload).eq(payload)]
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
