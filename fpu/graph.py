"""Graphs of float operations, and when their values are there."""

from dataclasses import dataclass

__all__ = ["Graph", "Node", "Vector"]


@dataclass(frozen=True, eq=False)
class Node:
    """Value in a :class:`Datapath`.

    Attributes
    ----------
    op : str
        What computes it.
    operands : tuple of Node
        Of what.
    is_flag : bool
        Whether it is a boolean instead of a float.
    arrival : int or None
        Cycles after which it is there; none for a constant.
    start : int
        Cycle in which its operands are taken.
    payload : str or float or None
        Name of an input, value of a constant.
    """

    op: str
    operands: tuple = ()
    is_flag: bool = False
    arrival: int | None = 0
    start: int = 0
    payload: str | float | None = None


@dataclass(frozen=True)
class Vector:
    """Three float nodes."""

    x: Node
    y: Node
    z: Node

    def __iter__(self):
        return iter((self.x, self.y, self.z))


@dataclass(frozen=True)
class _Output:
    node: Node
    early: bool


class Graph:
    """Float operations, built by calling one method for each.

    Operations on the same operands are one node, and a pair of operands is compared by one comparison whichever
    relations are asked for.

    Parameters
    ----------
    fmt : FloatFormat
        Format of all floats.
    latencies : dict from str to int
        Cycles that a node takes, by its operation, where it takes any.
    """

    def __init__(self, fmt, *, latencies):
        self.fmt = fmt
        self._latencies = dict(latencies)
        self._nodes = {}
        self._inputs = {}
        self._outputs = {}

    # Inputs and outputs

    def input(self, name, *, delay=0):
        """Float that enters under ``name``, ``delay`` cycles after the inputs without a delay."""
        return self._input(name, is_flag=False, delay=delay)

    def flag(self, name, *, delay=0):
        """Boolean that enters under ``name``, ``delay`` cycles after the inputs without a delay."""
        return self._input(name, is_flag=True, delay=delay)

    def vector(self, name, *, delay=0):
        """Three floats that enter as ``name_x``, ``name_y`` and ``name_z``."""
        return Vector(*(self.input(f"{name}_{axis}", delay=delay) for axis in "xyz"))

    def const(self, value):
        """Constant, rounded to the format."""
        # By its bits, for 0.0 == -0.0
        key = ("const", int(self.fmt.encode(value)))
        return self._nodes.setdefault(key, Node("const", arrival=None, payload=float(self.fmt.quantize(value))))

    def output(self, name, node, *, early=False):
        """Let ``node`` leave under ``name``: as soon as it is there if ``early``, else together with the others."""
        self._check_name(name)
        self._outputs[name] = _Output(node, early)

    def _input(self, name, *, is_flag, delay):
        self._check_name(name)
        if delay < 0:
            raise ValueError(f"Delay of input {name!r} must not be negative, but is {delay!r}")
        self._inputs[name] = Node("input", is_flag=is_flag, arrival=delay, start=delay, payload=name)
        return self._inputs[name]

    def _check_name(self, name):
        if not name.isidentifier():
            raise ValueError(f"Name of an input or output must be an identifier, not {name!r}")
        if name in self._inputs or name in self._outputs:
            raise ValueError(f"There is already an input or output named {name!r}")

    # Arithmetic

    def add(self, a, b):
        """a + b"""
        return self._node("add", a, b)

    def sub(self, a, b):
        """a - b"""
        return self._node("sub", a, b)

    def mul(self, a, b):
        """a * b"""
        return self._node("mul", a, b)

    def div(self, a, b):
        """a / b"""
        return self._node("div", a, b)

    def reciprocal(self, a):
        """1 / a"""
        return self._node("rec", a)

    def sqrt(self, a):
        """√a, +0 below zero"""
        return self._node("sqrt", a)

    def reciprocal_sqrt(self, a):
        """1 / √a, +0 below zero"""
        return self._node("rsqrt", a)

    def dot(self, a, b, c=None):
        """a·b + c of two vectors and a float, if there is one, rounded once"""
        return self._node("dot", *a, *b, *(() if c is None else (c,)))

    def neg(self, a):
        """-a, also of zero"""
        return self._node("neg", a)

    def abs(self, a):
        """|a|"""
        return self._node("abs", a)

    def min(self, a, b):
        """a if a < b, else b"""
        return self.select(self.lt(a, b), a, b)

    def max(self, a, b):
        """a if a > b, else b"""
        return self.select(self.gt(a, b), a, b)

    def select(self, flag, a, b):
        """a if flag, else b: both floats, or both flags"""
        return self._node("select", flag, a, b, flags=(True, a.is_flag, a.is_flag), is_flag=a.is_flag)

    def register(self, a):
        """a, from a register, where what makes it and what takes it are too much for one cycle"""
        return self._node("register", a, flags=a.is_flag, is_flag=a.is_flag)

    # Relations

    def lt(self, a, b):
        """a < b"""
        return self._relation("lt", a, b)

    def gt(self, a, b):
        """a > b"""
        return self._relation("gt", a, b)

    def eq(self, a, b):
        """a = b"""
        return self._relation("eq", a, b)

    def le(self, a, b):
        """a ≤ b"""
        return self.logical_not(self.gt(a, b))

    def ge(self, a, b):
        """a ≥ b"""
        return self.logical_not(self.lt(a, b))

    def is_zero(self, a):
        """a = 0, of either sign"""
        return self._node("is_zero", a, is_flag=True)

    def is_negative(self, a):
        """a < 0: the sign bit is set and a is not zero"""
        return self._node("is_negative", a, is_flag=True)

    def sign(self, a):
        """The sign bit, set for -0 too"""
        return self._node("sign", a, is_flag=True)

    def is_finite(self, a):
        """|a| < ∞"""
        return self._node("is_finite", a, is_flag=True)

    def is_at_most_one(self, a):
        """a ≤ 1: a matter of the exponent, which takes no comparator"""
        return self._node("is_at_most_one", a, is_flag=True)

    # Powers of two, which bound errors: floats with no sign and no fraction

    def power(self, a):
        """2^⌊log₂|a|⌋: a's exponent; 0 of 0, ∞ of ∞"""
        return self._node("power", a)

    def power_max(self, a, b):
        """The greater of two powers"""
        return self._node("power_max", a, b)

    def power_mul(self, a, b):
        """a·b of two powers; 0·∞ = 0"""
        return self._node("power_mul", a, b)

    def power_div(self, a, b):
        """a/b of two powers; 0/0 = ∞/∞ = 0"""
        return self._node("power_div", a, b)

    def raised(self, a, power):
        """a and ``power``·2^frac_width units in the last place more, away from 0: an addition of bits

        Beyond its binade the units are those of the next; a power below a unit, or of 1 and more, changes nothing.
        """
        return self._node("raised", a, power)

    def is_within(self, a, power):
        """|a| < power, a matter of the exponents; false of ∞"""
        return self._node("is_within", a, power, is_flag=True)

    def is_at_most_one_plus(self, a, power):
        """a ≤ 1 or a < 1 + min(power, 1), which takes no adder"""
        return self._node("is_at_most_one_plus", a, power, is_flag=True)

    def logical_and(self, *flags):
        """Whether all ``flags`` are set"""
        return self._node("and", *flags, flags=True, is_flag=True)

    def logical_or(self, *flags):
        """Whether any of ``flags`` is set"""
        return self._node("or", *flags, flags=True, is_flag=True)

    def logical_not(self, flag):
        """Whether ``flag`` is not set"""
        return flag.operands[0] if flag.op == "not" else self._node("not", flag, flags=True, is_flag=True)

    def _relation(self, relation, a, b):
        if ("compare", (b, a)) in self._nodes:
            a, b, relation = b, a, {"lt": "gt", "gt": "lt", "eq": "eq"}[relation]
        return self._node(relation, self._node("compare", a, b), flags=None, is_flag=True)

    def _node(self, op, *operands, flags=False, is_flag=False):
        if flags is not None:
            expected = flags if isinstance(flags, tuple) else (flags,) * len(operands)
            for operand, wants_flag in zip(operands, expected, strict=True):
                if operand.is_flag != wants_flag:
                    raise TypeError(f"Operand of {op!r} must be a {'flag' if wants_flag else 'float'}")
        if (op, operands) not in self._nodes:
            start = max((operand.arrival or 0 for operand in operands), default=0)
            constant = all(operand.arrival is None for operand in operands)
            latency = self.latency_of_operator(op)
            arrival = None if constant and not latency else start + latency
            self._nodes[op, operands] = Node(op, operands, is_flag, arrival, start)
        return self._nodes[op, operands]

    def latency_of_operator(self, op):
        """Cycles that the nodes whose operation is ``op`` take."""
        return self._latencies.get(op, 0)

    # What is known of it

    @property
    def input_names(self):
        """Names of the inputs, in the order of their declaration."""
        return tuple(self._inputs)

    @property
    def output_names(self):
        """Names of the outputs, in the order of their declaration."""
        return tuple(self._outputs)

    @property
    def inputs(self):
        """Nodes of the inputs by name."""
        return dict(self._inputs)

    @property
    def outputs(self):
        """Nodes of the outputs by name."""
        return {name: output.node for name, output in self._outputs.items()}

    @property
    def latency(self):
        """Cycles from the inputs without delay to the outputs that are not early."""
        return max((self.arrival(output.node) for output in self._outputs.values()), default=0)

    def arrival(self, node):
        """Cycles from the inputs without delay to ``node``."""
        return node.arrival or 0

    def latency_of(self, name):
        """Cycles from the inputs without delay to the output ``name``."""
        output = self._outputs[name]
        return self.arrival(output.node) if output.early else self.latency

    @property
    def nodes(self):
        """All nodes that the outputs need, operands first."""
        found = {}
        pending = [(output.node, False) for output in reversed(self._outputs.values())]
        while pending:
            node, operands_found = pending.pop()
            if operands_found:
                found[node] = None
            elif node not in found:
                pending.append((node, True))
                pending.extend((operand, False) for operand in reversed(node.operands))
        return tuple(found)
