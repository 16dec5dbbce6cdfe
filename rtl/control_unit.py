"""Where a ray goes on in its program, its stack, and its last hit."""

from itertools import pairwise

from amaranth.hdl import Assert, Cat, Module, Mux, Signal
from amaranth.lib import data, wiring
from amaranth.lib.wiring import In, Out
from amaranth.utils import ceil_log2

from .block_memory import BlockMemory
from .instruction_fetch import ray_token_layout
from .intersection import hit_layout
from .layout import PACKET_RAYS, thread_slots, thread_width
from .microcode import NO_TRIANGLE, Condition, Op, instruction_layout, lane_width
from .register_file import lanes_layout
from .results import in_lanes, result_layout

__all__ = ["CONTROL_OPS", "ControlUnit"]

#: Operations of this unit.
CONTROL_OPS = frozenset({Op.MOVE, Op.BRANCH, Op.CALL, Op.RETURN, Op.HIT, Op.PUSH, Op.POP})


class ControlUnit(wiring.Component):
    """Executes :data:`CONTROL_OPS`, one a clock, in three cycles; and says what follows instructions of others.

    Parameters
    ----------
    fmt, num_threads, program, stack_depth, bank_bits
        See :class:`~rtl.instruction_fetch.InstructionFetch`.
    index_width : int
        Bits of a triangle's number.

    Members
    -------
    i : ``{"valid", "token", "instruction", "a", "x"}``
    following : the token as it is after the instruction, if it is none of these
    record_address, record : to and from the :class:`~rtl.intersection.Intersection`
    o : ``{"valid", "result"}``, see :func:`~rtl.results.result_layout`
    """

    latency = 3

    def __init__(self, *, fmt, num_threads, program, stack_depth, index_width, bank_bits=0):
        self._fmt = fmt
        self._stack_depth = stack_depth
        self._bank_bits = bank_bits
        self._num_rays = PACKET_RAYS * thread_slots(num_threads, bank_bits)
        self._conditions = {line["condition"] for line in program.instructions if line["op"] is Op.BRANCH}
        self._ops = program.ops
        self._lanes = lanes = lanes_layout(fmt)
        self._token = token = ray_token_layout(num_threads=num_threads, program=program, stack_depth=stack_depth)
        self._result = result_layout(token, lanes)
        super().__init__({
            "i": In(data.StructLayout({"valid": 1, "token": token, "a": lanes, "x": lanes,
                                       "instruction": instruction_layout(len(program.instructions))})),
            "following": Out(token),
            "record_address": Out(data.StructLayout({"ray": range(PACKET_RAYS), "thread": thread_width(num_threads)})),
            "record": In(hit_layout(fmt=fmt, index_width=index_width)),
            "o": Out(data.StructLayout({"valid": 1, "result": self._result})),
        })

    def elaborate(self, platform):
        m = Module()
        op, token = self.i.instruction.op, self.i.token
        next_counter = Signal.like(token.counter)
        m.d.comb += [
            next_counter.eq(token.counter + 1),
            self.following.eq(token),
            self.following.counter.eq(next_counter),
            self.record_address.ray.eq(token.ray),
            self.record_address.thread.eq(token.thread),
        ]
        # Where a ray jumps to, and whether it does, which takes a while to find out: used two cycles later.
        holds, always, may, jumps = self._holds(m), *(Signal(name=name, reset_less=True)
                                                      for name in ("always", "may", "jumps"))
        target, place = (Signal.like(token.counter, name=name, reset_less=True) for name in ("target", "place"))
        m.d.sync += [
            always.eq((op == Op.CALL) | (op == Op.RETURN)),
            may.eq(op == Op.BRANCH),
            jumps.eq(always | may & holds),
            place.eq(Mux(op == Op.RETURN, self.i.x[0], self.i.instruction.target)),
            target.eq(place),
        ]

        stages = [Signal(data.StructLayout({"valid": 1, "op": Op, "part": 1, "result": self._result}),
                         name=f"stage{stage}", reset_less=stage > 0) for stage in range(self.latency + 1)]
        first, _, read, last = stages
        m.d.comb += [
            first.valid.eq(self.i.valid),
            first.op.eq(op),
            first.part.eq(self.i.instruction.bit),
            first.result.token.eq(self.following),
            first.result.last.eq(1),
            first.result.dst.eq(self.i.instruction.dst),
            first.result.value.eq(self.i.x),
            self.o.valid.eq(last.valid),
            self.o.result.eq(last.result),
        ]
        with m.If((op != Op.BRANCH) & (op != Op.RETURN) & (op != Op.PUSH)):
            m.d.comb += first.result.mask.eq(self.i.instruction.mask)
        with m.Switch(op):
            with m.Case(Op.PUSH):
                m.d.comb += first.result.token.sp.eq(token.sp + 1)
            with m.Case(Op.POP):
                m.d.comb += first.result.token.sp.eq(token.sp - 1)
        if Op.CALL in self._ops:
            with m.If(op == Op.CALL):
                m.d.comb += first.result.value.eq(in_lanes(self._fmt, *[next_counter] * 3))
        for earlier, later in pairwise(stages):
            m.d.sync += later.eq(earlier)
        with m.If(jumps):
            m.d.sync += last.result.token.counter.eq(target)
        # What is read in memory is there with the last stage but one.
        if Op.HIT in self._ops:
            with m.If(read.op == Op.HIT):
                m.d.sync += last.result.value.eq(self._hit(read))
        if Op.POP in self._ops:
            self._stack(m, op, token, read, last)
        return m

    def _holds(self, m):
        """Whether a branch's condition holds, a cycle after the branch."""
        instruction = self.i.instruction
        raw = self.i.x[0]
        x = self._fmt(raw[:self._fmt.width])
        zero, less, miss = Signal(), Signal(), Signal()
        bit = Signal()
        m.d.comb += [zero.eq(x.exp == 0), bit.eq(raw.bit_select(instruction.bit, 1)), miss.eq(raw == NO_TRIANGLE),
                     less.eq(raw < self.i.a.as_value().word_select(instruction.select[1].as_value()[:2],
                                                                   lane_width(self._fmt)))]
        negative = x.sign & ~zero
        none = ~raw.any()
        values = {
            Condition.ALWAYS: 1, Condition.NEGATIVE: negative, Condition.NOT_NEGATIVE: ~negative,
            Condition.ZERO: zero, Condition.NOT_ZERO: ~zero, Condition.NONE: none, Condition.SOME: ~none,
            Condition.LESS: less, Condition.NOT_LESS: ~less, Condition.SET: bit, Condition.CLEAR: ~bit,
            Condition.MISS: miss, Condition.EMPTY: self.i.token.sp == 0}
        holds, asked = Signal(), Signal.like(instruction.condition, reset_less=True)
        m.d.sync += asked.eq(instruction.condition)
        with m.Switch(asked):
            for condition in sorted(self._conditions, key=lambda condition: condition.value):
                value = Signal(name=condition.name.lower(), reset_less=True)
                m.d.sync += value.eq(values[condition])
                with m.Case(condition):
                    m.d.comb += holds.eq(value)
        return holds

    def _hit(self, read):
        """The two parts of a record; a ray without one has hit no triangle."""
        record = self.record
        is_none = ~read.result.token.hit | record.triangle.all()
        where = in_lanes(self._fmt, record.t, record.u, record.v)
        what = in_lanes(self._fmt, Mux(is_none, NO_TRIANGLE, record.triangle),
                        Mux(record.in_instance, record.instance, NO_TRIANGLE), record.cosine)
        return Mux(read.part, what, where)

    def _stack(self, m, op, token, read, last):
        # Of 39 entries a memory of 64 would be wasted: the upper ones have one of their own, that of 8.
        lower_bits = max(self._stack_depth.bit_length() - 1, 1)
        upper_bits = ceil_log2(max(self._stack_depth - (1 << lower_bits), 1))
        has_upper = self._stack_depth > 1 << lower_bits
        pushes, pops = Signal(), Signal()
        below = Signal.like(token.sp)
        is_upper = Signal(2, name="is_upper", reset_less=True)
        m.d.comb += [pushes.eq(self.i.valid & (op == Op.PUSH)), pops.eq(self.i.valid & (op == Op.POP)),
                     below.eq(token.sp - 1)]
        m.d.sync += [
            is_upper.eq(Cat(below >> lower_bits != 0, is_upper[0])),
            Assert(~pushes | (token.sp < self._stack_depth), "a ray's stack overflows"),
            Assert(~pops | (token.sp != 0), "a ray takes from an empty stack"),
        ]
        halves = [("lower", lower_bits, 0), ("upper", upper_bits, 1)][:1 + has_upper]
        for name, entry_bits, number in halves:
            stack = BlockMemory(self._lanes, depth=self._num_rays << entry_bits)
            m.submodules[f"stack_{name}"] = stack

            def address(entry, entry_bits=entry_bits):
                return Cat(entry[:entry_bits], token.ray, token.thread[self._bank_bits:])

            m.d.comb += [
                stack.write.valid.eq(pushes & ((token.sp >> lower_bits != 0) == number)),
                stack.write.address.eq(address(token.sp)),
                stack.write.data.eq(self.i.a),
                stack.reading.eq(pops & ((below >> lower_bits != 0) == number)),
                stack.address.eq(address(below)),
            ]
            with m.If((read.op == Op.POP) & (is_upper[1] == number)):
                m.d.sync += last.result.value.eq(stack.data)
