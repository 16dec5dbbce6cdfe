"""Product of significands, in one multiplier block where there is one."""

from amaranth.hdl import ClockSignal, Const, Instance, Module, Signal
from amaranth.lib import wiring
from amaranth.lib.wiring import In, Out

__all__ = ["Product"]


class Product(wiring.Component):
    """p(t) = a(t - cycles) * b(t - cycles), unsigned.

    Toolchains infer the block from the multiplication, but those for ECP5 leave its registers unused, and then the way
    into and out of it limits the clock to 140 MHz. There the block is instantiated, with its output register.

    Parameters
    ----------
    width : int
        Bits of an operand.
    cycles : int
        Registers after the product.

    Members
    -------
    a, b : In(width)
        Operands.
    p : Out(2 * width)
        Product.
    """

    _BLOCK_WIDTH = 18

    def __init__(self, width, *, cycles):
        self.width = width
        self.cycles = cycles
        super().__init__({"a": In(width), "b": In(width), "p": Out(2 * width)})

    def elaborate(self, platform):
        m = Module()
        product, cycles = Signal.like(self.p), self.cycles
        is_ecp5 = getattr(platform, "device", "").startswith("LFE5")
        if is_ecp5 and self.width <= self._BLOCK_WIDTH and cycles:
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
            ports |= {f"i_{name}{bit}": value[bit] if bit < len(value) else Const(0)
                      for bit in range(self._BLOCK_WIDTH)}
        ports |= {f"o_P{bit}": product[bit] for bit in range(len(product))}
        return Instance(
            "MULT18X18D", p_REG_OUTPUT_CLK="CLK0", p_REG_OUTPUT_CE="CE0", p_REG_OUTPUT_RST="RST0",
            i_CLK0=ClockSignal(), i_CE0=Const(1), i_RST0=Const(0),
            i_SIGNEDA=Const(0), i_SIGNEDB=Const(0), i_SOURCEA=Const(0), i_SOURCEB=Const(0), **ports)
