"""The control unit: each operation and condition against the words of the instruction set."""

import random
from collections import Counter, deque
from itertools import product

import pytest

from fpu import FloatFormat
from rtl.control_unit import ControlUnit
from rtl.layout import PACKET_RAYS
from rtl.microcode import NO_TRIANGLE, Condition, Lane, Op, Program, lane_width
from tests.bench import Packed, memory, simulate

FMT = FloatFormat(5, 8)
INDEX_WIDTH, STACK_DEPTH = 24, 3
LANE = (1 << lane_width(FMT)) - 1
OPS = [Op.MOVE, Op.BRANCH, Op.CALL, Op.RETURN, Op.HIT, Op.PUSH, Op.POP]
#: Not the unit's, but it says what follows them.
OTHERS = [Op.VECTOR, Op.ROOT, Op.COLOR_ADD, Op.LOAD, Op.TRACE]


def instruction(op, condition=Condition.ALWAYS):
    return {"op": op, "condition": condition, "dst": 0, "mask": 7, "a": 0, "b": 0, "c": 0, "x": 0,
            "select": [lane.value for lane in (Lane.X, Lane.Y, Lane.Z)], "negate": 0, "target": 0}


#: All that there is, so that everything is built.
EVERYTHING = Program((*(instruction(op) for op in (*OPS, *OTHERS)),
                      *(instruction(Op.BRANCH, condition) for condition in Condition)), ())
NUM_INSTRUCTIONS = len(EVERYTHING.instructions)


def holds(condition, x, a, bit, sp):
    number = float(FMT.decode(x & (1 << FMT.width) - 1))
    return {
        Condition.ALWAYS: True, Condition.NEGATIVE: number < 0, Condition.NOT_NEGATIVE: number >= 0,
        Condition.ZERO: number == 0, Condition.NOT_ZERO: number != 0, Condition.NONE: x == 0, Condition.SOME: x != 0,
        Condition.LESS: x < a, Condition.NOT_LESS: x >= a, Condition.SET: bit < 24 and x >> bit & 1 == 1,
        Condition.CLEAR: bit >= 24 or x >> bit & 1 == 0, Condition.MISS: x == NO_TRIANGLE, Condition.EMPTY: sp == 0,
    }[condition]


class Rays:
    """Instructions of random rays, and what is to come of them."""

    def __init__(self, rng, *, threads):
        self.rng = rng
        self.stacks = {place: [] for place in product(threads, range(PACKET_RAYS))}
        self.records = {place: self.record() for place in self.stacks}
        self.events = Counter()

    def float_bits(self):
        rng = self.rng
        return int(FMT.encode(rng.choice([0.0, -0.0, 1.0, -1.0, rng.randrange(-40, 41) / 16, float("inf"), -1e9])))

    def lane(self):
        rng = self.rng
        return rng.choice([0, 1, NO_TRIANGLE, NO_TRIANGLE - 1, rng.getrandbits(24), rng.getrandbits(4),
                           1 << rng.randrange(24), self.float_bits(), self.float_bits()])

    def record(self):
        rng = self.rng
        return {**{name: rng.randrange(-99, 99) / 8 for name in ("t", "u", "v", "cosine")},
                "triangle": rng.choice([NO_TRIANGLE, rng.getrandbits(24), rng.getrandbits(24)]),
                "instance": rng.getrandbits(24), "in_instance": rng.randrange(2)}

    def next(self, place):
        """An instruction with operands, the token that follows, and the result, of which None may be anything."""
        rng, stack = self.rng, self.stacks[place]
        op = rng.choice([*OPS, Op.BRANCH, Op.PUSH, Op.POP, rng.choice(OTHERS)])
        if op is Op.PUSH and len(stack) == STACK_DEPTH:
            op = Op.POP
        if op is Op.POP and not stack:
            op = Op.PUSH
        a, x = ([self.lane() for _ in range(3)] for _ in range(2))
        now = instruction(op, rng.choice(list(Condition))) | {
            "dst": rng.randrange(32), "mask": rng.randrange(8), "target": rng.randrange(NUM_INSTRUCTIONS),
            "bit": rng.randrange(24) if op is Op.BRANCH else rng.randrange(2)}
        now["select"] = [rng.randrange(3) for _ in range(3)]
        if op is Op.RETURN:
            x[0] = rng.randrange(NUM_INSTRUCTIONS)
        if op is Op.BRANCH and rng.random() < 0.6:
            x[0] = rng.choice([a[now["select"][1]], 0, NO_TRIANGLE, int(FMT.encode(-0.0))])
        token = {"thread": place[0], "ray": place[1], "counter": rng.randrange(NUM_INSTRUCTIONS - 1),
                 "sp": len(stack), "hit": rng.randrange(2)}
        following = token | {"counter": token["counter"] + 1}
        value, mask = list(x), now["mask"]
        match op:
            case Op.BRANCH:
                mask = 0
                jumps = holds(now["condition"], x[0], a[now["select"][1]], now["bit"], len(stack))
                self.events[now["condition"], jumps] += 1
                if jumps:
                    following["counter"] = now["target"]
            case Op.CALL:
                value = [token["counter"] + 1] * 3
                following["counter"] = now["target"]
            case Op.RETURN:
                mask = 0
                following["counter"] = x[0]
            case Op.PUSH:
                mask = 0
                stack.append(a)
                following["sp"] += 1
            case Op.POP:
                value = stack.pop()
                following["sp"] -= 1
            case Op.HIT:
                value = self.hit(self.records[place], token["hit"], now["bit"])
        self.events[op] += 1
        given = {"valid": op in OPS, "token": token, "instruction": now, "a": a, "x": x}
        result = {"token": following, "dst": now["dst"], "mask": mask, "value": value}
        return given, following, result if op in OPS else None

    def hit(self, record, has_distance, part):
        if part == 0:
            return [int(FMT.encode(record[name])) for name in "tuv"]
        is_none = not has_distance or record["triangle"] == NO_TRIANGLE
        self.events["no hit" if is_none else "hit"] += 1
        if is_none:
            return [NO_TRIANGLE, None, None]
        return [record["triangle"], record["instance"] if record["in_instance"] else NO_TRIANGLE,
                int(FMT.encode(record["cosine"]))]


