"""Powers of two: what bounds errors, in arithmetic on exponents alone."""

import math
from types import MappingProxyType

from amaranth.hdl import Cat, Const, Mux

from .rounding import emulated

__all__ = ["POWER_EMULATIONS", "POWER_LOGIC", "POWER_OPERANDS", "power", "power_div", "power_max", "power_mul",
           "raised"]


@emulated
def power(params, a):
    """2^⌊log₂|a|⌋; 0 of 0, ∞ of ∞."""
    return a * a if a == 0.0 or math.isinf(a) else math.ldexp(0.5, math.frexp(a)[1])


@emulated
def power_max(params, a, b):
    """The greater of two powers."""
    return max(a, b)


@emulated
def power_mul(params, a, b):
    """a·b of two powers; 0·∞ = 0."""
    product = 0.0 if a == 0.0 or b == 0.0 else a * b
    return 0.0 if product < params[1] else math.inf if product > params[2] else product


@emulated
def power_div(params, a, b):
    """a/b of two powers; 0/0 = ∞/∞ = 0."""
    if a == 0.0 or math.isinf(b):
        return 0.0
    quotient = math.inf if b == 0.0 else a / b
    return 0.0 if quotient < params[1] else math.inf if quotient > params[2] else quotient


@emulated
def raised(params, a, power):
    """a and ``power``·2^frac_width units in the last place more, away from 0; of the next binade on its own units."""
    if a == 0.0 or math.isinf(a) or not math.ldexp(1.0, params[0] - 52) <= power < 1.0:
        return a
    binade = math.ldexp(1.0, math.frexp(a)[1])
    moved = abs(a) + 0.5 * binade * power
    if moved >= binade:
        moved += moved - binade
    return math.copysign(math.inf if moved > params[2] else moved, a)


#: Compiled emulation of each operation.
POWER_EMULATIONS = MappingProxyType({"power": power, "power_max": power_max, "power_mul": power_mul,
                                     "power_div": power_div, "raised": raised})


def _fitted(fmt, total, *, is_zero, is_inf):
    """A power whose exponent is ``total`` − 2^(exp_width − 1), fitted to the format."""
    # The bias being one less than a power of two, taking it off is a matter of the two upper bits.
    below = fmt.exp_width - 1
    low, top = total[:below], total[below:below + 2]
    none, full = is_zero | (top == 0), is_inf | (top == 3)
    exp = Cat(low, top[1]) | full.replicate(fmt.exp_width)
    return Cat(Const(0, fmt.frac_width), exp & ~none.replicate(fmt.exp_width))


def _mul(a, b):
    is_zero = (a.exp == 0) | (b.exp == 0)
    return _fitted(a.shape(), a.exp + b.exp + 1, is_zero=is_zero, is_inf=~is_zero & (a.exp.all() | b.exp.all()))


def _div(a, b):
    is_zero = (a.exp == 0) | b.exp.all()
    return _fitted(a.shape(), a.exp + ~b.exp, is_zero=is_zero, is_inf=~is_zero & (a.exp.all() | (b.exp == 0)))


def _at_most_one_plus(a, power):
    fmt = a.shape()
    # A carry-free comparison of frac·2^−frac_width with the power: all places from the power's up must be 0.
    frac_width, bias = fmt.frac_width, fmt.bias
    over = Cat(a.frac[place] & (power.exp <= max(bias - frac_width + place, 0)) for place in range(frac_width)).any()
    return a.sign | (a.exp < bias) | (a.exp == bias) & (~over | ~a.frac.any())


def _units(a, power):
    """``power`` as units of ``a`` in the last place; none of 0."""
    fmt = a.shape()
    lowest = fmt.bias - fmt.frac_width
    units = Cat(power.exp == lowest + place if lowest + place > 0 else Const(0, 1) for place in range(fmt.frac_width))
    return Mux(a.exp == 0, 0, units)


def _raised(a, units):
    fmt = a.shape()
    # A carry out of the fraction is the next binade.
    moved = Cat(a.frac, a.exp) + units
    frac, exp = moved[:fmt.frac_width], moved[fmt.frac_width:][:fmt.exp_width]
    is_inf = a.exp.all() | exp.all()
    return Cat(frac & ~is_inf.replicate(fmt.frac_width), exp | is_inf.replicate(fmt.exp_width), a.sign)


#: What becomes of the operands before their registers, if there are any.
POWER_OPERANDS = MappingProxyType({"raised": lambda a, power: (a, _units(a, power))})
#: What an operation is in terms of its operands, or of what :data:`POWER_OPERANDS` makes of them.
POWER_LOGIC = MappingProxyType({
    "power": lambda a: Cat(Const(0, a.shape().frac_width), a.exp),
    "power_max": lambda a, b: Cat(Const(0, a.shape().frac_width), Mux(a.exp >= b.exp, a.exp, b.exp)),
    "power_mul": _mul,
    "power_div": _div,
    "raised": _raised,
    "is_within": lambda a, power: a.exp < power.exp,
    "is_at_most_one_plus": _at_most_one_plus,
})
