"""One bank of an SDRAM: its accesses in order, its open row, and when which command is allowed."""

from amaranth.hdl import Assert, Module, Mux, Signal
from amaranth.lib import data, stream, wiring
from amaranth.lib.wiring import In, Out

from ..queue import Queue
from .commands import PLACE_WIDTH

__all__ = ["Bank", "bank_access_layout", "column_layout"]


def bank_access_layout(chip, *, tag_width):
    """An access to one bank, see :func:`~.commands.access_layout`."""
    return data.StructLayout({"write": 1, "row": chip.row_width, "column": chip.column_width - 1, "left": PLACE_WIDTH,
                              "place": PLACE_WIDTH, "tag": tag_width})


def column_layout(chip, *, tag_width):
    """A word to read or write in the open row."""
    return data.StructLayout({"write": 1, "column": chip.column_width - 1, "place": PLACE_WIDTH, "tag": tag_width,
                              "last": 1})


class Bank(wiring.Component):
    """Bids for the commands that a bank's accesses need.

    Time goes by in slots of two cycles. In the first, bids are made of the state; in the second, grants come, and the
    state changes. A row stays open until another one is wanted, or all are closed. What comes next is taken over with
    the last word of what is under way, so that words of one row go on without a gap.

    Parameters
    ----------
    timing : :class:`~.timing.SdramTiming`
        Distances of commands.
    tag_width : int
        Bits of an access's tag.
    depth : int
        Accesses that wait.

    Members
    -------
    access : stream of accesses
    room : there is room for three accesses more than those taken until the last cycle but one
    second : this is the second cycle of a slot
    hold : no bids are to be made
    writing, column_allowed : whether the data lines are for writing now, and free for it
    column_bid, row_bid : in the second cycle: a word can be moved; a row can be opened, or closed if ``closing``
    column_granted, row_granted : answers in the second cycle
    finishing : in the second cycle: the bid for a column is for the last one of its access
    close : in the second cycle: the row is closed, as a granted bid would; only while ``may_close``
    may_close : in the second cycle: the bank is closed or can be
    has_read, has_write : in the second cycle: it works at a read, a write
    column, row : what was granted, in the cycle after that
    idle : nothing is under way or waits
    """

    def __init__(self, *, timing, tag_width, depth=8):
        self._timing = timing
        self._depth = depth
        self._access = bank_access_layout(timing.chip, tag_width=tag_width)
        self._column = column_layout(timing.chip, tag_width=tag_width)
        super().__init__({
            "access": In(stream.Signature(self._access)),
            "room": Out(1, init=1),
            "second": In(1), "hold": In(1), "writing": In(1), "column_allowed": In(1),
            "column_bid": Out(1), "row_bid": Out(1), "closing": Out(1),
            "column_granted": In(1), "row_granted": In(1), "finishing": Out(1),
            "close": In(1), "may_close": Out(1, init=1),
            "has_read": Out(1), "has_write": Out(1),
            "column": Out(self._column), "row": Out(timing.chip.row_width),
            "idle": Out(1),
        })

    def elaborate(self, platform):
        m = Module()
        timing = self._timing
        m.submodules.queue = queue = Queue(self._access, depth=self._depth)
        wiring.connect(m, wiring.flipped(self.access), queue.i)
        m.d.sync += self.room.eq(queue.level < self._depth - 2)

        current, has_current = Signal(self._access, reset_less=True), Signal()
        opened = Signal()
        # The open row, if there is one, is the one that is worked at.
        fits = Signal()
        m.d.comb += self.row.eq(current.row)

        activated, precharged, moved = Signal(), Signal(), Signal()
        m.d.comb += [
            activated.eq(self.second & self.row_granted & ~self.closing),
            precharged.eq(self.second & (self.row_granted & self.closing | self.close)),
            moved.eq(self.second & self.column_granted),
        ]
        may_move = self._elapsed(m, "move", [(activated, timing.rcd)])
        may_precharge = self._elapsed(m, "precharge_row", [(activated, timing.ras)])
        may_recover = self._elapsed(m, "precharge_column", [
            (moved & ~self.writing, timing.read_to_precharge), (moved & self.writing, timing.write_to_precharge)])
        may_activate = self._elapsed(m, "activate", [(precharged, timing.rp)])
        if timing.rc > timing.ras + timing.rp:
            cycled = self._elapsed(m, "cycle", [(activated, timing.rc)])
            may_activate = may_activate & cycled

        # What comes next waits in a register, so that a late grant does no more than move registers.
        following, has_following, fits_following = Signal(self._access, reset_less=True), Signal(), Signal()
        candidate = Signal(self._access)
        m.d.comb += [candidate.eq(Mux(has_following, following, queue.o.payload)),
                     queue.o.ready.eq(~self.second & ~has_following),
                     self.idle.eq(~has_current & ~has_following & ~queue.o.valid)]
        closeable = Signal()
        m.d.comb += closeable.eq(may_precharge & may_recover)
        with m.If(~self.second):
            m.d.sync += [
                self.column_bid.eq(has_current & opened & fits & may_move & self.column_allowed & ~self.hold
                                   & (current.write == self.writing)),
                self.row_bid.eq(has_current & ~self.hold & Mux(opened, ~fits & closeable, may_activate)),
                self.closing.eq(opened),
                self.finishing.eq(current.left == 0),
                self.may_close.eq(~opened | closeable),
                self.has_read.eq(has_current & ~current.write),
                self.has_write.eq(has_current & current.write),
                *(getattr(self.column, name).eq(getattr(current, name))
                  for name in ("write", "column", "place", "tag")),
                self.column.last.eq(current.left == 0),
                following.eq(candidate),
                has_following.eq(has_following | queue.o.valid),
                fits_following.eq(candidate.row == current.row),
            ]

        with m.If(activated):
            m.d.sync += [opened.eq(1), fits.eq(1)]
        with m.If(precharged):
            m.d.sync += opened.eq(0)
        with m.If(moved):
            m.d.sync += [current.column.eq(current.column + 1), current.place.eq(current.place + 1),
                         current.left.eq(current.left - 1)]
        with m.If(self.second & has_following & (~has_current | self.column_granted & self.finishing)):
            m.d.sync += [current.eq(following), has_current.eq(1), fits.eq(fits_following), has_following.eq(0)]
        with m.Elif(moved & self.finishing):
            m.d.sync += has_current.eq(0)
        m.d.sync += [
            Assert(~self.second | ~self.column_granted | self.column_bid, "a column is granted that was not bid for"),
            Assert(~self.second | ~self.row_granted | self.row_bid, "a row is granted that was not bid for"),
            Assert(~self.close | self.may_close, "a row is closed too early"),
        ]
        return m

    def _elapsed(self, m, name, events):
        """Whether, after each of some events, so many slots have gone by."""
        longest = max(slots for _, slots in events)
        left = Signal(range(max(longest, 2)), name=f"wait_{name}")
        with m.If(self.second & (left != 0)):
            m.d.sync += left.eq(left - 1)
        for event, slots in events:
            with m.If(event):
                m.d.sync += left.eq(slots - 1)
        elapsed = Signal(name=f"may_{name}")
        m.d.comb += elapsed.eq(left == 0)
        return elapsed
