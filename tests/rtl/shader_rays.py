"""Random programs for the shader, and an interpreter of them that knows the words of :mod:`rtl.microcode` alone."""

import random
from dataclasses import dataclass, field

from rtl.microcode import NO_TRIANGLE, NUM_REGISTERS, Assembler, Condition, Lane, Mode, Op, Store, X, Y, Z
from tests.fpu import reference
from tests.rtl.color_operations import color_operation

__all__ = ["Interpreter", "Outcome", "product", "random_program"]

#: Registers of floats and of integers, so that each operation gets what it is made for.
FLOATS, INTEGERS = range(0, 6), range(8, 14)
RECORD, TEXEL, LINK, STATE = 16, 20, 22, 23
CONSTANT_VECTORS = range(NUM_REGISTERS, NUM_REGISTERS + 5)
COLOR_OPS = (Op.CUT, Op.COLOR_MULTIPLY, Op.COLOR_ADD, Op.COLOR_SUBTRACT, Op.DECODE, Op.BYTES)
ON_FLOATS = (Condition.NEGATIVE, Condition.NOT_NEGATIVE, Condition.ZERO, Condition.NOT_ZERO)
ON_INTEGERS = (Condition.NONE, Condition.SOME, Condition.LESS, Condition.NOT_LESS, Condition.SET, Condition.CLEAR,
               Condition.MISS, Condition.EMPTY, Condition.ALWAYS)
ANY_HIT, HAS_FAR, SAME_ORIGIN = 1, 2, 4
#: Generations of rays, and registers that are pushed in each besides those that are kept.
NUM_GENERATIONS = 4
STACK_DEPTH = NUM_GENERATIONS + 3


