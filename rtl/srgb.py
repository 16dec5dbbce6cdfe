"""Tables between sRGB-encoded bytes and linear colours (IEC 61966-2-1)."""

__all__ = ["COLOR_ONE", "DARK_BITS", "DARK_SHIFT", "LIGHT_SHIFT", "bright_bytes", "dark_bytes", "linear_colors"]

#: A colour of 1: colours have 16 fraction bits.
COLOR_ONE = 1 << 16

#: Colours below 2**DARK_BITS have a table of their own, of one byte for every 2**DARK_SHIFT of them.
DARK_BITS, DARK_SHIFT = 12, 2
#: All others up to 1 have a byte for every 2**LIGHT_SHIFT.
LIGHT_SHIFT = 6


def _linear(encoded):
    return encoded / 12.92 if encoded <= 0.04045 else ((encoded + 0.055) / 1.055) ** 2.4


def _encoded(linear):
    return 12.92 * linear if linear <= 0.0031308 else 1.055 * linear ** (1 / 2.4) - 0.055


def linear_colors():
    """The colour of each byte, 256 of them."""
    return tuple(round(COLOR_ONE * _linear(byte / 255)) for byte in range(256))


def _bytes(count, shift):
    # What is in the middle of a place of the table is nearest to all that share it.
    return tuple(round(255 * _encoded(min((place + 0.5) * 2**shift / COLOR_ONE, 1.0))) for place in range(count))


def dark_bytes():
    """Bytes of colours c below 2**DARK_BITS, by c >> DARK_SHIFT: 1,024."""
    return _bytes(1 << DARK_BITS - DARK_SHIFT, DARK_SHIFT)


def bright_bytes():
    """Bytes of colours c below 1, by c >> LIGHT_SHIFT: 1,024, of which those of dark ones are not looked at."""
    return _bytes(COLOR_ONE >> LIGHT_SHIFT, LIGHT_SHIFT)
