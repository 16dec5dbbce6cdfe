"""What the shader computes besides products of vectors: colours, roots, offsets."""

from amaranth.hdl import Cat, Const, Module, Mux, Signal
from amaranth.lib import data, wiring
from amaranth.lib.wiring import In, Out

from fpu import Delay, FloatToInt, reciprocal_square_root_for
from fpu.depth import cheapest_latency
from fpu.product import Product
from fpu.rom import Rom

from .microcode import COLOR_FRAC_BITS, Op, lane_width
from .srgb import COLOR_ONE, linear_colors

__all__ = ["COLOR_WIDTH", "ColorUnit", "byte_fraction"]

#: Bits of a colour.
COLOR_WIDTH = 24

_CLOCK_MHZ = 125
# Of each operation until its result goes into a register with those that came before.
_LATENCIES = {Op.MOVE: 0, Op.BYTES: 0, Op.COLOR_ADD: 1, Op.COLOR_SUBTRACT: 1, Op.COLOR_MULTIPLY: 2, Op.DECODE: 2,
              Op.CUT: 3, Op.OFFSET: 3}
_FACTOR_WIDTH = COLOR_ONE.bit_length()


def byte_fraction(byte):
    """Colour nearest to byte/255."""
    # Not times 257: synthesis would take a multiplier block.
    return (byte << 8 | byte) + (byte >> 7)


