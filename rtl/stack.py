"""The stacks of kd-tree traversal: what a packet has put off, and what of it is still worth a visit."""

from amaranth.hdl import Assert, Cat, Module, Signal
from amaranth.lib import data, stream, wiring
from amaranth.lib.wiring import In, Out
from amaranth.utils import ceil_log2

from fpu import Datapath

from .block_memory import BlockMemory
from .layout import PACKET_RAYS, IntervalSource, interval_layout, thread_width, token_layout, with_token
from .queue import Merge, Queue

__all__ = ["TraversalStack", "worth_visiting"]


def worth_visiting(fmt, *, latencies=None):
    """``worth`` = t_near ≤ t_hit: the interval begins before what the ray has hit (Datapath, one comparison)."""
    dp = Datapath(fmt, latencies=latencies)
    dp.output("worth", dp.le(dp.input("t_near"), dp.input("t_hit")))
    return dp


class TraversalStack(wiring.Component):
    """Keeps the nodes that packets have put off, and pops those that a ray may still gain from.

    A popped entry is dropped when each of its rays has a hit before the entry's interval; then the next is
    popped. One pop a clock, answered after 4 cycles plus the comparator's latency.

    Parameters
    ----------
    fmt : :class:`~fpu.FloatFormat`
        Format of ray parameters.
    num_threads, stack_depth, index_width : int
        See :class:`~rtl.config.ChipConfig`.
    latencies : dict
        Of the operators, see :class:`~fpu.Datapath`.

    Members
    -------
    push : ``{"valid", "token", "node", "intervals"}``; the entry goes to ``token.sp``
    pop : stream of tokens; what ``token.sp`` − 1 holds is wanted
    resume : stream of ``{"token", "node"}``: an entry worth visiting, its rays as the token's mask
    exhausted : stream of tokens: that level of the stack is empty
    hit_address, hit_distances : the thread whose hit distances are wanted; two cycles later, per ray
    popping, popped_address, popped_intervals : whether the intervals that a thread popped last are wanted, the
        thread; two cycles later, the intervals
    """

    def __init__(self, *, fmt, num_threads, stack_depth, index_width, latencies=None):
        self._fmt = fmt
        self._latencies = latencies
        self._num_threads = num_threads
        self._stack_depth = stack_depth
        self._token = token_layout(num_threads=num_threads, stack_depth=stack_depth)
        self._intervals = data.ArrayLayout(interval_layout(fmt), PACKET_RAYS)
        self._node = with_token(self._token, node=index_width)
        self._index_width = index_width
        super().__init__({
            "push": In(data.StructLayout({"valid": 1, "token": self._token, "node": index_width,
                                          "intervals": self._intervals})),
            "pop": In(stream.Signature(self._token)),
            "resume": Out(stream.Signature(self._node, always_ready=True)),
            "exhausted": Out(stream.Signature(self._token, always_ready=True)),
            "hit_address": Out(thread_width(num_threads)),
            "hit_distances": In(data.ArrayLayout(fmt, PACKET_RAYS)),
            "popping": In(1),
            "popped_address": In(thread_width(num_threads)),
            "popped_intervals": Out(self._intervals),
        })

    def elaborate(self, platform):
        m = Module()
        thread_bits = thread_width(self._num_threads)
        entry_bits = ceil_log2(self._stack_depth)
        entry_layout = data.StructLayout({"node": self._index_width, "mask": PACKET_RAYS,
                                          "intervals": self._intervals})
        m.submodules.entries = entries = BlockMemory(entry_layout, depth=1 << thread_bits + 1 + entry_bits)

        def address(token, position):
            return Cat(position[:entry_bits], token.level, token.thread)

        # The entry is not wanted soon, and has a long way to its many memories.
        push, pushes = Signal.like(self.push, name="pushed", reset_less=True), Signal()
        m.d.sync += [push.eq(self.push), pushes.eq(self.push.valid)]
        m.d.comb += [
            entries.write.valid.eq(pushes),
            entries.write.address.eq(address(push.token, push.token.sp)),
            entries.write.data.node.eq(push.node),
            entries.write.data.mask.eq(push.token.mask),
            entries.write.data.intervals.eq(push.intervals),
        ]
        m.d.sync += Assert(~pushes | (push.token.sp < self._stack_depth), "a traversal stack overflows")

        # An entry that proved worthless sends its token round again.
        m.submodules.merge = merge = Merge(self._token, num_inputs=2)
        m.submodules.dropped = dropped = Queue(self._token, depth=self._num_threads, always_ready=True)
        wiring.connect(m, wiring.flipped(self.pop), merge.i[0])
        wiring.connect(m, dropped.o, merge.i[1])
        token, comes = Signal(self._token, reset_less=True), Signal()
        empty = Signal(reset_less=True)
        position = Signal(range(self._stack_depth + 1), reset_less=True)
        popping = Signal()
        m.d.sync += [token.eq(merge.o.payload), comes.eq(merge.o.valid), empty.eq(merge.o.payload.sp == 0),
                     position.eq(merge.o.payload.sp - 1)]
        m.d.comb += [
            merge.o.ready.eq(1),
            popping.eq(comes & ~empty),
            self.exhausted.payload.eq(token),
            self.exhausted.valid.eq(comes & empty),
            entries.reading.eq(popping),
            entries.address.eq(address(token, position)),
            self.hit_address.eq(token.thread),
        ]

        comparators = [worth_visiting(self._fmt, latencies=self._latencies).component() for _ in range(PACKET_RAYS)]
        latency = comparators[0].latency + 1
        stages = entries.latency + latency
        entry = [Signal(entry_layout, name=f"entry{k}", reset_less=k > 0) for k in range(latency + 1)]
        tokens = [Signal(self._token, name=f"token{k}", reset_less=k > 0) for k in range(stages + 1)]
        valid = [Signal(name=f"valid{k}") for k in range(stages + 1)]
        m.d.comb += [tokens[0].eq(token), tokens[0].sp.eq(position), valid[0].eq(popping), entry[0].eq(entries.data)]
        for stage in range(stages):
            m.d.sync += [tokens[stage + 1].eq(tokens[stage]), valid[stage + 1].eq(valid[stage])]
        for stage in range(latency):
            m.d.sync += entry[stage + 1].eq(entry[stage])

        worth = Signal(PACKET_RAYS, reset_less=True)
        done, done_entry = tokens[-1], entry[-1]
        for ray, comparator in enumerate(comparators):
            m.submodules[f"worth_visiting{ray}"] = comparator
            m.d.comb += [
                comparator.t_near.eq(entry[0].intervals[ray].t_near),
                comparator.t_hit.eq(self.hit_distances[ray]),
            ]
            m.d.sync += worth[ray].eq(entry[-2].mask[ray] & (comparator.worth | ~tokens[-2].hit[ray]))
        keep = Signal()
        m.d.comb += [
            keep.eq(worth.any()),
            dropped.i.payload.eq(done),
            dropped.i.valid.eq(valid[-1] & ~keep),
            self.resume.payload.token.eq(done),
            self.resume.payload.token.mask.eq(worth),
            self.resume.payload.token.interval.eq(IntervalSource.POP),
            self.resume.payload.node.eq(done_entry.node),
            self.resume.valid.eq(valid[-1] & keep),
        ]

        m.submodules.popped = popped = BlockMemory(self._intervals, depth=1 << thread_bits)
        m.d.comb += [
            popped.write.valid.eq(self.resume.valid),
            popped.write.address.eq(done.thread),
            popped.write.data.eq(done_entry.intervals),
            popped.reading.eq(self.popping),
            popped.address.eq(self.popped_address),
            self.popped_intervals.eq(popped.data),
        ]
        return m
