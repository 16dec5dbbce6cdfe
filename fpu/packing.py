"""Rounding a result and packing it into its format."""

from types import SimpleNamespace

from amaranth.hdl import Cat, Const, Mux, Signal, signed

from .chain import ChainBit, carry_chain
from .pipeline import carry_delay, lut_delay
from .rounding import Rounding

__all__ = ["round_and_pack", "round_and_pack_delays"]


def round_and_pack_delays(fmt):
    """Delays of the steps of :func:`round_and_pack`."""
    return {"round": lut_delay(1) + carry_delay(fmt.width + 3), "range": lut_delay(3), "pack": lut_delay(2)}


def round_and_pack(step, m, s, *, fmt, rounding):
    """Float (-1)^sign * 2^(exp - bias) * sig, rounded once, with overflow, underflow and special cases.

    ``s.sig`` is in [1, 4), with as many fraction bits as it has bits but two, at least ``sig_width``; instead of it
    ``s.shifted`` is taken where ``s.shifts``, if there is such. ``s.sticky`` says that there are nonzero bits below.
    The signed ``s.exp``, wide enough for all that is added to it, is that of a ``sig`` in [1, 2), with twice
    ``s.exp_offset`` to be added if there is such; or ``s.exp_above`` is that of one in [2, 4). ``s.negative``, if there
    is such, says that the value is one more in the last place of ``sig``, and then exact. ``s.zero`` and ``s.inf``,
    never both, override the value.
    """
    choice = {"shifted": s.sig, "shifts": Const(0, 1), "exp_offset": Const(0, 1).as_signed(), "negative": Const(0, 1)}
    s = SimpleNamespace(**choice | vars(s))
    below = len(s.sig) - fmt.sig_width - 2
    sig, shifted = s.sig[below:], s.shifted[below:]
    above_two, guard, sticky = Signal(), Signal(2), Signal()
    m.d.comb += [above_two.eq(Mux(s.shifts, shifted[-1], sig[-1])),
                 guard.eq(Mux(s.shifts, shifted[:2], sig[:2])),
                 sticky.eq(s.sticky | Mux(s.shifts, s.shifted[:below].any(), s.sig[:below].any()))]
    injected, tie = [(ChainBit.ADD, guard, Cat(~above_two & s.negative, above_two & s.negative), 0)], Const(0)
    if rounding is Rounding.NEAREST_EVEN:
        # Half a unit is injected whichever place it has, without waiting for sticky; a tie that this has brought to
        # an odd fraction was even before, so clearing the last bit mends it. The chain's own table inverts.
        injected = [(ChainBit.SUBTRACT, guard[0], above_two, 0), (ChainBit.ADD, guard[1], above_two, 0)]
        tie = ~sticky & Mux(above_two, guard == 0b10, guard[0])
    if hasattr(s, "exp_above"):
        base, added = s.exp_above, (~above_two).as_signed()
    else:
        base, added = s.exp, Cat(above_two, s.exp_offset).as_signed()
    exp = Signal(signed(max(fmt.exp_width + 2, len(base))))
    offset = Signal.like(exp)
    m.d.comb += [exp.eq(base), offset.eq(added)]
    # In one chain the carry out of the significand is the increment of the exponent.
    rounded = carry_chain(
        m, "rounding", *injected,
        (ChainBit.CHOOSE, shifted[2:-1], sig[2:-1], s.shifts),
        (ChainBit.ADD, exp, offset, 0))
    s = step("round", sig=rounded[:fmt.sig_width + 1], exp=rounded[fmt.sig_width + 1:].as_signed(), tie=tie,
             above_two=above_two, zero=s.zero, inf=s.inf, sign=s.sign)

    # Bit by bit: a comparison would become a carry chain.
    under = s.exp[-1] | (s.exp == 0)
    over = ~s.exp[-1] & (s.exp[fmt.exp_width:-1].any() | s.exp[:fmt.exp_width].all())
    s = step("range", sig=s.sig, tie=s.tie, above_two=s.above_two, sign=s.sign, exp=s.exp[:fmt.exp_width],
             zero=s.zero | ~s.inf & under, inf=s.inf | ~s.zero & over)

    frac = Mux(s.above_two, Cat(s.sig[2] & ~s.tie, s.sig[3:]), Cat(s.sig[1] & ~s.tie, s.sig[2:-1]))
    exp = Mux(s.inf, fmt.exp_inf, Mux(s.zero, 0, s.exp))
    return step("pack", r=Cat(Mux(s.inf | s.zero, 0, frac), exp, s.sign)).r
