"""Vectors that the shader gives to the transformation unit."""

from amaranth.lib import data

from .layout import PACKET_RAYS, thread_width, vector_layout
from .microcode import Mode, Store

__all__ = ["put_step", "step_layout"]


def step_layout(*, fmt, num_threads, tag):
    """A vector that the shader wants mapped by ``rows``; ``tag`` comes back with the result."""
    return data.StructLayout({"tag": tag, "thread": thread_width(num_threads), "ray": range(PACKET_RAYS),
                              "store": Store, "rows": data.ArrayLayout(vector_layout(fmt), 3),
                              "vector": vector_layout(fmt)})


def put_step(m, step, out, *, fmt):
    """Drives ``step``, but for its tag, from an instruction of :attr:`~rtl.microcode.Op.VECTOR` with its operands.

    Parameters
    ----------
    m : Module
        Gets the logic.
    step : view of :func:`step_layout`
        Is driven.
    out : view
        See :class:`~rtl.instruction_fetch.InstructionFetch`.
    fmt : :class:`~fpu.FloatFormat`
        Format of floats.
    """
    def lane(register, place):
        return out[register][place][:fmt.width]

    m.d.comb += [
        step.thread.eq(out.token.thread),
        step.ray.eq(out.token.ray),
        step.store.eq(out.instruction.store),
        *(getattr(step.vector, axis).eq(lane("x", place)) for place, axis in enumerate("xyz")),
    ]
    with m.Switch(out.instruction.mode):
        with m.Case(Mode.COLUMNS):
            m.d.comb += [getattr(step.rows[row], axis).eq(lane(register, row))
                         for row in range(3) for axis, register in zip("xyz", "abc", strict=True)]
        with m.Case(Mode.ROWS):
            m.d.comb += [getattr(step.rows[row], axis).eq(lane(register, place))
                         for row, register in enumerate("abc") for place, axis in enumerate("xyz")]
        with m.Case(Mode.DIAGONAL):
            m.d.comb += [getattr(step.rows[row], axis).eq(lane("a", row)) for row, axis in enumerate("xyz")]
