"""The mailboxed list: what stands in a leaf, less what the packet has already been tested against."""

from itertools import pairwise

from amaranth.hdl import Cat, Module, Mux, Signal
from amaranth.lib import data, stream, wiring
from amaranth.lib.wiring import In, Out

from fpu import Delay

from .block_memory import BlockMemory
from .layout import PACKET_RAYS, job_layout, list_entry_layout, thread_width, token_layout, with_token
from .queue import Merge, Queue

__all__ = ["MailboxedList"]


class MailboxedList(wiring.Component):
    """Walks a leaf's list, one entry of a packet at a time, and hands on those that are worth a test.

    A triangle often lies in several leaves. The mailbox of a packet remembers its last few triangles and the
    rays tested against each; rays that were tested are left out, and a triangle without rays left is skipped.
    Instances are remembered like triangles: a ray enters one with its whole length, not with the part of it in
    the leaf, so once is enough. Each level has a mailbox; the one of the instances' triangles is emptied when
    an instance is entered, the one of the scene when the thread begins anew.

    An entry takes one cycle, an instance's two; the job for it follows 4 cycles later.

    Parameters
    ----------
    num_threads, stack_depth, index_width, mailbox_entries : int
        See :class:`~rtl.config.ChipConfig`.
    solid : bool
        Whether jobs tell of triangles that let no light through.

    Members
    -------
    begin : ``{"valid", "thread"}``: the thread begins a new packet, whose first entry comes 5 cycles later at the
        earliest
    leaf : stream of ``{"token", "list"}``: a leaf to walk
    tested, left : streams of tokens: the job of the thread's last triangle is done; the instance has been left.
        Of such a token only thread, level and hits count
    fetch : stream of ``{"index", "payload"}``: to the list cache
    entry : stream of ``{"item", "payload"}``: from the list cache
    job : stream of :func:`~rtl.layout.job_layout`: a matrix to transform the packet with; the token's mask
        tells the rays
    pop : stream of tokens: the list is at its end
    busy : an entry is looked at
    """

    def __init__(self, *, num_threads, stack_depth, index_width, mailbox_entries, solid=False):
        self._solid = solid
        self._num_threads = num_threads
        self._index_width = index_width
        self._mailbox_entries = mailbox_entries
        self._token = token = token_layout(num_threads=num_threads, stack_depth=stack_depth)
        self._place = with_token(token, list=index_width)
        self._entry = list_entry_layout(index_width=index_width)
        # Where in a list a token is, and whether that was its last entry
        self._stop = with_token(token, list=index_width, last=1)
        super().__init__({
            "begin": In(data.StructLayout({"valid": 1, "thread": thread_width(num_threads)})),
            "leaf": In(stream.Signature(self._place)),
            "tested": In(stream.Signature(token)),
            "left": In(stream.Signature(token)),
            "fetch": Out(stream.Signature(data.StructLayout({"index": index_width, "payload": self._place}))),
            "entry": In(stream.Signature(data.StructLayout({"item": 32, "payload": self._place}))),
            "job": Out(stream.Signature(job_layout(token, index_width=index_width, solid=solid), always_ready=True)),
            "pop": Out(stream.Signature(token)),
            "busy": Out(1),
        })

    def elaborate(self, platform):
        m = Module()
        m.submodules.returned = returned = Queue(self._stop, depth=self._num_threads, always_ready=True)
        m.submodules.skipped = skipped = Queue(self._stop, depth=self._num_threads, always_ready=True)
        self._go_on(m, [returned.o, skipped.o])
        contexts = self._come_back(m, returned.i)
        entry, wanted, looks_at = self._look(m, contexts)
        stop = skipped.i.payload
        m.d.comb += [
            self.job.valid.eq(looks_at & wanted.any()),
            self.job.payload.token.eq(entry.token),
            self.job.payload.token.mask.eq(wanted),
            self.job.payload.index.eq(entry.item.index),
            self.job.payload.instance.eq(entry.item.instance),
            self.job.payload.solid.eq(entry.item.solid),
            skipped.i.valid.eq(looks_at & ~wanted.any()),
            stop.token.eq(entry.token),
            stop.list.eq(entry.following),
            stop.last.eq(entry.item.last),
        ]
        return m

    def _go_on(self, m, stops):
        """Fetches a list's next entry, or hands on a token whose list is at its end."""
        # A list goes on before another is begun: what is in the caches is used first.
        m.submodules.going_on = going_on = Merge(self._stop, num_inputs=len(stops) + 1)
        m.submodules.ended = ended = Queue(self._token, depth=2)
        # So that those that go on do not wait within a cycle for where they go.
        m.submodules.gone_on = gone_on = Queue(self._stop, depth=2)
        wiring.connect(m, going_on.o, gone_on.i)
        for source, target in zip(stops, going_on.i, strict=False):
            wiring.connect(m, source, target)
        leaf, place = going_on.i[-1], gone_on.o.payload
        wiring.connect(m, ended.o, wiring.flipped(self.pop))
        m.d.comb += [
            leaf.valid.eq(self.leaf.valid),
            leaf.payload.token.eq(self.leaf.payload.token),
            leaf.payload.list.eq(self.leaf.payload.list),
            self.leaf.ready.eq(leaf.ready),
            self.fetch.valid.eq(gone_on.o.valid & ~place.last),
            self.fetch.payload.index.eq(place.list),
            self.fetch.payload.payload.token.eq(place.token),
            self.fetch.payload.payload.list.eq(place.list),
            ended.i.valid.eq(gone_on.o.valid & place.last),
            ended.i.payload.eq(place.token),
            gone_on.o.ready.eq(Mux(place.last, ended.i.ready, self.fetch.ready)),
        ]

    def _come_back(self, m, returned):
        """Tokens that come back find in memory where in which list they were; returns that memory."""
        m.submodules.contexts = contexts = BlockMemory(self._stop, depth=2 << thread_width(self._num_threads))
        m.submodules.back = back = Merge(self._token, num_inputs=2)
        wiring.connect(m, wiring.flipped(self.tested), back.i[0])
        wiring.connect(m, wiring.flipped(self.left), back.i[1])
        token = back.o.payload
        m.submodules.hits = hits = Delay(PACKET_RAYS, cycles=contexts.latency)
        comes = Signal(contexts.latency + 1)
        m.d.comb += [
            back.o.ready.eq(1),
            hits.i.eq(token.hit),
            comes[0].eq(back.o.valid),
            contexts.reading.eq(back.o.valid),
            contexts.address.eq(Cat(token.level, token.thread)),
            returned.valid.eq(comes[-1]),
            returned.payload.eq(contexts.data),
            returned.payload.token.hit.eq(hits.o),
        ]
        m.d.sync += comes[1:].eq(comes[:-1])
        return contexts

    def _look(self, m, contexts):
        """Looks each entry up in the mailbox; returns it, its rays to be tested, and when there is one."""
        layout = with_token(self._token, item=self._entry, following=self._index_width)
        entries = [Signal(layout, name=f"entry{stage}", reset_less=stage > 0) for stage in range(5)]
        looking, clearing = Signal(5), Signal(4)
        # Who begins has come a long way.
        begin = Signal.like(self.begin)
        m.d.sync += begin.eq(self.begin)
        first, token = entries[0], self.entry.payload.payload.token
        # An instance's triangles are forgotten in the cycle after its entry, in which no other is looked at.
        pending, pending_thread = Signal(), Signal.like(token.thread, reset_less=True)
        m.d.comb += [
            self.entry.ready.eq(~begin.valid & ~pending),
            looking[0].eq(self.entry.valid & self.entry.ready),
            self.busy.eq(looking[0]),
            clearing[0].eq(begin.valid | pending),
            first.item.eq(self.entry.payload.item),
            first.following.eq(self.entry.payload.payload.list + 1),
            first.token.eq(token),
            contexts.write.valid.eq(looking[0]),
            contexts.write.address.eq(Cat(token.level, token.thread)),
            contexts.write.data.token.eq(token),
            contexts.write.data.list.eq(first.following),
            contexts.write.data.last.eq(first.item.last),
        ]
        with m.If(clearing[0]):
            m.d.comb += [first.token.level.eq(~begin.valid),
                         first.token.thread.eq(Mux(begin.valid, begin.thread, pending_thread))]
        with m.If(~begin.valid):
            m.d.sync += pending.eq(looking[0] & first.item.instance)
        with m.If(looking[0]):
            m.d.sync += pending_thread.eq(token.thread)
        m.d.sync += [looking[1:].eq(looking[:-1]), clearing[1:].eq(clearing[:-1])]
        for earlier, later in pairwise(entries):
            m.d.sync += later.eq(earlier)

        tested = Signal(PACKET_RAYS)
        if self._mailbox_entries:
            self._mailbox(m, entries, tested, looking=looking, clearing=clearing)
        wanted = Signal(PACKET_RAYS, reset_less=True)
        m.d.sync += wanted.eq(entries[3].token.mask & ~tested)
        return entries[4], wanted, looking[4]

    def _mailbox(self, m, entries, tested, *, looking, clearing):
        """The mailboxes of all threads and both levels: which rays have been tested; the others are added."""
        letter_layout = data.StructLayout({"index": self._index_width, "rays": PACKET_RAYS})
        count = self._mailbox_entries
        box_layout = data.StructLayout({"letters": data.ArrayLayout(letter_layout, count), "next": range(count)})
        m.submodules.mailboxes = mailboxes = BlockMemory(box_layout, depth=2 << thread_width(self._num_threads))
        box = Signal(box_layout, reset_less=True)
        found = Signal(count, reset_less=True)
        asking, compared, entry = entries[0], entries[2], entries[3]
        write = mailboxes.write
        m.d.comb += [
            mailboxes.reading.eq(looking[0]),
            mailboxes.address.eq(Cat(asking.token.level, asking.token.thread)),
            write.valid.eq(looking[3] | clearing[3]),
            write.address.eq(Cat(entry.token.level, entry.token.thread)),
        ]
        m.d.sync += box.eq(mailboxes.data)
        for number in range(count):
            letter = mailboxes.data.letters[number]
            # A letter without rays is an empty place.
            m.d.sync += found[number].eq((letter.index == compared.item.index) & letter.rays.any())
            with m.If(found[number]):
                m.d.comb += tested.eq(box.letters[number].rays)
        with m.If(~clearing[3]):
            m.d.comb += write.data.eq(box)
            for number in range(count):
                put = Signal(name=f"put{number}")
                m.d.comb += put.eq(Mux(found.any(), found[number], box.next == number))
                with m.If(put):
                    m.d.comb += [
                        write.data.letters[number].index.eq(entry.item.index),
                        write.data.letters[number].rays.eq(tested | entry.token.mask),
                    ]
            with m.If(~found.any()):
                m.d.comb += write.data.next.eq(Mux(box.next == count - 1, 0, box.next + 1))
