"""Normalising a significand."""

from types import SimpleNamespace

from amaranth.hdl import Cat, Const, Mux

from .pipeline import lut_delay

__all__ = ["normalise", "normalise_delays"]


#: From 2^5 places on, one step does not both look at them and move the others.
_WIDE_LEVEL = 5


def normalise_delays(width):
    """Delays of the steps of :func:`normalise` on ``width`` bits."""
    # A tree of tables that looks at 2^level bits, and the one that shifts; the last step shifts in the rounding.
    levels, delays = _normalise_levels(width), {}
    for level in levels:
        look, shift = lut_delay((level + 1) // 2), lut_delay(int(level != levels[-1]))
        if level >= _WIDE_LEVEL:
            # What has been found goes to all places.
            delays |= {f"detect_{level}": look, f"normalise_{level}": 2 * shift}
        else:
            delays[f"normalise_{level}"] = look + shift
    return delays


def _normalise_levels(width):
    return range(1, (width - 1).bit_length())[::-1]


def normalise(step, s):
    """``s`` with ``s.magnitude`` made the ``sig`` that :func:`round_and_pack` takes, of the same width.

    It is shifted left by an even number of places, until its upper two bits are not both zero, if any is not: the
    ``exp_offset`` is what that takes from the exponent. Where ``s.negative``, it stands for minus its two's complement.
    """
    width, levels = len(s.magnitude), _normalise_levels(len(s.magnitude))
    s = SimpleNamespace(**vars(s), halvings=Const(0, 0))
    complement = s.negative
    for level in levels:
        places = 1 << level
        # -x = ~x + 1: the ones that are shifted in lead the 1, which the rounding adds, to where it belongs.
        magnitude = s.magnitude ^ complement.replicate(width)
        clear = ~magnitude[-places:].any()
        if level >= _WIDE_LEVEL:
            s = step(f"detect_{level}", s, magnitude=magnitude, clear=clear)
            magnitude, clear = s.magnitude, s.clear
        shifted = Cat(s.negative.replicate(places), magnitude[:-places])
        halvings = Cat(clear, s.halvings)
        if level == levels[-1]:
            s = step(f"normalise_{level}", s, sig=magnitude, shifted=shifted, shifts=clear, halvings=halvings)
        else:
            s = step(f"normalise_{level}", s, magnitude=Mux(clear, shifted, magnitude), halvings=halvings)
        complement = Const(0, 1)
    # Minus the number of halvings, in tables: a carry chain would take twice as many.
    below = [s.halvings[:bit].any() for bit in range(len(s.halvings) + 1)]
    s.exp_offset = Cat(*(bit ^ any_below for bit, any_below in zip(s.halvings, below, strict=False)),
                       below[-1]).as_signed()
    return s
