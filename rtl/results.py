"""From the shader's units back to the registers."""

from amaranth.hdl import Cat, Const, Module, Mux, Signal
from amaranth.lib import data, stream, wiring
from amaranth.lib.wiring import In, Out

from .layout import vector_layout
from .least_recent import LeastRecent, selected
from .microcode import lane_width

__all__ = ["WriteBack", "in_lanes", "result_layout"]


def result_layout(ray_token, lanes):
    """Lanes ``mask`` of register ``dst`` of a ray, with the last of which it is ready again."""
    return data.StructLayout({"token": ray_token, "last": 1, "dst": 5, "mask": 3, "value": lanes})


def in_lanes(fmt, *values):
    """A register with each of three values in a lane."""
    width = lane_width(fmt)
    return Cat(Cat(value, Const(0, width))[:width] for value in values)


class WriteBack(wiring.Component):
    """One result a clock: those of the transformation unit, which cannot wait, before others, of which whoever was
    served least recently goes first.

    Each input has a register, and who goes next is known a cycle before: so that no unit waits within a cycle for the
    choice, nor the choice for a unit. Latency is 1 cycle for the transformation unit's, 2 for others.

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
    o : ``{"valid", "result"}``: the result
    """

    def __init__(self, *, fmt, num_inputs, tag, result):
        self._fmt = fmt
        self._result = result
        self._num_inputs = num_inputs
        super().__init__({
            "i": In(stream.Signature(result)).array(num_inputs),
            "stepped": In(data.StructLayout({"valid": 1, "tag": tag, "vector": vector_layout(fmt)})),
            "o": Out(data.StructLayout({"valid": 1, "result": result})),
        })

    def elaborate(self, platform):
        m = Module()
        num_inputs = self._num_inputs
        held = [Signal(self._result, name=f"held{number}", reset_less=True) for number in range(num_inputs)]
        has, will_have, goes, leaves = (Signal(num_inputs) for _ in range(4))
        m.submodules.turns = turns = LeastRecent(num_bidders=num_inputs)
        m.d.comb += [leaves.eq(Mux(self.stepped.valid, 0, goes)), turns.bid.eq(will_have)]
        m.d.sync += has.eq(will_have)
        for number, source in enumerate(self.i):
            m.d.comb += [source.ready.eq(~has[number] | leaves[number]),
                         will_have[number].eq(has[number] & ~leaves[number] | source.valid)]
            with m.If(source.ready):
                m.d.sync += held[number].eq(source.payload)
        with m.If(~self.stepped.valid | ~goes.any()):
            m.d.comb += turns.served.eq(turns.grant)
            m.d.sync += goes.eq(turns.grant)

        result, valid = Signal(self._result, reset_less=True), Signal()
        m.d.comb += [self.o.valid.eq(valid), self.o.result.eq(result)]
        m.d.sync += [result.eq(selected([(goes[number], each.as_value()) for number, each in enumerate(held)])),
                     valid.eq(goes.any() | self.stepped.valid)]
        with m.If(self.stepped.valid):
            tag, vector = self.stepped.tag, self.stepped.vector
            m.d.sync += [result.token.eq(tag.token), result.last.eq(1), result.dst.eq(tag.dst),
                         result.mask.eq(tag.mask), result.value.eq(in_lanes(self._fmt, vector.x, vector.y, vector.z))]
        return m
