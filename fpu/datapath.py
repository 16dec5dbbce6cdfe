"""Float arithmetic written once: a graph that gives hardware, bit-exact software and cost."""

from collections import Counter
from functools import cached_property

import numpy as np

from .adder import Adder, Subtractor
from .circuit import Circuit
from .comparator import Comparator
from .divider import Divider
from .graph import Graph
from .kernel import compile_kernel
from .multiplier import Multiplier
from .rounding import Rounding

__all__ = ["Datapath"]


#: Operators that the graph instantiates, by node operation, and the name under which they are counted and timed.
OPERATORS = {"add": Adder, "sub": Subtractor, "mul": Multiplier, "div": Divider, "compare": Comparator}
COUNTED_AS = {"add": "add", "sub": "add", "mul": "mul", "div": "div", "compare": "cmp"}


class Datapath(Graph):
    """Float arithmetic as a graph, built by calling one method of :class:`~fpu.graph.Graph` for each operation.

    Nothing is built or counted twice, and what no output needs is not built.

    Parameters
    ----------
    fmt : FloatFormat
        Format of all floats.
    latencies : dict from str to int
        Latency of ``"add"`` (also subtraction), ``"mul"``, ``"div"``, ``"cmp"`` and ``"select"``, in cycles. Missing
        ones are the operators' own defaults, none for ``"select"``.
    rounding : Rounding
        How all results are rounded.

    Raises
    ------
    ValueError
        If an operator is unknown, or a name is not an identifier or used twice.
    TypeError
        If a float is given where a flag is expected, or the other way round.
    """

    def __init__(self, fmt, *, latencies=None, rounding=Rounding.NEAREST_EVEN):
        latencies = dict(latencies or {})
        known = {*COUNTED_AS.values(), "select"}
        if not latencies.keys() <= known:
            raise ValueError(f"Latencies may be given for {', '.join(sorted(known))}, "
                             f"not for {', '.join(sorted(latencies.keys() - known))}")
        self.rounding = Rounding(rounding)
        super().__init__(fmt, latencies={"select": latencies.get("select", 0)} | {
            op: latencies.get(name, OPERATORS[op].default_latency(fmt)) for op, name in COUNTED_AS.items()})

    def operator(self, op):
        """New component for the nodes whose operation is ``op``."""
        rounding = {} if op == "compare" else {"rounding": self.rounding}
        return OPERATORS[op](self.fmt, latency=self._latencies[op], **rounding)

    def emulation(self, op):
        """Compiled function for the nodes whose operation is ``op``, if it takes one."""
        return getattr(OPERATORS.get(op), "emulation", {}).get(self.rounding)

    def cost(self):
        """Numbers of ``"add"`` (with subtractors), ``"mul"``, ``"div"`` and ``"cmp"``; all else is wires and tables."""
        counts = Counter(COUNTED_AS.get(node.op) for node in self.nodes)
        return {name: counts[name] for name in dict.fromkeys(COUNTED_AS.values())}

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
