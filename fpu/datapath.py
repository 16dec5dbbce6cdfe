"""Float arithmetic written once: a graph that gives hardware, bit-exact software and cost."""

from collections import Counter
from functools import cached_property
from inspect import signature

import numpy as np

from .adder import Adder, Subtractor
from .circuit import Circuit
from .comparator import Comparator
from .depth import cheapest_latency
from .divider import Divider
from .dot_product import DotProduct
from .graph import Graph
from .kernel import compile_kernel
from .multiplier import Multiplier
from .power import POWER_EMULATIONS
from .reciprocal import Reciprocal
from .reciprocal_square_root import ReciprocalSquareRoot
from .rounding import Rounding
from .square_root import SquareRoot

__all__ = ["Datapath"]


#: Operators that the graph instantiates, by node operation, and the name under which they are counted and timed.
OPERATORS = {"add": Adder, "sub": Subtractor, "mul": Multiplier, "div": Divider, "compare": Comparator,
             "rec": Reciprocal, "sqrt": SquareRoot, "rsqrt": ReciprocalSquareRoot, "dot": DotProduct}
COUNTED_AS = {op: {"sub": "add", "compare": "cmp"}.get(op, op) for op in OPERATORS}


class Datapath(Graph):
    """Float arithmetic as a graph, built by calling one method of :class:`~fpu.graph.Graph` for each operation.

    Nothing is built or counted twice, and what no output needs is not built.

    Parameters
    ----------
    fmt : FloatFormat
        Format of all floats.
    latencies : dict from str to int
        Latency of ``"add"`` (also subtraction), ``"mul"``, ``"div"``, ``"cmp"``, ``"rec"``, ``"sqrt"``, ``"rsqrt"``,
        ``"dot"``, ``"select"``, ``"register"`` and ``"power"`` (arithmetic on powers), in cycles. Missing ones are the
        operators' own defaults, or what ``clock_mhz`` asks for; none for ``"select"``, 1 for ``"register"`` and
        ``"power"``, of which ``raised`` has twice as many.
    rounding : Rounding
        How all results are rounded, where there is a choice.
    operators : dict from str to type
        Other classes for some of the operations, such as ``{"div": TableDivider}``.
    guard_width : int or None
        Of dot products, see :class:`~fpu.dot_product.DotProduct`.
    clock_mhz : float or None
        Clock that each operator alone is to reach on an ECP5 of grade 6: latencies that are not given are the cheapest
        of those that do, as measured (see :func:`~fpu.depth.cheapest_latency`).

    Raises
    ------
    ValueError
        If an operator is unknown or not there in the format, none of its depths reaches ``clock_mhz``, or a name is not
        an identifier or used twice.
    TypeError
        If a float is given where a flag is expected, or the other way round.
    """

    def __init__(self, fmt, *, latencies=None, rounding=Rounding.NEAREST_EVEN, operators=None, guard_width=None,
                 clock_mhz=None):
        latencies, operators = dict(latencies or {}), dict(operators or {})
        known = {*COUNTED_AS.values(), "select", "register", "power"}
        if not latencies.keys() <= known:
            raise ValueError(f"Latencies may be given for {', '.join(sorted(known))}, "
                             f"not for {', '.join(sorted(latencies.keys() - known))}")
        if not operators.keys() <= OPERATORS.keys():
            raise ValueError(f"Operators may be given for {', '.join(sorted(OPERATORS))}, "
                             f"not for {', '.join(sorted(operators.keys() - OPERATORS.keys()))}")
        self.rounding = Rounding(rounding)
        self.guard_width = guard_width
        self.clock_mhz = clock_mhz
        self._operators = OPERATORS | operators
        of_powers = dict.fromkeys(("power_max", "power_mul", "power_div"), latencies.get("power", 1))
        # An addition, which has registers in front of it too.
        of_powers["raised"] = 2 * latencies.get("power", 1)
        super().__init__(fmt, latencies={"select": latencies.get("select", 0),
                                         "register": latencies.get("register", 1), **of_powers})
        self._given = latencies

    def latency_of_operator(self, op):
        """Cycles that the nodes whose operation is ``op`` take."""
        if op not in self._operators:
            return super().latency_of_operator(op)
        if op not in self._latencies:
            given = self._given.get(COUNTED_AS[op])
            if given is None and self.clock_mhz is None:
                given = self._operators[op].default_latency(self.fmt)
            elif given is None:
                given = cheapest_latency(self._operators[op], self.fmt, clock_mhz=self.clock_mhz)
            self._latencies[op] = given
        return self._latencies[op]

    def operator(self, node):
        """New component for a node that takes one."""
        cls, parameters = self._operators[node.op], {}
        if "rounding" in signature(cls).parameters:
            parameters["rounding"] = self.rounding
        if node.op == "dot":
            parameters |= {"guard_width": self.guard_width, "has_addend": len(node.operands) == 7}
        return cls(self.fmt, latency=self.latency_of_operator(node.op), **parameters)

    def emulation(self, op):
        """Compiled function for the nodes whose operation is ``op``, if it takes one."""
        if op in POWER_EMULATIONS:
            return POWER_EMULATIONS[op]
        emulations = getattr(self._operators.get(op), "emulation", {})
        # What cannot be told how to round rounds to nearest even.
        return emulations.get(self.rounding, emulations.get(Rounding.NEAREST_EVEN))

    def cost(self):
        """Numbers of ``"add"`` (with subtractors), ``"mul"``, ``"div"`` and ``"cmp"``, and of the other operators that
        there are; all else is wires and tables."""
        counts = Counter(COUNTED_AS.get(node.op) for node in self.nodes)
        always = "add", "mul", "div", "cmp"
        return {name: counts[name] for name in dict.fromkeys(COUNTED_AS.values()) if name in always or counts[name]}

    def component(self):
        """Pipelined hardware: see :class:`~fpu.circuit.Circuit`."""
        return Circuit(self)

    def kernel(self):
        """Compiled ``kernel(params, *inputs)``: the outputs as a tuple, in the order of their declaration.

        To be called with ``fmt.params``, floats that are members of the format, and booleans. Other compiled code can
        call it; such code must not itself be kept in numba's cache, which would not notice that the graph changed.
        """
        return self._compiled.kernel

    def model(self, **inputs):
        """Outputs by name, as arrays of float64 or bool, of arrays that are broadcast against each other.

        Raises
        ------
        TypeError
            If an input is missing or unknown.
        ValueError
            If a float is not a member of the format.
        """
        if inputs.keys() != self._inputs.keys():
            raise TypeError(f"Inputs must be {', '.join(self._inputs)}, not {', '.join(inputs)}")
        arrays = []
        for name, node in self._inputs.items():
            array = np.asarray(inputs[name], dtype=np.bool_ if node.is_flag else np.float64)
            if not node.is_flag and (self.fmt.quantize(array) != array).any():
                raise ValueError(f"Input {name!r} has values that are not members of float format {self.fmt}")
            arrays.append(array)
        arrays = np.broadcast_arrays(*arrays)
        shape = arrays[0].shape if arrays else ()
        results = [np.empty(shape, np.bool_ if node.is_flag else np.float64) for node in self.outputs.values()]
        self._compiled.sweep(self.fmt.params, *(np.ravel(array) for array in arrays),
                             *(np.reshape(result, -1) for result in results))
        return dict(zip(self._outputs, results, strict=True))

    @cached_property
    def _compiled(self):
        return compile_kernel(self)
