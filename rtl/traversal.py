"""Traversal: one kd-tree step for four rays a clock."""

from amaranth.hdl import Module, Mux, Signal
from amaranth.lib import data, stream, wiring
from amaranth.lib.wiring import In, Out

from fpu import Datapath, Delay

from .arithmetic import ARITHMETICS
from .block_memory import BlockMemory
from .layout import (
    PACKET_RAYS,
    Axis,
    IntervalSource,
    interval_layout,
    node_layout,
    thread_width,
    token_layout,
    with_token,
)
from .ray_store import RayStore, ray_store_ports

__all__ = ["Traversal", "kd_step"]


def kd_step(fmt, *, latencies=None, arithmetic=ARITHMETICS[0]):
    """One ray's kd-step: t = (split − origin) / direction; which children it visits, and on which interval.

    A ray with direction > 0 visits the lower child on [t_near, min(t, t_far)] if t_near ≤ t, and the upper
    child on [max(t, t_near), t_far] if t ≤ t_far; with direction < 0 the other way round. A ray that runs
    parallel to the plane stays on its side of it, and visits both children if it runs inside of the plane: the
    sign of split − origin decides, never 0/0. The interval comes in just in time, as late as t is known.

    Datapath: 1 subtracter, 1 divider, 2 comparators.
    """
    dp = Datapath(fmt, latencies=latencies, **arithmetic.parameters)
    split, origin, direction = dp.input("split"), dp.input("origin"), dp.input("direction")
    offset = dp.sub(split, origin)
    t = dp.mul(offset, dp.reciprocal(direction)) if arithmetic.by_reciprocal else dp.div(offset, direction)
    t_near, t_far = (dp.input(name, delay=dp.arrival(t)) for name in ("t_near", "t_far"))
    before = dp.le(t_near, t)
    beyond = dp.le(t, t_far)
    parallel = dp.is_zero(direction)
    backward = dp.sign(direction)
    crossing = dp.logical_not(parallel)
    forward_crossing = dp.logical_and(crossing, dp.logical_not(backward))
    backward_crossing = dp.logical_and(crossing, backward)
    on_plane = dp.is_zero(offset)
    above = dp.sign(offset)
    dp.output("lower", dp.select(parallel, dp.logical_or(on_plane, dp.logical_not(above)),
                                 dp.select(backward, beyond, before)))
    dp.output("upper", dp.select(parallel, dp.logical_or(on_plane, above),
                                 dp.select(backward, before, beyond)))
    dp.output("lower_near", dp.select(dp.logical_and(backward_crossing, before), t, t_near))
    dp.output("lower_far", dp.select(dp.logical_and(forward_crossing, beyond), t, t_far))
    dp.output("upper_near", dp.select(dp.logical_and(forward_crossing, before), t, t_near))
    dp.output("upper_far", dp.select(dp.logical_and(backward_crossing, beyond), t, t_far))
    dp.output("backward", backward)
    return dp


