"""Hardware of a datapath."""

from collections import defaultdict
from itertools import pairwise

from amaranth.hdl import Cat, Module, Mux, Signal, Value
from amaranth.lib import wiring
from amaranth.lib.wiring import In, Out

from .delay import Delay
from .power import POWER_LOGIC, POWER_OPERANDS

__all__ = ["Circuit"]


#: What a node is in terms of its operands, where that takes no operator.
_LOGIC = {
    "register": lambda a: a,
    "neg": lambda a: Cat(a.frac, a.exp, ~a.sign),
    "abs": lambda a: Cat(a.frac, a.exp),
    "is_zero": lambda a: a.exp == 0,
    "is_negative": lambda a: a.sign & a.exp.any(),
    "sign": lambda a: a.sign,
    "is_finite": lambda a: a.exp != a.shape().exp_inf,
    "is_at_most_one": lambda a: a.sign | (a.exp < a.shape().bias) | (a.exp == a.shape().bias) & ~a.frac.any(),
    "lt": lambda order: order[0],
    "eq": lambda order: order[1],
    "gt": lambda order: order[2],
    "and": lambda *flags: Cat(flags).all(),
    "or": lambda *flags: Cat(flags).any(),
    "not": lambda flag: ~flag,
    "select": lambda flag, a, b: Mux(flag, Value.cast(a), Value.cast(b)),
    **POWER_LOGIC,
}


class Circuit(wiring.Component):
    """Outputs of a :class:`~fpu.datapath.Datapath`, ``latency`` cycles after its inputs, one result a clock.

    Parameters
    ----------
    datapath : Datapath
        What to build.

    Members
    -------
    one for each input : In(fmt) or In(1)
        Operands.
    one for each output : Out(fmt) or Out(1)
        Results.

    Attributes
    ----------
    latency : int
        Cycles from the inputs without delay to the outputs that are not early.
    """

    def __init__(self, datapath):
        self.datapath = datapath
        self.latency = datapath.latency
        super().__init__(
            {name: In(self._shape(node)) for name, node in datapath.inputs.items()} |
            {name: Out(self._shape(node)) for name, node in datapath.outputs.items()})

    def latency_of(self, name):
        """Cycles from the inputs without delay to the output ``name``."""
        return self.datapath.latency_of(name)

    def _shape(self, node):
        if node.op == "compare":
            return 3
        return 1 if node.is_flag else self.datapath.fmt

    def elaborate(self, platform):
        m = Module()
        datapath = self.datapath
        outputs = datapath.outputs

        needed = defaultdict(set)
        for node in datapath.nodes:
            for operand in node.operands:
                needed[operand].add(node.start)
        for name, node in outputs.items():
            needed[node].add(datapath.latency_of(name))

        signals = {}
        for index, node in enumerate(datapath.nodes):
            operands = [signals[operand, node.start] for operand in node.operands]
            value = self._build(m, node, operands, name=f"{node.op}_{index}")
            # One line of delays with taps serves all users of the node; a constant needs none.
            times = sorted({node.arrival, *needed[node]}) if node.arrival is not None else []
            signals |= {(node, time): value for time in needed[node] if node.arrival is None}
            signals |= {(node, time): value for time in times[:1]}
            for earlier, later in pairwise(times):
                m.submodules[f"{node.op}_{index}_to_{later}"] = delay = Delay(
                    self._shape(node), cycles=later - earlier)
                m.d.comb += delay.i.eq(signals[node, earlier])
                signals[node, later] = delay.o

        for name, node in outputs.items():
            m.d.comb += getattr(self, name).eq(signals[node, datapath.latency_of(name)])
        return m

    @staticmethod
    def _ports(node, unit):
        """What takes the operands of a node."""
        if node.op == "dot":
            return [*unit.a, *unit.b, *([unit.c] if unit.has_addend else [])]
        return [unit.a, unit.b] if len(node.operands) == 2 else [unit.a]

    @staticmethod
    def _delayed(m, name, value, *, cycles):
        m.submodules[name] = delay = Delay(value.shape(), cycles=cycles)
        m.d.comb += delay.i.eq(value)
        return delay.o

    def _build(self, m, node, operands, *, name):
        if node.op == "input":
            return getattr(self, node.payload)
        signal = Signal(self._shape(node), name=name)
        if node.op == "const":
            m.d.comb += signal.eq(self.datapath.fmt.const(node.payload))
        elif node.op in _LOGIC:
            cycles = 0 if node.arrival is None else node.arrival - node.start
            if node.op in POWER_OPERANDS:
                operands = POWER_OPERANDS[node.op](*operands)
            if cycles > 1:
                operands = [self._delayed(m, f"{name}_operand_{number}", operand, cycles=cycles - 1)
                            for number, operand in enumerate(operands)]
            value = _LOGIC[node.op](*operands)
            if cycles:
                m.submodules[name] = delay = Delay(self._shape(node), cycles=1)
                m.d.comb += Value.cast(delay.i).eq(value)
                value = delay.o
            m.d.comb += Value.cast(signal).eq(value)
        else:
            m.submodules[name] = unit = self.datapath.operator(node)
            m.d.comb += [port.eq(operand) for port, operand in zip(self._ports(node, unit), operands, strict=True)]
            m.d.comb += signal.eq(Cat(unit.lt, unit.eq, unit.gt) if node.op == "compare" else unit.r)
        return signal
