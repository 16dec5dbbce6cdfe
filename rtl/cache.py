"""A direct-mapped cache that goes on serving hits while lines are being fetched."""

from amaranth.hdl import Assert, Cat, Const, Module, Mux, Signal
from amaranth.lib import data, stream, wiring
from amaranth.lib.wiring import In, Out
from amaranth.utils import exact_log2

from .block_memory import BlockMemory
from .queue import Queue

__all__ = ["WORD_WIDTH", "Cache"]

#: Bits of a memory word.
WORD_WIDTH = 32

# Of requests that look up, and of their answers until they are taken
_NUM_LOOKUPS = 12
# Of a lookup: who it is, its place, two of the memories, and whether it is found
_STAGES = 5


class Cache(wiring.Component):
    """Answers item numbers with items; answers to different requests may overtake each other.

    A request that finds its line is answered after 6 cycles, one a clock. One that does not waits in a queue;
    the head of that queue fetches its line, or, when that line is on its way or has just come, waits for it
    and looks again. Whoever fetches a line is the first to look when it has come, and whoever looked again in vain
    fetches: two threads that evict each other's lines cannot do so forever. A line that comes takes the place of
    two lookups.

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

    Raises
    ------
    ValueError
        If a line is a single word.
    """

    def __init__(self, *, item_width, payload_shape, index_width, num_lines, line_items=1, num_fetches=4,
                 num_waiting):
        self._item_width = item_width
        self._item_words = -(-item_width // WORD_WIDTH)
        self._num_lines = num_lines
        self._line_items = line_items
        self._num_fetches = num_fetches
        self._num_waiting = num_waiting
        if self.line_words < 2:
            raise ValueError("A line of a cache has a single word; it must have 2 or more")
        self._slot_bits = exact_log2(num_lines)
        self._line_width = index_width - exact_log2(line_items)
        self._tag = data.StructLayout({"valid": 1, "tag": self._line_width - self._slot_bits})
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

    def _line(self, request):
        return request.index[exact_log2(self._line_items):]

    def _select_item(self, line, index):
        stride = self._item_words * WORD_WIDTH
        items = [line[k * stride:k * stride + self._item_width] for k in range(self._line_items)]
        if self._line_items == 1:
            return items[0]
        return Cat(items).word_select(index[:exact_log2(self._line_items)], self._item_width)

    def elaborate(self, platform):
        m = Module()
        request_layout = self._request_layout
        m.submodules.tags = tags = BlockMemory(self._tag, depth=self._num_lines)
        m.submodules.lines = lines = BlockMemory(self.line_words * WORD_WIDTH, depth=self._num_lines)
        # So that whoever asks does not wait within a cycle for who it is that looks.
        m.submodules.requests = requests = Queue(request_layout, depth=2)
        wiring.connect(m, wiring.flipped(self.request), requests.i)
        # Answers that there are, and those that lookups and lines on their way may become.
        max_promised = _NUM_LOOKUPS + self._num_fetches
        promised = Signal(range(max_promised + 1))
        claims, starts, vain, answered, left = Signal(), Signal(), Signal(), Signal(), Signal(2)
        m.d.comb += answered.eq(self.response.valid & self.response.ready)
        # What is no longer promised is known late in a cycle; that there is room, a cycle later is soon enough.
        m.d.sync += [left.eq(answered + vain), promised.eq(promised + (starts + claims) - left)]

        # Lookup: whoever has fetched goes first, and so finds the line, then one that waits, then a new one; nobody
        # while a line is written.
        owner, owner_looks = Signal(request_layout, reset_less=True), Signal()
        head, again = Signal(request_layout, reset_less=True), Signal()
        comes, will_come, allowed = Signal(), Signal(), Signal()
        first = Signal(request_layout)
        # A fetch needs an answer too, and lookups leave it one. Said a cycle before, in which two may be promised.
        m.d.sync += allowed.eq((promised < max_promised - 3) & ~will_come & ~comes)
        m.d.comb += [
            starts.eq(allowed & (again | requests.o.valid)),
            requests.o.ready.eq(allowed & ~again),
            first.eq(Mux(owner_looks, owner, Mux(again, head, requests.o.payload))),
        ]
        about_layout = data.StructLayout({"valid": 1, "repeated": 1})
        about = [Signal(about_layout, name=f"about{stage}") for stage in range(_STAGES)]
        looking = [Signal(request_layout, name=f"looking{stage}", reset_less=True) for stage in range(_STAGES)]
        m.d.comb += [
            about[0].valid.eq(starts | owner_looks),
            about[0].repeated.eq(again | owner_looks),
            looking[0].eq(first),
        ]
        for stage in range(_STAGES - 1):
            m.d.sync += [about[stage + 1].eq(about[stage]), looking[stage + 1].eq(looking[stage])]
        # Many memories, and a choice of three before them: from a register.
        for rows in (tags, lines):
            m.d.comb += [rows.reading.eq(about[1].valid), rows.address.eq(self._line(looking[1])[:self._slot_bits])]
        compared, found, item = looking[-2], Signal(), Signal(self._item_width, reset_less=True)
        m.d.sync += [
            found.eq(tags.data.valid & (tags.data.tag == self._line(compared)[self._slot_bits:])),
            item.eq(self._select_item(lines.data, compared.index)),
        ]

        m.submodules.answers = answers = Queue(self._response_layout, depth=max_promised, always_ready=True)
        waiting_layout = data.StructLayout({"request": request_layout, "in_vain": 1})
        m.submodules.waiting = waiting = Queue(waiting_layout, depth=self._num_waiting, always_ready=True)
        wiring.connect(m, answers.o, wiring.flipped(self.response))
        m.d.comb += [
            vain.eq(about[-1].valid & ~found),
            self.hit.eq(about[-1].valid & found & ~about[-1].repeated),
            self.miss.eq(vain & ~about[-1].repeated),
            answers.i.valid.eq(about[-1].valid & found),
            answers.i.payload.item.eq(item),
            answers.i.payload.payload.eq(looking[-1].payload),
            waiting.i.valid.eq(vain),
            waiting.i.payload.request.eq(looking[-1]),
            waiting.i.payload.in_vain.eq(about[-1].repeated),
        ]
        issue = self._decide(m, waiting.o, head=head, again=again, again_starts=again & allowed, claims=claims,
                             may_claim=promised < max_promised, comes=comes)
        self._fill(m, tags, lines, head=head, issue=issue, owner=owner, owner_looks=owner_looks, comes=comes,
                   will_come=will_come)
        self._forget(m, tags)
        return m

    def _decide(self, m, waiting, *, head, again, again_starts, claims, may_claim, comes):
        """Who waits longest: whether it may look again, or is to fetch. Returns when it does."""
        # Fetches, a ring in order of issue: those on their way, then those that came, the last one longest ago.
        fetch_layout = data.StructLayout({"line": self._line_width, "known": 1, "busy": 1})
        fetches = [Signal(fetch_layout, name=f"fetch{k}") for k in range(self._num_fetches)]
        newest, oldest = Signal(range(self._num_fetches)), Signal(range(self._num_fetches))
        has_head, in_vain = Signal(), Signal(reset_less=True)
        same = Signal(self._num_fetches)
        on_its_way, has_come, free = Signal(), Signal(), Signal()
        fetch = Signal()
        issue = Signal()
        # So that who waits is not to wait within a cycle for whether memory has room.
        m.submodules.line_requests = line_requests = Queue(self._line_width, depth=2)
        wiring.connect(m, line_requests.o, wiring.flipped(self.line_request))
        m.d.comb += [
            on_its_way.eq((same & Cat(place.busy for place in fetches)).any()),
            has_come.eq(same.any() & ~in_vain),
            free.eq(~Cat(place.busy for place in fetches).all()),
            claims.eq(has_head & ~on_its_way & ~has_come & free & may_claim & ~fetch),
            line_requests.i.valid.eq(fetch),
            line_requests.i.payload.eq(self._line(head)),
            issue.eq(fetch & line_requests.i.ready),
            waiting.ready.eq(~has_head),
        ]
        # One step of the way to a decision a cycle: none is urgent, as the line takes many.
        with m.If(~has_head):
            m.d.sync += [
                head.eq(waiting.payload.request),
                in_vain.eq(waiting.payload.in_vain),
                has_head.eq(waiting.valid),
                same.eq(Cat(place.known & (place.line == self._line(waiting.payload.request)) for place in fetches)),
            ]
        with m.If(issue | again_starts):
            m.d.sync += has_head.eq(0)
        m.d.sync += [
            again.eq(has_head & ~on_its_way & has_come & ~again_starts),
            fetch.eq(claims | fetch & ~issue),
        ]
        for number, place in enumerate(fetches):
            with m.If(comes & (oldest == number)):
                m.d.sync += place.busy.eq(0)
            with m.If(issue & (newest == number)):
                m.d.sync += [place.line.eq(self._line(head)), place.known.eq(1), place.busy.eq(1)]
            with m.If(self.flush):
                m.d.sync += place.known.eq(0)
        for number, moves in ((newest, issue), (oldest, comes)):
            with m.If(moves):
                m.d.sync += number.eq(Mux(number == self._num_fetches - 1, 0, number + 1))
        return issue

    def _fill(self, m, tags, lines, *, head, issue, owner, owner_looks, comes, will_come):
        """Gathers a line's words and writes it two cycles after the last, when no lookup that has begun reads."""
        m.submodules.owners = owners = Queue(self._request_layout, depth=self._num_fetches, always_ready=True)
        line_bits = self.line_words * WORD_WIDTH
        gathered, whole = Signal(line_bits, reset_less=True), Signal(line_bits, reset_less=True)
        count = Signal(range(self.line_words))
        # When the owner looks its line is written, to be read a cycle later.
        line = self._line(owner)
        m.d.comb += [
            owners.i.payload.eq(head),
            owners.i.valid.eq(issue),
            owners.o.ready.eq(comes),
            will_come.eq(self.line_data.valid & (count == self.line_words - 1)),
            lines.write.valid.eq(owner_looks),
            lines.write.address.eq(line[:self._slot_bits]),
            lines.write.data.eq(whole),
            tags.write.valid.eq(owner_looks),
            tags.write.address.eq(line[:self._slot_bits]),
            tags.write.data.valid.eq(1),
            tags.write.data.tag.eq(line[self._slot_bits:]),
        ]
        m.d.sync += [comes.eq(will_come), owner_looks.eq(comes), owner.eq(owners.o.payload), whole.eq(gathered),
                     Assert(~comes | owners.o.valid, "a line comes that nobody has asked for")]
        with m.If(self.line_data.valid):
            # The newest word comes on top of those before it.
            m.d.sync += [gathered.eq(Cat(gathered, self.line_data.payload)[WORD_WIDTH:]),
                         count.eq(Mux(will_come, 0, count + 1))]

    def _forget(self, m, tags):
        """Clears one tag after the other."""
        flush_slot = Signal(range(self._num_lines + 1))
        cleared, clears = Signal(range(self._num_lines)), Signal()
        at_end = Signal()
        m.d.comb += [at_end.eq(flush_slot == self._num_lines), self.flushed.eq(at_end & ~clears)]
        m.d.sync += [clears.eq(self.flush & ~at_end), cleared.eq(flush_slot)]
        with m.If(~self.flush):
            m.d.sync += flush_slot.eq(0)
        with m.Elif(~at_end):
            m.d.sync += flush_slot.eq(flush_slot + 1)
        with m.If(clears):
            m.d.comb += [tags.write.valid.eq(1), tags.write.address.eq(cleared),
                         tags.write.data.eq(Const(0, self._tag.size))]
