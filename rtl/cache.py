"""A direct-mapped cache that goes on serving hits while lines are being fetched."""

from amaranth.hdl import Cat, Const, Module, Mux, Signal
from amaranth.lib import data, memory, stream, wiring
from amaranth.lib.wiring import In, Out
from amaranth.utils import exact_log2

from .queue import Queue

__all__ = ["WORD_WIDTH", "Cache"]

#: Bits of a memory word.
WORD_WIDTH = 32

_ANSWERS_DEPTH = 8


class Cache(wiring.Component):
    """Answers item numbers with items; answers to different requests may overtake each other.

    A request that finds its line is answered after 4 cycles, one a clock. One that does not waits in a queue;
    the head of that queue fetches its line, or, when that line is on its way or has just come, waits for it
    and looks again. Whoever fetches a line is answered by the line itself, and whoever looked again in vain
    fetches: two threads that evict each other's lines cannot do so forever.

    Items lie in memory back to back, each in a whole number of 32-bit words, least significant first.

    Parameters
    ----------
    item_width : int
        Bits of an item.
    payload_shape : :ref:`shape-like <lang-shapelike>`
        What travels with a request and comes back with its answer.
    index_width : int
        Bits of an item's number.
    num_lines, line_items : int
        Lines kept, items in a line; powers of two.
    num_fetches : int
        Lines that may be on their way at a time.
    num_waiting : int
        Requests that may be in the cache at a time (the caller's promise).

    Members
    -------
    request : stream of ``{"index", "payload"}``
    response : stream of ``{"item", "payload"}``
    line_request : stream of line numbers to memory
    line_data : stream of words from memory, line after line in the order requested
    flush : forget all lines; to be held until ``flushed``, while no request is in the cache
    flushed : every line is forgotten
    hit, miss : a request has found, has not found its line
    """

    def __init__(self, *, item_width, payload_shape, index_width, num_lines, line_items=1, num_fetches=4,
                 num_waiting):
        self._item_width = item_width
        self._item_words = -(-item_width // WORD_WIDTH)
        self._num_lines = num_lines
        self._line_items = line_items
        self._num_fetches = num_fetches
        self._num_waiting = num_waiting
        self._line_width = index_width - exact_log2(line_items)
        self._request_layout = data.StructLayout({"index": index_width, "payload": payload_shape})
        self._response_layout = data.StructLayout({"item": item_width, "payload": payload_shape})
        super().__init__({
            "request": In(stream.Signature(self._request_layout)),
            "response": Out(stream.Signature(self._response_layout)),
            "line_request": Out(stream.Signature(self._line_width)),
            "line_data": In(stream.Signature(WORD_WIDTH, always_ready=True)),
            "flush": In(1),
            "flushed": Out(1),
            "hit": Out(1),
            "miss": Out(1),
        })

    @property
    def line_words(self):
        """Memory words in a line."""
        return self._item_words * self._line_items

    def _select_item(self, line, index):
        stride = self._item_words * WORD_WIDTH
        items = [line[k * stride:k * stride + self._item_width] for k in range(self._line_items)]
        if self._line_items == 1:
            return items[0]
        return Cat(items).word_select(index[:exact_log2(self._line_items)], self._item_width)

    def elaborate(self, platform):
        m = Module()
        item_bits = exact_log2(self._line_items)
        slot_bits = exact_log2(self._num_lines)
        line_bits = self.line_words * WORD_WIDTH
        tag_layout = data.StructLayout({"valid": 1, "tag": self._line_width - slot_bits})
        waiting_layout = data.StructLayout({"request": self._request_layout, "in_vain": 1})

        m.submodules.tags = tags = memory.Memory(shape=tag_layout, depth=self._num_lines, init=[])
        m.submodules.lines = lines = memory.Memory(shape=line_bits, depth=self._num_lines, init=[])
        tag_read, line_read = tags.read_port(), lines.read_port()
        tag_write, line_write = tags.write_port(), lines.write_port()
        m.submodules.waiting = waiting = Queue(waiting_layout, depth=self._num_waiting, always_ready=True)
        m.submodules.owners = owners = Queue(self._request_layout, depth=self._num_fetches, always_ready=True)
        m.submodules.filled = filled = Queue(self._response_layout, depth=self._num_fetches, always_ready=True)
        m.submodules.answers = answers = Queue(self._response_layout, depth=_ANSWERS_DEPTH, always_ready=True)
        wiring.connect(m, answers.o, wiring.flipped(self.response))
        head, has_head = Signal(waiting_layout, reset_less=True), Signal()

        # Lookup: a waiting request that shall look again goes before a new one.
        requests = [Signal(self._request_layout, name=f"lookup{stage}", reset_less=stage > 0) for stage in range(3)]
        valid = [Signal(name=f"lookup_valid{stage}") for stage in range(3)]
        repeated = [Signal(name=f"lookup_repeated{stage}", reset_less=stage > 0) for stage in range(3)]
        again = Signal()
        room = Signal()
        yielding = [Signal(name=f"lookup_yields{stage}") for stage in range(3)]
        promised = Signal(range(_ANSWERS_DEPTH + 3))
        m.d.comb += [
            # Any lookup under way may become an answer. A filled line takes its turn when the lookup has no
            # answer; so that there is such a cycle for each, a lookup is left out.
            promised.eq(answers.level + valid[1] + valid[2]),
            yielding[0].eq(filled.level > yielding[1] + yielding[2]),
            room.eq((promised < _ANSWERS_DEPTH - 1) & ~yielding[0]),
            requests[0].eq(Mux(again, head.request, self.request.payload)),
            repeated[0].eq(again),
            valid[0].eq(room & (again | self.request.valid)),
            self.request.ready.eq(room & ~again),
            tag_read.addr.eq(requests[0].index[item_bits:][:slot_bits]),
            line_read.addr.eq(requests[0].index[item_bits:][:slot_bits]),
        ]
        for stage in (1, 2):
            m.d.sync += [
                requests[stage].eq(requests[stage - 1]),
                valid[stage].eq(valid[stage - 1]),
                repeated[stage].eq(repeated[stage - 1]),
                yielding[stage].eq(yielding[stage - 1]),
            ]
        # A second register after the memories: block RAM is slow from clock to output.
        tag = Signal(tag_layout, reset_less=True)
        line = Signal(line_bits, reset_less=True)
        m.d.sync += [tag.eq(tag_read.data), line.eq(line_read.data)]

        looked_up = requests[2]
        found = Signal()
        answer_found = Signal()
        answer_filled = Signal()
        m.d.comb += [
            found.eq(tag.valid & (tag.tag == looked_up.index[item_bits + slot_bits:])),
            self.hit.eq(valid[2] & found & ~repeated[2]),
            self.miss.eq(valid[2] & ~found & ~repeated[2]),
            waiting.i.payload.request.eq(looked_up),
            waiting.i.payload.in_vain.eq(repeated[2]),
            waiting.i.valid.eq(valid[2] & ~found),
            answer_found.eq(valid[2] & found),
            answer_filled.eq(filled.o.valid & ~answer_found & (promised < _ANSWERS_DEPTH)),
            filled.o.ready.eq(answer_filled),
            answers.i.valid.eq(answer_found | answer_filled),
            answers.i.payload.eq(filled.o.payload),
        ]
        with m.If(answer_found):
            m.d.comb += [
                answers.i.payload.item.eq(self._select_item(line, looked_up.index)),
                answers.i.payload.payload.eq(looked_up.payload),
            ]

        # Fetches, a ring in order of issue: those on their way, then those that came, the last one longest ago.
        fetch_layout = data.StructLayout({"line": self._line_width, "known": 1, "busy": 1})
        fetches = [Signal(fetch_layout, name=f"fetch{k}") for k in range(self._num_fetches)]
        newest = Signal(range(self._num_fetches))
        oldest = Signal(range(self._num_fetches))
        head_line, next_line = Signal(self._line_width), Signal(self._line_width)
        # Of the head, and of what comes next, whose line each fetch is.
        same, same_next = Signal(self._num_fetches), Signal(self._num_fetches)
        busy = Signal(self._num_fetches)
        on_its_way = Signal()
        free = Signal()
        issue, done = Signal(), Signal()
        m.d.comb += [
            head_line.eq(head.request.index[item_bits:]),
            next_line.eq(waiting.o.payload.request.index[item_bits:]),
            busy.eq(Cat(fetch.busy for fetch in fetches)),
            on_its_way.eq((same & busy).any()),
            # A filled line that still waits for its turn keeps its place, or ``filled`` might overflow.
            free.eq(owners.level + filled.level < self._num_fetches),
            again.eq(has_head & same.any() & ~on_its_way & ~head.in_vain),
            self.line_request.valid.eq(has_head & ~on_its_way & (~same.any() | head.in_vain) & free),
            self.line_request.payload.eq(head_line),
            issue.eq(self.line_request.valid & self.line_request.ready),
            owners.i.payload.eq(head.request),
            owners.i.valid.eq(issue),
            done.eq(issue | again & room),
            waiting.o.ready.eq(~has_head | done),
        ]
        # The head is compared before it gets there: from a queue through all fetches to who may send is a long way.
        with m.If(waiting.o.ready):
            m.d.sync += [head.eq(waiting.o.payload), has_head.eq(waiting.o.valid), same.eq(same_next)]
        line_words = self.line_words
        complete = Signal(line_bits)
        gathered = Signal(line_bits, reset_less=True)
        count = Signal(range(line_words))
        last = Signal()
        m.d.comb += [
            # The newest word comes on top of those before it.
            complete.eq(Cat(gathered, self.line_data.payload)[WORD_WIDTH:]),
            last.eq(self.line_data.valid & (count == line_words - 1)),
        ]
        with m.If(self.line_data.valid):
            m.d.sync += [gathered.eq(complete), count.eq(Mux(last, 0, count + 1))]
        for number, fetch in enumerate(fetches):
            with m.If(last & (oldest == number)):
                m.d.sync += fetch.busy.eq(0)
            m.d.comb += same_next[number].eq(fetch.known & (fetch.line == next_line))
            with m.If(issue & (newest == number)):
                m.d.comb += same_next[number].eq(head_line == next_line)
                m.d.sync += [fetch.line.eq(head_line), fetch.known.eq(1), fetch.busy.eq(1)]
            with m.If(self.flush):
                m.d.sync += fetch.known.eq(0)
        with m.If(issue):
            m.d.sync += newest.eq(Mux(newest == self._num_fetches - 1, 0, newest + 1))
        with m.If(last):
            m.d.sync += oldest.eq(Mux(oldest == self._num_fetches - 1, 0, oldest + 1))

        owner = owners.o.payload
        owner_line = Signal(self._line_width)
        m.d.comb += [
            owner_line.eq(owner.index[item_bits:]),
            owners.o.ready.eq(last),
            filled.i.valid.eq(last),
            filled.i.payload.item.eq(self._select_item(complete, owner.index)),
            filled.i.payload.payload.eq(owner.payload),
            line_write.addr.eq(owner_line[:slot_bits]),
            line_write.data.eq(complete),
            line_write.en.eq(last),
            tag_write.addr.eq(owner_line[:slot_bits]),
            tag_write.data.valid.eq(1),
            tag_write.data.tag.eq(owner_line[slot_bits:]),
            tag_write.en.eq(last),
        ]

        flush_slot = Signal(range(self._num_lines + 1))
        m.d.comb += self.flushed.eq(flush_slot == self._num_lines)
        with m.If(~self.flush):
            m.d.sync += flush_slot.eq(0)
        with m.Elif(~self.flushed):
            m.d.comb += [
                tag_write.addr.eq(flush_slot),
                tag_write.data.eq(Const(0, len(tag_write.data.as_value()))),
                tag_write.en.eq(1),
            ]
            m.d.sync += flush_slot.eq(flush_slot + 1)
        return m
