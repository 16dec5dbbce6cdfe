"""What the shader asks of others, and their answers on the way to the registers."""

from amaranth.hdl import Module, Mux, Signal
from amaranth.lib import data, stream, wiring
from amaranth.lib.wiring import In, Out

from .instruction_fetch import ray_token_layout
from .microcode import lane_width

__all__ = ["Unpack", "shader_shapes", "tag_layout"]


def tag_layout(ray_token):
    """What travels with a request of a ray: where its answer goes."""
    return data.StructLayout({"token": ray_token, "dst": 5, "mask": 3})


def shader_shapes(*, fmt, num_threads, index_width, program, ray_stack_depth):
    """Shapes of what a shader sends away and gets back: its ``tag``, and requests for records and texels."""
    token = ray_token_layout(num_threads=num_threads, program=program, stack_depth=ray_stack_depth)
    tag = tag_layout(token)
    texel = {"s": fmt, "t": fmt, "base": 24, "log2_width": 4, "log2_height": 4, "filtered": 1, "folded": 1}
    return {
        "tag": tag,
        "load": data.StructLayout({"index": index_width, "payload": tag}),
        "loaded": data.StructLayout({"item": 12 * lane_width(fmt), "payload": tag}),
        "texture": data.StructLayout({**texel, "payload": tag}),
        "texel": data.StructLayout({"color": data.ArrayLayout(17, 3), "opacity": 17, "payload": tag}),
    }


class Unpack(wiring.Component):
    """Writes the registers of an answer one after the other, and then is ready for the next.

    Parameters
    ----------
    answer : shape-like
        Shape of an answer, whose ``payload`` is a tag.
    registers : callable
        The registers that an answer goes to, as values, the one with the tag's number first.
    num_registers : int
        How many there are.
    result : StructLayout
        See :func:`~rtl.results.result_layout`.

    Members
    -------
    answer, result : streams of answers and results
    """

    def __init__(self, answer, registers, *, num_registers, result):
        self._registers = registers
        self._num_registers = num_registers
        super().__init__({"answer": In(stream.Signature(answer)), "result": Out(stream.Signature(result))})

    def elaborate(self, platform):
        m = Module()
        number = Signal(range(self._num_registers))
        tag, result = self.answer.payload.payload, self.result.payload
        last = Signal()
        m.d.comb += [
            last.eq(number == self._num_registers - 1),
            self.result.valid.eq(self.answer.valid),
            result.token.eq(tag.token),
            result.last.eq(last),
            result.dst.eq(tag.dst + number),
            result.mask.eq(tag.mask),
            self.answer.ready.eq(self.result.ready & last),
        ]
        with m.Switch(number):
            for place, value in enumerate(self._registers(self.answer.payload)):
                with m.Case(place):
                    m.d.comb += result.value.eq(value)
        with m.If(self.result.valid & self.result.ready):
            m.d.sync += number.eq(Mux(last, 0, number + 1))
        return m
