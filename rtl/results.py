"""From the shader's units back to the registers."""

from amaranth.hdl import Cat, Const, Module, Signal
from amaranth.lib import data, stream, wiring
from amaranth.lib.wiring import In, Out

from .layout import vector_layout
from .microcode import lane_width
from .queue import merged

__all__ = ["WriteBack", "in_lanes", "result_layout"]


def result_layout(ray_token, lanes):
    """Lanes ``mask`` of register ``dst`` of a ray, with the last of which it is ready again."""
    return data.StructLayout({"token": ray_token, "last": 1, "dst": 5, "mask": 3, "value": lanes})


def in_lanes(fmt, *values):
    """A register with each of three values in a lane."""
    width = lane_width(fmt)
    return Cat(Cat(value, Const(0, width))[:width] for value in values)


class WriteBack(wiring.Component):
    """One result a clock: those of the transformation unit, which cannot wait, before others, these in turn.

    Parameters
    ----------
    fmt : :class:`~fpu.FloatFormat`
        Format of floats.
    num_inputs : int
        Streams of results.
    tag, result : StructLayout
        See :func:`~rtl.requests.tag_layout` and :func:`result_layout`.

    Members
    -------
    i : array of streams of results
    stepped : ``{"valid", "tag", "vector"}``, see :class:`~rtl.transformation.Transformation`
    o : ``{"valid", "result"}``: the result, a cycle later
    """

    def __init__(self, *, fmt, num_inputs, tag, result):
        self._fmt = fmt
        self._result = result
        super().__init__({
            "i": In(stream.Signature(result)).array(num_inputs),
            "stepped": In(data.StructLayout({"valid": 1, "tag": tag, "vector": vector_layout(fmt)})),
            "o": Out(data.StructLayout({"valid": 1, "result": result})),
        })

    def elaborate(self, platform):
        m = Module()
        taken = merged(m, "merge", [wiring.flipped(source) for source in self.i])
        result, valid = Signal(self._result, reset_less=True), Signal()
        m.d.comb += [taken.ready.eq(~self.stepped.valid), self.o.valid.eq(valid), self.o.result.eq(result)]
        m.d.sync += [result.eq(taken.payload), valid.eq(taken.valid | self.stepped.valid)]
        with m.If(self.stepped.valid):
            tag, vector = self.stepped.tag, self.stepped.vector
            m.d.sync += [result.token.eq(tag.token), result.last.eq(1), result.dst.eq(tag.dst),
                         result.mask.eq(tag.mask), result.value.eq(in_lanes(self._fmt, vector.x, vector.y, vector.z))]
        return m