class Traversal(wiring.Component):
    """Takes packets down a kd-tree, from a node to a leaf, one step a clock.

    A step of a packet whose rays all go to one child takes them there. One whose rays part goes first to the
    child that its lowest-numbered active ray enters first, and puts the other on the stack with the intervals
    of the rays that visit it; every entry has intervals of its own, so the order matters to speed only. An
    empty child is never visited; a step that leads nowhere pops the stack.

    Parameters
    ----------
    fmt : :class:`~fpu.FloatFormat`
        Format of coordinates and ray parameters.
    num_threads, stack_depth, index_width : int
        See :class:`~rtl.config.ChipConfig`.
    latencies : dict
        Of the operators, see :class:`~fpu.Datapath`.
    arithmetic : :class:`~rtl.arithmetic.Arithmetic`
        How it computes.

    Members
    -------
    node : stream of ``{"item", "payload": token}``: a node for the packet to visit, from the node cache
    child : stream of ``{"token", "node"}``: the next node to visit, to the node cache
    leaf : stream of ``{"token", "list"}``: a leaf that is reached and is not empty
    pop : stream of tokens: nothing more to visit from here
    push : what goes onto the stack
    step_address, step_rays : to and from the :class:`~rtl.ray_store.RayStore`
    popping, popped_address, popped_intervals : to and from the :class:`~rtl.stack.TraversalStack`
    busy : a step begins
    """

    def __init__(self, *, fmt, num_threads, stack_depth, index_width, latencies=None,
                 arithmetic=ARITHMETICS[0]):
        self._fmt = fmt
        self._latencies = latencies
        self._arithmetic = arithmetic
        self._num_threads = num_threads
        self._token = token = token_layout(num_threads=num_threads, stack_depth=stack_depth)
        self._node = node_layout(fmt=fmt, index_width=index_width)
        self._intervals = data.ArrayLayout(interval_layout(fmt), PACKET_RAYS)
        store = ray_store_ports(fmt=fmt, num_threads=num_threads)
        super().__init__({
            "node": In(stream.Signature(data.StructLayout({"item": self._node.size, "payload": token}),
                                        always_ready=True)),
            "child": Out(stream.Signature(with_token(token, node=index_width), always_ready=True)),
            "leaf": Out(stream.Signature(with_token(token, list=index_width), always_ready=True)),
            "pop": Out(stream.Signature(token, always_ready=True)),
            "push": Out(data.StructLayout({"valid": 1, "token": token, "node": index_width,
                                           "intervals": self._intervals})),
            "step_address": Out(store["step_address"]),
            "step_rays": In(store["step_rays"]),
            "popping": Out(1),
            "popped_address": Out(thread_width(num_threads)),
            "popped_intervals": In(self._intervals),
            "busy": Out(1),
        })

    def elaborate(self, platform):
        m = Module()
        graph = kd_step(self._fmt, latencies=self._latencies, arithmetic=self._arithmetic)
        steps = [graph.component() for _ in range(PACKET_RAYS)]
        read_latency = RayStore.read_latency
        # The interval's address goes out so much before the interval is wanted, as the rays' did before them, and a
        # cycle earlier if it can, for which of the intervals it is.
        fetch_at = max(graph.inputs["t_near"].start - 1, 0)
        select_latency = graph.inputs["t_near"].start - fetch_at

        token = self.node.payload.payload
        node = Signal(self._node)
        stepping = Signal()
        m.d.comb += [
            node.eq(self.node.payload.item),
            stepping.eq(self.node.valid & (node.axis != Axis.LEAF)),
            self.busy.eq(stepping),
            self.leaf.payload.token.eq(token),
            self.leaf.payload.list.eq(node.child),
            self.leaf.valid.eq(self.node.valid & (node.axis == Axis.LEAF)),
            self.step_address.valid.eq(stepping),
            self.step_address.thread.eq(token.thread),
            self.step_address.level.eq(token.level),
            self.step_address.axis.eq(node.axis),
        ]

        # What the step needs besides the rays travels beside it: the split to where the rays have been read,
        # the token to where the interval is wanted, the children to the decision.
        m.submodules.split = split = Delay(self._fmt, cycles=read_latency)
        m.d.comb += split.i.eq(node.split)
        where_layout = data.StructLayout({"token": self._token, "child": node.child.shape(),
                                          "lower_empty": 1, "upper_empty": 1})
        m.submodules.to_fetch = to_fetch = Delay(where_layout, cycles=fetch_at, registered=True)
        m.submodules.to_decision = to_decision = Delay(
            where_layout, cycles=read_latency + graph.latency - fetch_at, registered=True)
        valid = Signal(read_latency + graph.latency + 1)
        m.d.comb += [
            to_fetch.i.token.eq(token),
            to_fetch.i.child.eq(node.child),
            to_fetch.i.lower_empty.eq(node.lower_empty),
            to_fetch.i.upper_empty.eq(node.upper_empty),
            to_decision.i.eq(to_fetch.o),
            valid[0].eq(stepping),
        ]
        m.d.sync += valid[1:].eq(valid[:-1])

        # The interval, from where the token says it is.
        thread_bits = thread_width(self._num_threads)
        m.submodules.intervals = intervals = BlockMemory(self._intervals, depth=1 << thread_bits)
        write = intervals.write
        fetch, fetching = to_fetch.o.token, valid[fetch_at]
        m.submodules.source = source = Delay(IntervalSource, cycles=intervals.latency)
        m.d.comb += [
            intervals.reading.eq(fetching & (fetch.interval == IntervalSource.STEP)),
            intervals.address.eq(fetch.thread),
            self.popping.eq(fetching & (fetch.interval == IntervalSource.POP)),
            self.popped_address.eq(fetch.thread),
            source.i.eq(fetch.interval),
        ]
        m.submodules.select = select = Delay(self._intervals, cycles=select_latency)
        current = select.o
        with m.Switch(source.o):
            with m.Case(IntervalSource.STEP):
                m.d.comb += select.i.eq(intervals.data)
            with m.Case(IntervalSource.POP):
                m.d.comb += select.i.eq(self.popped_intervals)
            with m.Default():
                for ray in range(PACKET_RAYS):
                    m.d.comb += [
                        select.i[ray].t_near.eq(self._fmt.const(0.0)),
                        select.i[ray].t_far.eq(self._fmt.const(float("inf"))),
                    ]

        where = to_decision.o
        goes_lower, goes_upper = Signal(PACKET_RAYS), Signal(PACKET_RAYS)
        backward = Signal(PACKET_RAYS)
        lower, upper = Signal(self._intervals), Signal(self._intervals)
        for ray, step in enumerate(steps):
            m.submodules[f"step{ray}"] = step
            m.d.comb += [
                step.split.eq(split.o),
                step.origin.eq(self.step_rays[ray].origin),
                step.direction.eq(self.step_rays[ray].direction),
                step.t_near.eq(current[ray].t_near),
                step.t_far.eq(current[ray].t_far),
                goes_lower[ray].eq(step.lower & where.token.mask[ray] & ~where.lower_empty),
                goes_upper[ray].eq(step.upper & where.token.mask[ray] & ~where.upper_empty),
                backward[ray].eq(step.backward),
                lower[ray].t_near.eq(step.lower_near),
                lower[ray].t_far.eq(step.lower_far),
                upper[ray].t_near.eq(step.upper_near),
                upper[ray].t_far.eq(step.upper_far),
            ]

        # The decision, one stage: where to, and what to put off. The next stage carries it out.
        choice = Signal(data.StructLayout({"upper": 1, "both": 1, "none": 1}), reset_less=True)
        chosen = Signal(data.StructLayout({
            "where": where_layout, "goes_lower": PACKET_RAYS, "goes_upper": PACKET_RAYS,
            "lower": self._intervals, "upper": self._intervals}), reset_less=True)
        decided = Signal()
        upper_first = Signal()
        for ray in reversed(range(PACKET_RAYS)):
            with m.If(where.token.mask[ray]):
                m.d.comb += upper_first.eq(backward[ray])
        # The loop above runs from the last ray to the first, so the lowest-numbered active ray has the say.
        m.d.sync += [
            decided.eq(valid[-1]),
            choice.both.eq(goes_lower.any() & goes_upper.any()),
            choice.none.eq(~goes_lower.any() & ~goes_upper.any()),
            choice.upper.eq(goes_upper.any() & (upper_first | ~goes_lower.any())),
            chosen.where.eq(where),
            chosen.goes_lower.eq(goes_lower),
            chosen.goes_upper.eq(goes_upper),
            chosen.lower.eq(lower),
            chosen.upper.eq(upper),
        ]
        here = chosen.where.token
        upper_child = Signal.like(chosen.where.child)
        m.d.comb += [
            upper_child.eq(chosen.where.child | 1),
            self.child.valid.eq(decided & ~choice.none),
            self.child.payload.node.eq(Mux(choice.upper, upper_child, chosen.where.child)),
            self.child.payload.token.eq(here),
            self.child.payload.token.mask.eq(Mux(choice.upper, chosen.goes_upper, chosen.goes_lower)),
            self.child.payload.token.sp.eq(here.sp + choice.both),
            self.child.payload.token.interval.eq(IntervalSource.STEP),
            write.valid.eq(self.child.valid),
            write.address.eq(here.thread),
            write.data.eq(Mux(choice.upper, chosen.upper, chosen.lower)),
            self.push.valid.eq(decided & choice.both),
            self.push.token.eq(here),
            self.push.token.mask.eq(Mux(choice.upper, chosen.goes_lower, chosen.goes_upper)),
            self.push.node.eq(Mux(choice.upper, chosen.where.child, upper_child)),
            self.push.intervals.eq(Mux(choice.upper, chosen.lower, chosen.upper)),
            self.pop.valid.eq(decided & choice.none),
            self.pop.payload.eq(here),
        ]
        return m
