"""The colour unit's operations in plain integers and fractions."""

from fractions import Fraction

from rtl.microcode import Op
from tests.fpu import reference
from tests.rtl import colors

__all__ = ["HIGHEST", "color_operation"]

#: The largest colour.
HIGHEST = 2**24 - 1


def _offset(fmt, floats, offset_log2):
    """Bits of 2^offset_log2 units in the last place of the largest of ``floats``."""
    widths = fmt.exp_width, fmt.frac_width
    exp = max(bits >> fmt.frac_width & fmt.exp_inf for bits in floats)
    if exp == fmt.exp_inf:
        return max(0, exp - fmt.frac_width + offset_log2) << fmt.frac_width
    largest = max(reference.unpack(bits, *widths)[1] for bits in floats)
    if largest == 0:
        return 0
    # Denominators are powers of two.
    power = Fraction(2 ** (largest.numerator.bit_length() - 1), largest.denominator)
    return reference.pack(0, power * 2**offset_log2 / 2**fmt.frac_width, *widths)


def color_operation(fmt, op, a, x, *, offset_log2=3):
    """Lanes of the result of ``op``, of lanes as bits."""
    widths, mask = (fmt.exp_width, fmt.frac_width), (1 << fmt.width) - 1
    bytes_of_x = [x[0] >> place & 255 for place in (16, 8, 0)]
    colors_of = [(lane & HIGHEST, other & HIGHEST) for lane, other in zip(a, x, strict=True)]
    match op:
        case Op.ROOT:
            return [reference.reciprocal_square_root(x[0] & mask, *widths)] * 3
        case Op.CUT:
            return [reference.to_int(lane & mask, 0, HIGHEST, *widths, 16) for lane in x]
        case Op.COLOR_MULTIPLY:
            return [min((lane * (other & 0x1ffff) + 32768) // 65536, HIGHEST) for lane, other in colors_of]
        case Op.COLOR_ADD:
            return [min(lane + other, HIGHEST) for lane, other in colors_of]
        case Op.COLOR_SUBTRACT:
            return [max(lane - other, 0) for lane, other in colors_of]
        case Op.DECODE:
            return [colors.linear_color(byte) for byte in bytes_of_x]
        case Op.BYTES:
            return [colors.byte_fraction(byte) for byte in bytes_of_x]
        case Op.OFFSET:
            return [_offset(fmt, [lane & mask for lane in (*a, *x)], offset_log2)] * 3
        case Op.MOVE:
            return list(x)
