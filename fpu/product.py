"""Products of unsigned numbers, in multiplier blocks where there are such."""

from types import SimpleNamespace

from amaranth.hdl import Cat, ClockSignal, Const, Instance, Module, Signal, Value
from amaranth.lib import wiring
from amaranth.lib.wiring import In, Out

from .chain import ChainBit, carry_chain
from .pipeline import carry_delay

__all__ = ["Product", "multiply_exactly", "product_delays"]

_BLOCK_WIDTH = 18
_BLOCK_DELAY = 4.5


class Product(wiring.Component):
    """p(t) = a(t - cycles) * b(t - cycles), unsigned.

    Toolchains infer the block from the multiplication, but those for ECP5 leave its registers unused, and then the way
    into and out of it limits the clock to 140 MHz. There the block is instantiated, with its output register.

    Parameters
    ----------
    a_width, b_width : int
        Bits of the operands.
    cycles : int
        Registers after the product.

    Members
    -------
    a : In(a_width)
    b : In(b_width)
        Operands.
    p : Out(a_width + b_width)
        Product.
    """

    def __init__(self, a_width, b_width, *, cycles):
        self.cycles = cycles
        super().__init__({"a": In(a_width), "b": In(b_width), "p": Out(a_width + b_width)})

    def elaborate(self, platform):
        m = Module()
        product, cycles = Signal.like(self.p), self.cycles
        is_ecp5 = getattr(platform, "device", "").startswith("LFE5")
        if is_ecp5 and max(len(self.a), len(self.b)) <= _BLOCK_WIDTH and cycles:
            m.submodules.block = self._block(product)
            cycles -= 1
        else:
            m.d.comb += product.eq(self.a * self.b)
        for _ in range(cycles):
            following = Signal.like(product, name="registered", reset_less=True)
            m.d.sync += following.eq(product)
            product = following
        m.d.comb += self.p.eq(product)
        return m

    def _block(self, product):
        ports = {}
        for name, value in (("A", self.a), ("B", self.b), ("C", Const(0, 1))):
            ports |= {f"i_{name}{bit}": value[bit] if bit < len(value) else Const(0) for bit in range(_BLOCK_WIDTH)}
        ports |= {f"o_P{bit}": product[bit] for bit in range(len(product))}
        return Instance(
            "MULT18X18D", p_REG_OUTPUT_CLK="CLK0", p_REG_OUTPUT_CE="CE0", p_REG_OUTPUT_RST="RST0",
            i_CLK0=ClockSignal(), i_CE0=Const(1), i_RST0=Const(0),
            i_SIGNEDA=Const(0), i_SIGNEDB=Const(0), i_SOURCEA=Const(0), i_SOURCEB=Const(0), **ports)


def product_delays(name, a_width, b_width):
    """Delays of the steps of :func:`multiply_exactly`."""
    if max(a_width, b_width) <= _BLOCK_WIDTH:
        return {name: _BLOCK_DELAY}
    return {name: _BLOCK_DELAY, f"{name}_cross": carry_delay(max(a_width, b_width) + 1),
            f"{name}_sum": carry_delay(a_width + b_width - _BLOCK_WIDTH)}


def multiply_exactly(m, step, name, *pairs, **carried):
    """What is ``carried`` through the steps of :func:`product_delays`, and with it ``products``, one for each pair.

    One block for operands of up to 18 bits, up to four for up to 36. All pairs are of the same widths.
    """
    partial = []
    for index, (a, b) in enumerate(pairs):
        parts = [[value[:_BLOCK_WIDTH], value[_BLOCK_WIDTH:]] for value in (Value.cast(a), Value.cast(b))]
        partial.append({})
        for i, a_part in enumerate(parts[0]):
            for j, b_part in enumerate(parts[1]):
                if len(a_part) and len(b_part):
                    product = Product(len(a_part), len(b_part), cycles=step.registers_of_next(1))
                    m.submodules[f"{name}_{index}_{i}{j}"] = product
                    m.d.comb += [product.a.eq(a_part), product.b.eq(b_part)]
                    partial[-1][i, j] = product.p
    s = step(name, **carried)
    if len(partial[0]) == 1:
        return SimpleNamespace(**vars(s), products=[parts[0, 0] for parts in partial])

    # The outer products stand side by side, the inner ones overlap both.
    sums = {}
    for index, parts in enumerate(partial):
        inner = [parts.get(key, Const(0, 1)) for key in ((0, 1), (1, 0))]
        width = max(map(len, inner)) + 1
        inner = [Cat(value, Const(0, width - len(value))) for value in inner]
        sums[f"outer{index}"] = Cat(parts[0, 0], parts.get((1, 1), Const(0, 0)))
        sums[f"cross{index}"] = carry_chain(m, f"{name}_{index}_cross", (ChainBit.ADD, *inner, 0))
    s = step(f"{name}_cross", s, **sums)
    width = sum(len(Value.cast(value)) for value in pairs[0]) - _BLOCK_WIDTH
    products = {}
    for index in range(len(pairs)):
        outer, cross = getattr(s, f"outer{index}"), getattr(s, f"cross{index}")
        upper = carry_chain(m, f"{name}_{index}_sum", (
            ChainBit.ADD, *(Cat(value, Const(0, width))[:width] for value in (outer[_BLOCK_WIDTH:], cross)), 0))
        products[f"product{index}"] = Cat(outer[:_BLOCK_WIDTH], upper)
    s = step(f"{name}_sum", **{field: getattr(s, field) for field in carried}, **products)
    return SimpleNamespace(**{field: getattr(s, field) for field in carried},
                           products=[getattr(s, field) for field in products])
