"""The registers of all rays, and the constants."""

from amaranth.hdl import Array, Cat, Const, Module, Mux, Signal
from amaranth.lib import data, wiring
from amaranth.lib.wiring import In, Out
from amaranth.utils import exact_log2

from .block_memory import BlockMemory
from .layout import PACKET_RAYS, camera_layout, thread_slots, thread_width
from .microcode import NUM_REGISTERS, lane_width

__all__ = ["RegisterFile", "lanes_layout"]


def lanes_layout(fmt):
    """A register."""
    return data.ArrayLayout(lane_width(fmt), 3)


class RegisterFile(wiring.Component):
    """Reads two registers or constants a clock, two cycles later, and writes one.

    Each port has a copy of its own.

    Parameters
    ----------
    fmt : :class:`~fpu.FloatFormat`
        Format of floats.
    num_threads : int
        Threads, of four rays each.
    bank_bits : int
        Lowest bits of a thread's number that are the same for all threads here.
    literals : sequence
        Constants after the camera's, each three floats or integers.

    Members
    -------
    camera : the constants after the zero: three rows, then the origin
    read : array of two addresses ``{"valid", "thread", "ray", "number"}``
    value : array of two registers
    write : ``{"valid", "thread", "ray", "number", "mask", "value"}``
    """

    read_latency = 2

    def __init__(self, *, fmt, num_threads, literals, bank_bits=0):
        self._fmt = fmt
        self._literals = tuple(literals)
        self._lanes = lanes_layout(fmt)
        ray = {"thread": thread_width(num_threads), "ray": range(PACKET_RAYS)}
        self._bank_bits = bank_bits
        self._depth = NUM_REGISTERS * PACKET_RAYS * thread_slots(num_threads, bank_bits)
        address = data.StructLayout({"valid": 1, **ray, "number": range(2 * NUM_REGISTERS)})
        super().__init__({
            "camera": In(camera_layout(fmt)),
            "read": In(address).array(2),
            "value": Out(self._lanes).array(2),
            "write": In(data.StructLayout({"valid": 1, **ray, "number": range(NUM_REGISTERS), "mask": 3,
                                           "value": self._lanes})),
        })

    def _constants(self):
        """Values of the constants, lanes side by side."""
        width, fmt = lane_width(self._fmt), self._fmt
        constants = [Const(0, 3 * width)]
        for vector in (self.camera.rows[0], self.camera.rows[1], self.camera.rows[2], self.camera.origin):
            constants.append(Cat(Cat(getattr(vector, axis), Const(0, width - fmt.width)) for axis in "xyz"))
        for literal in self._literals:
            lanes = [int(fmt.encode(value)) if isinstance(value, float) else value for value in literal]
            constants.append(Const(sum(lane << width * place for place, lane in enumerate(lanes)), 3 * width))
        return Array(constants)

    def elaborate(self, platform):
        m = Module()
        width = lane_width(self._fmt)
        constants = self._constants()
        for port, (address, value) in enumerate(zip(self.read, self.value, strict=True)):
            number_bits = exact_log2(NUM_REGISTERS)
            constant = Signal(3 * width, name=f"constant{port}", reset_less=True)
            number = Signal(number_bits, name=f"number{port}", reset_less=True)
            is_constant = Signal(2, name=f"is_constant{port}", reset_less=True)
            m.d.sync += [number.eq(address.number[:number_bits]), constant.eq(constants[number]),
                         is_constant.eq(Cat(address.number[number_bits], is_constant[0]))]
            for lane in range(3):
                m.submodules[f"lane{port}_{lane}"] = bank = BlockMemory(width, depth=self._depth)
                m.d.comb += [
                    bank.write.valid.eq(self.write.valid & self.write.mask[lane]),
                    bank.write.address.eq(Cat(self.write.number, self.write.ray, self.write.thread[self._bank_bits:])),
                    bank.write.data.eq(self.write.value[lane]),
                    bank.reading.eq(address.valid),
                    bank.address.eq(Cat(address.number[:number_bits], address.ray, address.thread[self._bank_bits:])),
                    value[lane].eq(Mux(is_constant[1], constant.word_select(lane, width), bank.data)),
                ]
        return m