class ColorUnit(wiring.Component):
    """The operations of :class:`~rtl.microcode.Op` from ``ROOT`` to ``MOVE``, one a clock, all of one ``latency``.

    In symbols, with colours as integers in units of 2^-16, ⊤ = 2^24 - 1 the largest, and n₂, n₁, n₀ the bytes of x[0]::

        ROOT             r[k] = 1 / √x[0], by table, or by digits above 16 fraction bits
        CUT              r[k] = min(max(⌊2^16 x[k]⌋, 0), ⊤)
        COLOR_MULTIPLY   r[k] = min((a[k] x[k] + 2^15) >> 16, ⊤), of x[k] the lowest 17 bits
        COLOR_ADD        r[k] = min(a[k] + x[k], ⊤)
        COLOR_SUBTRACT   r[k] = max(a[k] - x[k], 0)
        DECODE           r[k] = linear_colors()[n₂₋ₖ]
        BYTES            r[k] = rint(2^16 n₂₋ₖ / 255)
        OFFSET           r[k] = 2^(offset_log2 - frac_width) 2^⌊log₂ max(|a[0]|…|x[2]|)⌋, or +0 below the format
        MOVE             r[k] = x[k]

    Of lanes wider than a colour or a float the bits above are not looked at, and are 0 in results. Operations join one
    pipeline as soon as they are ready, so short ones take no registers of their own to wait for long ones.

    Parameters
    ----------
    fmt : :class:`~fpu.FloatFormat`
        Format of floats.
    offset_log2 : int
        Binary logarithm of ``OFFSET``'s units in the last place, 0 to ``frac_width``.
    operations : iterable of :class:`~rtl.microcode.Op`
        Those that are built; the result of another is undefined.
    latencies : dict or None
        ``"rsqrt"`` is the latency of the root; by default the cheapest for 125 MHz.

    Members
    -------
    op : what to do
    a, x : operands, three lanes; x selected and negated already
    r : result, three lanes

    Attributes
    ----------
    latency : int
        Cycles from operands to result.

    Raises
    ------
    ValueError
        If ``offset_log2`` is out of range, an operation is not one of these or there is none.
    """

    def __init__(self, *, fmt, offset_log2=3, operations=(*_LATENCIES, Op.ROOT), latencies=None):
        if not 0 <= offset_log2 <= fmt.frac_width:
            raise ValueError(f"offset_log2 must be between 0 and {fmt.frac_width}, not {offset_log2!r}")
        operations = frozenset(operations)
        if not operations or not operations <= {*_LATENCIES, Op.ROOT}:
            raise ValueError("operations must be some of "
                             f"{', '.join(op.name for op in Op if op in _LATENCIES or op is Op.ROOT)}, not "
                             f"{', '.join(op.name for op in Op if op in operations) or 'none'}")
        self._fmt = fmt
        self._offset_log2 = offset_log2
        self._latencies = {op: cycles for op, cycles in _LATENCIES.items() if op in operations}
        if Op.ROOT in operations:
            given = (latencies or {}).get("rsqrt")
            self._latencies[Op.ROOT] = given if given is not None else \
                cheapest_latency(reciprocal_square_root_for(fmt), fmt, clock_mhz=_CLOCK_MHZ)
        self.latency = max(self._latencies.values()) + 1
        self._lanes = data.ArrayLayout(lane_width(fmt), 3)
        super().__init__({"op": In(Op), "a": In(self._lanes), "x": In(self._lanes), "r": Out(self._lanes)})

    def _float(self, lane):
        return self._fmt(lane[:self._fmt.width])

    def _bytes(self):
        """Bytes of x[0], the most significant first."""
        return [self.x[0][place:place + 8] for place in (16, 8, 0)]

    def _root(self, m):
        m.submodules.root = root = reciprocal_square_root_for(self._fmt)(self._fmt, latency=self._latencies[Op.ROOT])
        m.d.comb += root.a.eq(self._float(self.x[0]))
        return [root.r.as_value()] * 3

    def _cut(self, m):
        results = []
        for number, lane in enumerate(self.x):
            m.submodules[f"cut{number}"] = cut = FloatToInt(
                self._fmt, int_width=COLOR_WIDTH, signed=False, num_frac_bits=COLOR_FRAC_BITS,
                latency=self._latencies[Op.CUT])
            m.d.comb += cut.a.eq(self._float(lane))
            results.append(cut.r)
        return results

    def _product(self, m):
        results = []
        for number, (a, x) in enumerate(zip(self.a, self.x, strict=True)):
            parts = a[:COLOR_FRAC_BITS], a[COLOR_FRAC_BITS:COLOR_WIDTH]
            products = []
            for name, part in zip(("lower", "upper"), parts, strict=True):
                m.submodules[f"{name}{number}"] = product = Product(len(part), _FACTOR_WIDTH, cycles=1)
                m.d.comb += [product.a.eq(part), product.b.eq(x[:_FACTOR_WIDTH])]
                products.append(product.p)
            lower, upper = products
            # Half a unit is the carry into the sum.
            total = Signal(COLOR_WIDTH + 2, name=f"product{number}")
            result = Signal(COLOR_WIDTH, name=f"multiplied{number}", reset_less=True)
            m.d.comb += total.eq(Cat(Const(1, 1), upper) + lower[COLOR_FRAC_BITS - 1:])
            m.d.sync += result.eq(total[1:-1] | total[-1].replicate(COLOR_WIDTH))
            results.append(result)
        return results

    def _sum(self, m):
        results = []
        subtracts, adds = Signal(), Signal()
        m.d.comb += [subtracts.eq(self.op == Op.COLOR_SUBTRACT), adds.eq(~subtracts)]
        for number, (a, x) in enumerate(zip(self.a, self.x, strict=True)):
            total = Signal(COLOR_WIDTH + 2, name=f"sum{number}")
            result = Signal(COLOR_WIDTH, name=f"summed{number}", reset_less=True)
            inverted = x[:COLOR_WIDTH] ^ subtracts.replicate(COLOR_WIDTH)
            m.d.comb += total.eq(Cat(Const(1, 1), a[:COLOR_WIDTH]) + Cat(subtracts, inverted))
            # A carry is too much in a sum; without one, a difference is negative.
            m.d.sync += result.eq(Mux(total[-1] ^ subtracts, adds.replicate(COLOR_WIDTH), total[1:-1]))
            results.append(result)
        return results

    def _decode(self, m):
        results = []
        for number, byte in enumerate(self._bytes()):
            m.submodules[f"linear{number}"] = linear = Rom(linear_colors(), width=_FACTOR_WIDTH,
                                                           cycles=self._latencies[Op.DECODE])
            m.d.comb += linear.address.eq(byte)
            results.append(linear.data)
        return results

    def _offset(self, m):
        def register(name, value):
            signal = Signal(self._fmt.exp_width, name=name, reset_less=True)
            m.d.sync += signal.eq(value)
            return signal

        pairs = [(self._float(a).exp, self._float(x).exp) for a, x in zip(self.a, self.x, strict=True)]
        a, b, c = (register(f"larger{number}", Mux(one > other, one, other))
                   for number, (one, other) in enumerate(pairs))
        largest = register("largest", Mux((a >= b) & (a >= c), a, Mux(b >= c, b, c)))
        lowered = self._fmt.frac_width - self._offset_log2
        exp = register("offset", Mux(largest > lowered, largest - lowered, 0))
        return [Cat(Const(0, self._fmt.frac_width), exp, Const(0, 1))] * 3

    def elaborate(self, platform):
        m = Module()
        operators = {
            Op.MOVE: lambda m: list(self.x), Op.BYTES: lambda m: [byte_fraction(byte) for byte in self._bytes()],
            Op.COLOR_MULTIPLY: self._product, Op.DECODE: self._decode, Op.CUT: self._cut, Op.OFFSET: self._offset,
            Op.ROOT: self._root}
        sums = {Op.COLOR_ADD, Op.COLOR_SUBTRACT} & self._latencies.keys()
        results = {op: operators[op](m) for op in operators if op in self._latencies}
        if sums:
            results |= dict.fromkeys(sums, self._sum(m))

        before, now = self.op, 0
        for cycle in sorted(set(self._latencies.values())):
            m.submodules[f"until{cycle}"] = until = Delay(before.shape(), cycles=cycle - now)
            joined = Signal(data.StructLayout({"op": Op, "lanes": self._lanes}), name=f"joined{cycle}", reset_less=True)
            is_first = not now
            op = until.o if is_first else until.o.op
            m.d.comb += until.i.eq(before)
            m.d.sync += joined.op.eq(op)
            if not is_first:
                m.d.sync += joined.lanes.eq(until.o.lanes)
            with m.Switch(op):
                for ready in Op:
                    if self._latencies.get(ready) == cycle:
                        with m.Case(ready):
                            m.d.sync += [lane.eq(result)
                                         for lane, result in zip(joined.lanes, results[ready], strict=True)]
            before, now = joined, cycle + 1
        m.d.comb += self.r.eq(before.lanes)
        return m
