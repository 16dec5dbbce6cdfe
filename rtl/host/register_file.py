"""What a host sets in a chip, and reads of it."""

from amaranth.hdl import Array, Const, Module, Mux, Signal
from amaranth.lib import data, memory, wiring
from amaranth.lib.wiring import In, Out

__all__ = ["RegisterFile"]

#: Of the numbers of what can be read, those chosen among first
_GROUP_BITS = 4


class RegisterFile(wiring.Component):
    """Registers that can be set and read by their number, and values behind them that can only be read.

    Registers are written the cycle after they are set; a value comes two cycles after its number, one number a cycle.

    Parameters
    ----------
    num_registers, num_values : int
        How many there are, of 32 bits each.

    Members
    -------
    set : ``{"valid", "number", "word"}``: a register, and what it is to hold; beyond the registers there is none
    number : of what is to be read
    value : of the number, if there is one; what is set meanwhile may be missing
    registers : what has been set, zeros after reset
    values : behind the registers, what can be read
    """

    latency = 2

    def __init__(self, *, num_registers, num_values):
        self._num_registers = num_registers
        number = range(num_registers + num_values)
        super().__init__({
            "set": In(data.StructLayout({"valid": 1, "number": number, "word": 32})),
            "number": In(number),
            "value": Out(32),
            "registers": Out(data.ArrayLayout(32, num_registers)),
            "values": In(data.ArrayLayout(32, num_values)),
        })

    def elaborate(self, platform):
        m = Module()
        # What enables so many flip-flops comes from one.
        setting = Signal(self._num_registers)
        word, place = Signal(32, reset_less=True), Signal(range(self._num_registers), reset_less=True)
        written = Signal(self._num_registers)
        m.d.sync += [
            *(now.eq(self.set.valid & (self.set.number == each)) for each, now in enumerate(setting)),
            word.eq(self.set.word),
            place.eq(self.set.number),
            written.eq(written | setting),
        ]
        for register, now in zip(self.registers, setting, strict=True):
            with m.If(now):
                m.d.sync += register.eq(word)

        # They are read from a memory: to choose among them would take more tables than to keep them twice.
        m.submodules.copy = copy = memory.Memory(shape=32, depth=self._num_registers, init=[])
        write, read = copy.write_port(), copy.read_port(domain="comb")
        m.d.comb += [write.en.eq(setting.any()), write.addr.eq(place), write.data.eq(word),
                     read.addr.eq(self.number)]
        register, is_register = Signal(32, reset_less=True), Signal(reset_less=True)
        m.d.sync += [
            register.eq(Mux(written.bit_select(read.addr, 1), read.data, 0)),
            is_register.eq(self.number < self._num_registers),
        ]

        # One of sixteen, and which sixteen: together too much for one cycle.
        readable = [*(Const(0, 32) for _ in self.registers), *self.values]
        size = 1 << _GROUP_BITS
        groups = [readable[start:start + size] for start in range(0, len(readable), size)]
        rows = [Signal(32, name=f"row{each}", reset_less=True) for each in range(len(groups))]
        group = Signal(range(len(groups)), reset_less=True)
        m.d.sync += [
            *(row.eq(Array(each)[self.number[:_GROUP_BITS]]) for row, each in zip(rows, groups, strict=True)),
            group.eq(self.number[_GROUP_BITS:]),
            self.value.eq(Mux(is_register, register, Array(rows)[group])),
        ]
        return m
