"""Conversion from and to integers."""

from types import MappingProxyType, SimpleNamespace

from amaranth.hdl import Cat, Const, Mux, Shape, Signal, signed
from amaranth.lib.wiring import In, Out

from .normalise import normalise, normalise_delays
from .operator import Operator, is_inf, is_zero
from .packing import round_and_pack, round_and_pack_delays
from .pipeline import carry_delay, lut_delay
from .rounding import Rounding, emulated, round_nearest, round_truncate

__all__ = ["FloatToInt", "IntToFloat", "float_to_int", "int_to_float", "int_to_float_truncate"]


@emulated
def int_to_float(params, i, unit=1.0):
    """Integer ``i``, of up to 53 bits, times ``unit``, a power of two, rounded to nearest even."""
    return round_nearest(params, float(i) * unit)


@emulated
def int_to_float_truncate(params, i, unit=1.0):
    """Integer ``i``, of up to 53 bits, times ``unit``, a power of two, rounded towards zero."""
    return round_truncate(params, float(i) * unit)


@emulated
def float_to_int(a, lowest, highest, unit=1.0):
    """Integer part of ``a`` in units of ``unit``, but not below ``lowest`` nor above ``highest``."""
    return int(min(max(a / unit, float(lowest)), float(highest)))


class _Conversion(Operator):
    def __init__(self, fmt, members, *, int_width, signed, num_frac_bits, **parameters):
        if not 1 <= int_width <= 53:
            raise ValueError(f"Integer width must be between 1 and 53 bits, not {int_width!r}")
        if not -64 <= num_frac_bits <= 64:
            raise ValueError(f"Number of fraction bits must be between -64 and 64, not {num_frac_bits!r}")
        self.int_shape = Shape(int_width, signed)
        self.num_frac_bits = num_frac_bits
        super().__init__(fmt, members(self.int_shape), **parameters)


class IntToFloat(_Conversion):
    """r = i * 2^-num_frac_bits, rounded once; beyond the largest value ±∞.

    Parameters
    ----------
    fmt, latency, rounding
        See :class:`~fpu.operator.Operator`.
    int_width : int
        Bits of the integer, 1 to 53.
    signed : bool
        Whether it is in two's complement.
    num_frac_bits : int
        How many of its bits stand behind the binary point, -64 to 64: none for an integer.

    Members
    -------
    i : In(Shape(int_width, signed))
        Integer.
    r : Out(fmt)
        Float, ``latency`` cycles later.

    Raises
    ------
    ValueError
        If ``int_width`` or ``num_frac_bits`` is outside its limits or ``latency`` negative.
    """

    #: Compiled emulation by rounding: ``f(fmt.params, i, 2^-num_frac_bits)``.
    emulation = MappingProxyType({Rounding.NEAREST_EVEN: int_to_float, Rounding.TRUNCATE: int_to_float_truncate})

    def __init__(self, fmt, *, int_width, signed=True, num_frac_bits=0, latency=None, rounding=Rounding.NEAREST_EVEN):
        super().__init__(fmt, lambda shape: {"i": In(shape), "r": Out(fmt)},
                         int_width=int_width, signed=signed, num_frac_bits=num_frac_bits,
                         latency=latency, rounding=rounding)

    def _delays(self):
        return {"magnitude": carry_delay(self.int_shape.width),
                **normalise_delays(self._magnitude_width),
                **round_and_pack_delays(self.fmt)}

    @property
    def _magnitude_width(self):
        # Room for the guard bit below the significand.
        return max(self.int_shape.width, self.fmt.sig_width + 2)

    def _compute(self, m, step):
        fmt, int_width, width = self.fmt, self.int_shape.width, self._magnitude_width
        sign = self.i[-1] if self.int_shape.signed else Const(0)
        magnitude = Mux(sign, -self.i, self.i)[:int_width]
        s = step("magnitude", sign=sign, magnitude=Cat(Const(0, width - int_width), magnitude), negative=Const(0, 1))
        s = normalise(step, s)
        exp = fmt.bias + int_width - 2 - self.num_frac_bits
        exp = Const(exp, signed(2 + max(exp.bit_length(), width.bit_length())))
        s = SimpleNamespace(**vars(s), sticky=Const(0, 1), exp=exp,
                            zero=~(s.sig[-2:] | s.shifted[-2:]).any(), inf=Const(0, 1))
        m.d.comb += self.r.eq(round_and_pack(step, m, s, fmt=fmt, rounding=self.rounding))


class FloatToInt(_Conversion):
    """r = a * 2^num_frac_bits, truncated towards zero, and the nearest integer there is where it is out of range.

    Parameters
    ----------
    fmt, latency
        See :class:`~fpu.operator.Operator`.
    int_width : int
        Bits of the integer, 1 to 53.
    signed : bool
        Whether it is in two's complement.
    num_frac_bits : int
        How many of its bits stand behind the binary point, -64 to 64: none for an integer.

    Members
    -------
    a : In(fmt)
        Float.
    r : Out(Shape(int_width, signed))
        Integer, ``latency`` cycles later.

    Raises
    ------
    ValueError
        If ``int_width`` or ``num_frac_bits`` is outside its limits or ``latency`` negative.
    """

    def __init__(self, fmt, *, int_width, signed=True, num_frac_bits=0, latency=None):
        super().__init__(fmt, lambda shape: {"a": In(fmt), "r": Out(shape)},
                         int_width=int_width, signed=signed, num_frac_bits=num_frac_bits,
                         latency=latency)

    @property
    def _magnitude_width(self):
        return max(self.int_shape.width, self.fmt.sig_width)

    @property
    def _levels(self):
        return range((self._magnitude_width - 1).bit_length())[::-1]

    def _delays(self):
        return {"distance": carry_delay(self.fmt.exp_width),
                **{f"shift_{level}": lut_delay(1.2) for level in self._levels},
                "negate": carry_delay(self.int_shape.width),
                "saturate": lut_delay(2)}

    def _compute(self, m, step):
        fmt, a, width = self.fmt, self.a, self._magnitude_width
        # Aligned to the top, the significand is to go right by what the exponent lacks of its highest.
        farthest = fmt.bias + width - 1 - self.num_frac_bits
        distance = Signal(signed(2 + max(farthest.bit_length(), fmt.exp_width, len(self._levels))))
        m.d.comb += distance.eq(farthest - a.exp)
        s = step("distance", distance=distance, sign=a.sign, zero=is_zero(a), inf=is_inf(a),
                 magnitude=Cat(Const(0, width - fmt.sig_width), a.frac, Const(1, 1)))
        for level in self._levels:
            s = step(f"shift_{level}", s,
                     magnitude=Mux(s.distance[level], s.magnitude >> (1 << level), s.magnitude))

        int_width, is_signed = self.int_shape.width, self.int_shape.signed
        highest, lowest = (1 << int_width - is_signed) - 1, -(is_signed << int_width - 1)
        above = s.inf | ~s.zero & (s.distance < 0)
        below = ~above & (s.zero | (s.distance >> len(self._levels)).any())
        over = above | ~below & (s.magnitude > highest)
        s = step("negate", integer=Mux(s.sign, -s.magnitude if is_signed else 0, s.magnitude)[:int_width],
                 limit=Mux(s.sign, lowest, highest), over=over, zero=below)
        s = step("saturate", r=Mux(s.over, s.limit, Mux(s.zero, 0, s.integer)))
        m.d.comb += self.r.eq(s.r)