class Writer:
    """Writes a random program: rays that are traced up to four times and keep something on their stacks."""

    def __init__(self, rng, *, block):
        self.rng = rng
        self.asm = Assembler()
        self.block_length = block
        self.float_literals = [self.asm.literal(*(rng.randrange(-64, 65) / 16 for _ in range(3))) for _ in range(3)]
        self.integer_literals = [self.asm.literal(*(rng.choice([0, 255, 65536, NO_TRIANGLE, rng.getrandbits(24)])
                                                    for _ in range(3))) for _ in range(3)]
        self.small = self.asm.literal(*(rng.randrange(900) for _ in range(3)))
        # Place in memory; then sides, whether it is filtered, whether folded.
        self.texture = self.asm.literal(rng.getrandbits(24), rng.getrandbits(10), 0)
        self.num_labels = 0
        self.has_hit = False

    def fresh(self):
        self.num_labels += 1
        return f"label{self.num_labels}"

    def float(self):
        return self.rng.choice([*FLOATS, *FLOATS, RECORD, RECORD + 1, *CONSTANT_VECTORS, *self.float_literals])

    def integer(self):
        return self.rng.choice([*INTEGERS, *INTEGERS, RECORD + 2, RECORD + 3, TEXEL, TEXEL + 1, *self.integer_literals])

    def lanes(self, register):
        """The register with lanes, of floats some negated."""
        rng = self.rng
        is_integer = register in (*INTEGERS, *range(RECORD + 2, STATE + 1), self.small, *self.integer_literals)
        lanes = []
        for _ in range(3):
            if not is_integer and rng.random() < 0.3:
                lanes.append("-")
            lanes.append(rng.choice([X, Y, Z, X, Y, Z, Lane.ZERO] if is_integer else list(Lane)))
        return register, tuple(lanes)

    def any_mask(self):
        return self.rng.randrange(1, 8)

    def operation(self):
        """One that is no jump."""
        rng, emit = self.rng, self.asm.emit
        float_dst, integer_dst = rng.choice(FLOATS), rng.choice(INTEGERS)
        match rng.choice(["vector", "vector", "vector", "root", "color", "color", "color", "offset", "float", "integer",
                          "load", "texture", "hit" if self.has_hit else "vector"]):
            case "vector":
                emit(Op.VECTOR, dst=float_dst, mask=self.any_mask(), a=self.float(), b=self.float(), c=self.float(),
                     x=self.lanes(self.float()), mode=rng.choice(list(Mode)), store=rng.choice(list(Store)))
            case "root":
                emit(Op.ROOT, dst=float_dst, mask=self.any_mask(), x=self.lanes(self.float()))
            case "color":
                op = rng.choice(COLOR_OPS)
                emit(op, dst=integer_dst, mask=self.any_mask(), a=self.integer(),
                     x=self.lanes(self.float() if op is Op.CUT else self.integer()))
            case "offset":
                emit(Op.OFFSET, dst=float_dst, mask=self.any_mask(), a=self.float(), x=self.lanes(self.float()))
            case "float":
                emit(Op.MOVE, dst=float_dst, mask=self.any_mask(), x=self.lanes(self.float()))
            case "integer":
                emit(Op.MOVE, dst=integer_dst, mask=self.any_mask(), x=self.lanes(self.integer()))
            case "load":
                self.load()
            case "texture":
                self.texel()
            case "hit":
                self.hit()

    def load(self):
        self.asm.emit(Op.LOAD, dst=RECORD, a=self.rng.choice([STATE, self.small]),
                      x=(self.small, tuple(self.rng.choice([X, Y, Z]) for _ in range(3))))

    def texel(self):
        self.asm.emit(Op.TEXTURE, dst=TEXEL, a=self.texture, x=self.lanes(self.float()))

    def hit(self):
        """All of it; of a ray that has hit nothing only that is to be read."""
        self.asm.emit(Op.HIT, dst=self.rng.choice(FLOATS), mask=self.any_mask(), bit=0)
        self.asm.emit(Op.HIT, dst=self.rng.choice(INTEGERS), mask=self.rng.choice([1, 2, 3]), bit=1)
        self.asm.emit(Op.HIT, dst=self.rng.choice(FLOATS), mask=4, bit=1)

    def branch(self, target, condition=None):
        rng = self.rng
        condition = rng.choice([*ON_FLOATS, *ON_INTEGERS]) if condition is None else condition
        x = self.float() if condition in ON_FLOATS else self.integer()
        self.asm.emit(Op.BRANCH, condition=condition, a=self.integer(), bit=rng.randrange(24), target=target,
                      x=(x, tuple(rng.choice([X, Y, Z]) for _ in range(3))))

    def block(self, length, *, depth=0):
        """Operations, some of which are jumped over, some of them called, some between a push and a pop."""
        rng, asm = self.rng, self.asm
        for _ in range(length):
            match rng.choice(["operation"] * 6 + ["branch", "push", "call"]):
                case "branch" if depth < 2:
                    label = self.fresh()
                    self.branch(label)
                    self.block(rng.randrange(1, 4), depth=depth + 1)
                    asm.label(label)
                case "push" if depth < 2:
                    kind = rng.choice([FLOATS, INTEGERS])
                    asm.emit(Op.PUSH, a=rng.choice(kind))
                    self.block(rng.randrange(3), depth=depth + 1)
                    asm.emit(Op.POP, dst=rng.choice(kind))
                case "call" if depth == 0:
                    asm.emit(Op.CALL, dst=LINK, mask=0b010, target="subroutine")
                case _:
                    self.operation()

    def program(self):
        rng, asm = self.rng, self.asm
        asm.emit(Op.MOVE, dst=STATE, x=asm.literal(NUM_GENERATIONS))
        for register in [*FLOATS][1:]:
            asm.emit(Op.MOVE, dst=register, x=rng.choice([*CONSTANT_VECTORS, *self.float_literals]))
        for register in INTEGERS:
            asm.emit(Op.MOVE, dst=register, x=rng.choice(self.integer_literals))
        self.load()
        self.texel()
        self.block(self.block_length)
        asm.label("generation")
        asm.emit(Op.BRANCH, condition=Condition.NONE, x=(STATE, X), target="finish")
        asm.emit(Op.COLOR_SUBTRACT, dst=STATE, a=STATE, x=asm.literal(1))
        self.block(self.block_length)
        asm.emit(Op.PUSH, a=self.integer())
        asm.emit(Op.TRACE, a=rng.choice([RECORD, *self.float_literals]), bit=rng.randrange(8),
                 x=(rng.choice(INTEGERS), (rng.choice([X, Y, Z]), rng.choice([X, Y, Z]), Lane.ZERO)))
        asm.emit(Op.HIT, dst=INTEGERS[0], bit=1, mask=1)
        asm.emit(Op.BRANCH, condition=Condition.MISS, x=(INTEGERS[0], X), target="finish")
        self.has_hit = True
        self.hit()
        self.block(self.block_length)
        asm.emit(Op.BRANCH, condition=Condition.ALWAYS, target="generation")
        asm.label("finish")
        asm.emit(Op.BRANCH, condition=Condition.EMPTY, target="end")
        asm.emit(Op.POP, dst=INTEGERS[1])
        asm.emit(Op.COLOR_ADD, dst=INTEGERS[2], a=INTEGERS[1], x=self.lanes(INTEGERS[2]))
        asm.emit(Op.BRANCH, condition=Condition.ALWAYS, target="finish")
        asm.label("end")
        asm.emit(Op.BYTES, dst=INTEGERS[2], x=self.lanes(INTEGERS[2]))
        asm.emit(Op.EMIT, x=self.lanes(INTEGERS[2]))
        asm.label("subroutine")
        # Where a call comes from varies: a ray need not have hit anything.
        self.has_hit = False
        self.block(self.block_length // 2, depth=1)
        asm.emit(Op.RETURN, x=(LINK, (Y,)))
        return asm.assembled()


def random_program(seed, *, block):
    """A program that ends for every ray."""
    return Writer(random.Random(seed), block=block).program()


def product(fmt, rows, x):
    """(m₀·x₀ + m₁·x₁) + m₂·x₂ of each row, as bits of floats."""
    widths = fmt.exp_width, fmt.frac_width

    def row_sum(row):
        first, second, third = (reference.multiply(m, v, *widths) for m, v in zip(row, x, strict=True))
        return reference.add(reference.add(first, second, *widths), third, *widths)

    return [row_sum(row) for row in rows]


@dataclass
class Outcome:
    """What a ray does, of each kind in order, and its colour."""

    steps: list = field(default_factory=list)
    loads: list = field(default_factory=list)
    texels: list = field(default_factory=list)
    traces: list = field(default_factory=list)
    color: list = None
    num_instructions: int = 0
    most_pushed: int = 0


class Interpreter:
    """Runs a program for one ray after the other.

    Parameters
    ----------
    fmt : FloatFormat
        The chip's.
    program : Program
        What it runs.
    camera : list
        Three rows and the origin, floats.
    record, texel : callable
        A number's twelve lanes; colours and opacity at a request (s, t, a₀, a₁).
    """

    def __init__(self, fmt, program, *, camera, record, texel):
        self.fmt = fmt
        self.program = program
        self.record, self.texel = record, texel
        self.constants = [[0, 0, 0], *(self.bits(vector) for vector in camera),
                          *(self.bits(literal) for literal in program.literals)]

    def bits(self, values):
        return [int(self.fmt.encode(value)) if isinstance(value, float) else value for value in values]

    def run(self, screen, hits):
        """Outcome of the ray with ``screen`` in register 0; ``hits`` are its hits, None where there is none."""
        fmt, outcome = self.fmt, Outcome()
        registers = [list(screen)] + [[None] * 3 for _ in range(NUM_REGISTERS - 1)] + self.constants
        one, sign = int(fmt.encode(1.0)), 1 << fmt.width - 1
        stack, counter, hit = [], 0, None
        hits = iter(hits)
        while outcome.color is None:
            now = self.program.instructions[counter]
            counter += 1
            outcome.num_instructions += 1
            op, dst, select = now["op"], now["dst"], now["select"]
            a, b, c = (list(registers[now[name]]) for name in "abc")
            choices = [*registers[now["x"]], 0, one]
            x = [choices[choice] ^ (sign if now["negate"] >> lane & 1 else 0) if choices[choice] is not None else None
                 for lane, choice in enumerate(select)]
            writes = {}
            match op:
                case Op.VECTOR:
                    rows = {Mode.COLUMNS: list(zip(a, b, c, strict=True)), Mode.ROWS: [a, b, c],
                            Mode.DIAGONAL: [[a[0], 0, 0], [0, a[1], 0], [0, 0, a[2]]]}[now["mode"]]
                    writes[dst] = product(fmt, rows, x)
                    outcome.steps.append((now["store"], writes[dst]))
                case Op.BRANCH:
                    if self.holds(now, x[0], a[select[1]], stack):
                        counter = now["target"]
                case Op.CALL:
                    writes[dst] = [counter] * 3
                    counter = now["target"]
                case Op.RETURN:
                    counter = x[0]
                case Op.LOAD:
                    number = x[0] + a[select[1]]
                    outcome.loads.append(number)
                    lanes = self.record(number)
                    writes = {dst + k: lanes[3 * k:3 * k + 3] for k in range(4)}
                case Op.TEXTURE:
                    outcome.texels.append((x[0], x[1], a[0], a[1]))
                    *color, opacity = self.texel(*outcome.texels[-1])
                    writes = {dst: color, dst + 1: [opacity] * 3}
                case Op.HIT if now["bit"] == 0:
                    writes[dst] = self.bits(hit[name] for name in "tuv") if hit is not None else [None] * 3
                case Op.HIT if hit is None:
                    writes[dst] = [NO_TRIANGLE, None, None]
                case Op.HIT:
                    writes[dst] = [hit["triangle"], hit["instance"] if hit["in_instance"] else NO_TRIANGLE,
                                   *self.bits([hit["cosine"]])]
                case Op.TRACE:
                    outcome.traces.append({"flags": now["bit"], "t_near": a[0], "t_far": a[1], "triangle": x[0],
                                           "instance": x[1], "number": x[2]})
                    hit = next(hits)
                case Op.PUSH:
                    stack.append(a)
                    outcome.most_pushed = max(outcome.most_pushed, len(stack))
                case Op.POP:
                    writes[dst] = stack.pop()
                case Op.EMIT:
                    outcome.color = x
                case _:
                    writes[dst] = color_operation(fmt, op, a, x)
            for register, lanes in writes.items():
                for lane in range(3):
                    if now["mask"] >> lane & 1:
                        registers[register][lane] = lanes[lane]
        return outcome

    def holds(self, now, x, a, stack):
        number = float(self.fmt.decode(x & (1 << self.fmt.width) - 1))
        match now["condition"]:
            case Condition.ALWAYS:
                return True
            case Condition.NEGATIVE:
                return number < 0
            case Condition.NOT_NEGATIVE:
                return number >= 0
            case Condition.ZERO:
                return number == 0
            case Condition.NOT_ZERO:
                return number != 0
            case Condition.NONE:
                return x == 0
            case Condition.SOME:
                return x != 0
            case Condition.LESS:
                return x < a
            case Condition.NOT_LESS:
                return x >= a
            case Condition.SET:
                return x >> now["bit"] & 1 == 1
            case Condition.CLEAR:
                return x >> now["bit"] & 1 == 0
            case Condition.MISS:
                return x == NO_TRIANGLE
            case Condition.EMPTY:
                return not stack
