"""The mailboxed list: what stands in a leaf, less what the packet has already been tested against."""

from amaranth.hdl import Cat, Module, Mux, Signal
from amaranth.lib import data, memory, stream, wiring
from amaranth.lib.wiring import In, Out

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

    An entry takes one cycle; the job for it follows in the next.

    Parameters
    ----------
    num_threads, stack_depth, index_width, mailbox_entries : int
        See :class:`~rtl.config.ChipConfig`.
    solid : bool
        Whether jobs tell of triangles that let no light through.

    Members
    -------
    begin : ``{"valid", "thread"}``: the thread begins a new packet
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
        super().__init__({
            "begin": In(data.StructLayout({"valid": 1, "thread": thread_width(num_threads)})),
            "leaf": In(stream.Signature(self._place)),
            "tested": In(stream.Signature(token)),
            "left": In(stream.Signature(token)),
            "fetch": Out(stream.Signature(data.StructLayout({"index": index_width, "payload": self._place}))),
            "entry": In(stream.Signature(data.StructLayout({"item": 32, "payload": self._place}))),
            "job": Out(stream.Signature(job_layout(token, index_width=index_width, solid=solid), always_ready=True)),
            "pop": Out(stream.Signature(token, always_ready=True)),
            "busy": Out(1),
        })

    def _mailbox(self, m, level, *, thread, index, mask, post, clear, clear_thread):
        """The mailbox of one level: the rays of ``mask`` that have been tested; ``post`` adds the others."""
        letter_layout = data.StructLayout({"index": self._index_width, "rays": PACKET_RAYS})
        count = self._mailbox_entries
        box_layout = data.StructLayout({"letters": data.ArrayLayout(letter_layout, count), "next": range(count)})
        m.submodules[f"mailboxes{level}"] = mailboxes = memory.Memory(
            shape=box_layout, depth=1 << thread_width(self._num_threads), init=[])
        read, write = mailboxes.read_port(domain="comb"), mailboxes.write_port()
        found = Signal(count, name=f"found{level}")
        tested = Signal(PACKET_RAYS, name=f"tested{level}")
        box = read.data
        m.d.comb += [
            read.addr.eq(thread),
            write.addr.eq(Mux(clear, clear_thread, thread)),
            write.en.eq(post | clear),
        ]
        for number in range(count):
            letter = box.letters[number]
            # A letter without rays is an empty place.
            m.d.comb += found[number].eq((letter.index == index) & letter.rays.any())
            with m.If(found[number]):
                m.d.comb += tested.eq(letter.rays)
        with m.If(~clear):
            m.d.comb += write.data.eq(box)
            for number in range(count):
                put = Signal(name=f"put{level}_{number}")
                m.d.comb += put.eq(Mux(found.any(), found[number], box.next == number))
                with m.If(put):
                    m.d.comb += [
                        write.data.letters[number].index.eq(index),
                        write.data.letters[number].rays.eq(tested | mask),
                    ]
            with m.If(~found.any()):
                m.d.comb += write.data.next.eq(Mux(box.next == count - 1, 0, box.next + 1))
        return tested

    def elaborate(self, platform):
        m = Module()
        context_layout = with_token(self._token, list=self._index_width, last=1)
        m.submodules.contexts = contexts = memory.Memory(
            shape=context_layout, depth=2 << thread_width(self._num_threads), init=[])

        # Tokens that come back find in memory where in which list they were.
        m.submodules.back = back = Merge(self._token, num_inputs=2)
        wiring.connect(m, wiring.flipped(self.tested), back.i[0])
        wiring.connect(m, wiring.flipped(self.left), back.i[1])
        context_read, context_write = contexts.read_port(), contexts.write_port()
        returning = Signal()
        returned = Signal(self._token, reset_less=True)
        place = Signal(self._token)
        m.submodules.next_entry = next_entry = Queue(self._place, depth=self._num_threads, always_ready=True)
        context = context_read.data
        m.d.comb += [
            back.o.ready.eq(1),
            context_read.addr.eq(Cat(back.o.payload.level, back.o.payload.thread)),
            place.eq(context.token),
            place.hit.eq(returned.hit),
            next_entry.i.payload.token.eq(place),
            next_entry.i.payload.list.eq(context.list),
            next_entry.i.valid.eq(returning & ~context.last),
        ]
        m.d.sync += [returning.eq(back.o.valid), returned.eq(back.o.payload)]

        # A list goes on before another is begun: what is in the caches is used first.
        m.submodules.going_on = going_on = Merge(self._place, num_inputs=3)
        m.submodules.skipped = skipped = Queue(self._place, depth=self._num_threads, always_ready=True)
        wiring.connect(m, next_entry.o, going_on.i[0])
        wiring.connect(m, skipped.o, going_on.i[1])
        wiring.connect(m, wiring.flipped(self.leaf), going_on.i[2])
        m.d.comb += [
            self.fetch.valid.eq(going_on.o.valid),
            self.fetch.payload.index.eq(going_on.o.payload.list),
            self.fetch.payload.payload.eq(going_on.o.payload),
            going_on.o.ready.eq(self.fetch.ready),
        ]

        token = self.entry.payload.payload.token
        following = Signal(self._index_width)
        entry = Signal(list_entry_layout(index_width=self._index_width))
        # A list's end after a skipped entry has to share ``pop`` with one after a test, and a look into the mailbox
        # the write port with its emptying; in both cases the entry waits.
        m.d.comb += [
            entry.eq(self.entry.payload.item),
            following.eq(self.entry.payload.payload.list + 1),
            self.entry.ready.eq(~(returning & context.last) & ~self.begin.valid),
        ]
        looking = Signal()
        m.d.comb += [looking.eq(self.entry.valid & self.entry.ready), self.busy.eq(looking)]
        wanted = Signal(PACKET_RAYS)
        m.d.comb += wanted.eq(token.mask)
        if self._mailbox_entries:
            common = dict(thread=token.thread, index=entry.index, mask=token.mask)
            in_scene = self._mailbox(m, 0, **common, post=looking & ~token.level, clear=self.begin.valid,
                                     clear_thread=self.begin.thread)
            # Only the scene's own list has instances, so this never clears what is posted at the same time.
            in_instance = self._mailbox(m, 1, **common, post=looking & token.level,
                                        clear=looking & entry.instance, clear_thread=token.thread)
            m.d.comb += wanted.eq(token.mask & ~Mux(token.level, in_instance, in_scene))
        m.d.comb += [
            context_write.addr.eq(Cat(token.level, token.thread)),
            context_write.data.token.eq(token),
            context_write.data.list.eq(following),
            context_write.data.last.eq(entry.last),
            context_write.en.eq(looking),
            skipped.i.payload.token.eq(token),
            skipped.i.payload.list.eq(following),
            skipped.i.valid.eq(looking & ~wanted.any() & ~entry.last),
            self.pop.payload.eq(Mux(returning & context.last, place, token)),
            self.pop.valid.eq(returning & context.last | looking & ~wanted.any() & entry.last),
        ]
        job = Signal.like(self.job.payload, name="job_q", reset_less=True)
        job_valid = Signal()
        m.d.sync += [
            job.token.eq(token),
            job.token.mask.eq(wanted),
            job.index.eq(entry.index),
            job.instance.eq(entry.instance),
            job.solid.eq(entry.solid),
            job_valid.eq(looking & wanted.any()),
        ]
        m.d.comb += [self.job.payload.eq(job), self.job.valid.eq(job_valid)]
        return m