@pytest.mark.parametrize(("seed", "num_threads", "bank_bits"), [(0, 2, 0), (1, 4, 1)])
def test_operations_and_conditions(seed, num_threads, bank_bits):
    rng = random.Random(seed)
    dut = ControlUnit(fmt=FMT, num_threads=num_threads, program=EVERYTHING, stack_depth=STACK_DEPTH,
                      index_width=INDEX_WIDTH, bank_bits=bank_bits)
    rays = Rays(rng, threads=range(rng.randrange(1 << bank_bits), num_threads, 1 << bank_bits))
    packed = Packed(dut.i.shape())
    # A ray has an instruction at a time.
    waiting = deque(rays.stacks)
    latency = ControlUnit.latency

    async def work(ctx):
        pending = deque([None] * latency)
        for _ in range(2500):
            result = None
            if rng.random() < 0.9:
                given, following, result = rays.next(waiting[0])
                waiting.append(waiting.popleft())
                if rng.random() < 0.5:
                    waiting.rotate(-rng.randrange(len(waiting) - latency))
                ctx.set(dut.i.as_value(), packed.pack(given))
                if given["instruction"]["op"] in OTHERS:
                    assert {name: ctx.get(dut.following[name]) for name in following} == following
            else:
                ctx.set(dut.i.valid, 0)
            pending.append(result)
            expected = pending.popleft()
            _, _, valid, result = await ctx.tick().sample(dut.o.valid, dut.o.result)
            assert valid == (expected is not None)
            if expected is not None:
                assert {name: result.token[name] for name in expected["token"]} == expected["token"]
                assert (result.mask, result.last) == (expected["mask"], 1)
                if expected["mask"]:
                    assert result.dst == expected["dst"]
                    for got, lane in zip(result.value, expected["value"], strict=True):
                        assert lane is None or got == lane

    simulate(dut, work, name="control_unit", background=(
        memory(dut.record_address, dut.record, lambda at: rays.records[at.thread, at.ray]),))
    for op in OPS:
        assert rays.events[op] > 40, op
    for condition in Condition:
        assert rays.events[condition, True] > 1, condition
        assert rays.events[condition, False] > 1 or condition is Condition.ALWAYS, condition
    assert min(rays.events["hit"], rays.events["no hit"]) > 5


@pytest.mark.parametrize(("op", "sp", "is_noticed"), [
    (Op.PUSH, STACK_DEPTH - 1, False), (Op.PUSH, STACK_DEPTH, True), (Op.POP, 1, False), (Op.POP, 0, True),
    (Op.MOVE, 0, False), (Op.MOVE, STACK_DEPTH, False)])
def test_stacks_that_are_full_or_empty_are_noticed(op, sp, is_noticed):
    dut = ControlUnit(fmt=FMT, num_threads=1, program=EVERYTHING, stack_depth=STACK_DEPTH, index_width=INDEX_WIDTH)

    async def work(ctx):
        ctx.set(dut.i.instruction.op, op)
        ctx.set(dut.i.token.sp, sp)
        ctx.set(dut.i.valid, 1)
        await ctx.tick()
        ctx.set(dut.i.valid, 0)
        await ctx.tick()

    if is_noticed:
        message = "a ray's stack overflows" if op is Op.PUSH else "a ray takes from an empty stack"
        with pytest.raises(AssertionError, match=message):
            simulate(dut, work, name="control_unit")
    else:
        simulate(dut, work, name="control_unit")


def test_a_program_without_a_stack_has_none():
    program = Program((instruction(Op.MOVE), instruction(Op.BRANCH)), ())
    dut = ControlUnit(fmt=FMT, num_threads=1, program=program, stack_depth=1, index_width=INDEX_WIDTH)

    async def work(ctx):
        ctx.set(dut.i, {"valid": 1, "token": {"counter": 1}, "x": [1, 2, 3],
                        "instruction": {"op": Op.BRANCH, "condition": Condition.ALWAYS, "target": 0}})
        await ctx.tick()
        ctx.set(dut.i.instruction.op, Op.MOVE)
        ctx.set(dut.i.instruction.mask, 5)
        await ctx.tick().repeat(ControlUnit.latency - 1)
        assert ctx.get(dut.o.result.token.counter) == 0
        await ctx.tick()
        result = ctx.get(dut.o.result)
        assert (list(result.value), result.mask) == ([1, 2, 3], 5)
        checked.append(result)

    checked = []
    simulate(dut, work, name="control_unit")
    assert checked
