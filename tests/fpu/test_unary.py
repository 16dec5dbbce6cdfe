"""Reciprocal and roots, over every significand, against exact fractions; what the tables' lines promise."""

import numpy as np
import pytest
from amaranth.hdl import Module, Value
from amaranth.lib import wiring
from amaranth.lib.wiring import In, Out

from fpu import (
    DigitReciprocalSquareRoot,
    FloatFormat,
    Reciprocal,
    ReciprocalSquareRoot,
    Rounding,
    SquareRoot,
    TableDivider,
    reciprocal_square_root_for,
)
from fpu.reciprocal_square_root import _roots
from fpu.table import LineTable
from tests.fpu import reference
from tests.fpu.verilated import Bank

TINY, TINIEST = FloatFormat(3, 2), FloatFormat(2, 3)
SMALL, DEFAULT, SINGLE = FloatFormat(5, 10), FloatFormat(7, 16), FloatFormat(8, 23)
EXACT = {Reciprocal: reference.reciprocal, SquareRoot: reference.square_root,
         ReciprocalSquareRoot: reference.reciprocal_square_root,
         DigitReciprocalSquareRoot: reference.reciprocal_square_root}
# One more than the steps there are to put registers behind
MAX_LATENCY = {Reciprocal: 9, SquareRoot: 8, ReciprocalSquareRoot: 12,
               DigitReciprocalSquareRoot: 12}


class OfTwo(wiring.Component):
    """An operator on one number as the bank takes them."""

    def __init__(self, operator):
        self.operator, self.fmt, self.latency = operator, operator.fmt, operator.latency
        super().__init__({"a": In(self.fmt), "b": In(self.fmt), "r": Out(self.fmt)})

    def elaborate(self, platform):
        m = Module()
        m.submodules.operator = self.operator
        m.d.comb += [Value.cast(self.operator.a).eq(Value.cast(self.a)),
                     Value.cast(self.r).eq(Value.cast(self.operator.r))]
        return m


def roundings(cls):
    return Rounding if cls is SquareRoot else [None]


def build(cls, fmt, *, latency=None, rounding=None):
    return cls(fmt, latency=latency, **({} if rounding is None else {"rounding": rounding}))


@pytest.fixture(scope="module")
def bank(tmp_path_factory):
    operators = []
    for cls, most in MAX_LATENCY.items():
        for rounding in roundings(cls):
            operators += [build(cls, fmt, latency=latency, rounding=rounding)
                          for fmt in (TINY, TINIEST) for latency in range(most + 1)]
            operators += [build(cls, fmt, rounding=rounding) for fmt in (SMALL, DEFAULT)]
    operators += [SquareRoot(SINGLE), DigitReciprocalSquareRoot(SINGLE)]
    return Bank([OfTwo(operator) for operator in operators], tmp_path_factory.mktemp("unary"))


def operands(fmt):
    """All members of a tiny format; else every significand with an even and an odd exponent, and the extremes."""
    if fmt.width <= 8:
        bits = np.arange(1 << fmt.width)
        return bits[(bits >> fmt.frac_width & fmt.exp_inf != fmt.exp_inf) | (bits & (1 << fmt.frac_width) - 1 == 0)]
    rng = np.random.default_rng(4)
    fracs = (np.arange(1 << fmt.frac_width) if fmt.frac_width <= 16 else
             rng.integers(0, 1 << fmt.frac_width, 1 << 15))
    fracs = np.concatenate([fracs, [0, 1, 2, (1 << fmt.frac_width) - 1]])
    exps = [0, 1, 2, 3, fmt.exp_inf - 3, fmt.exp_inf - 2, fmt.exp_inf - 1]
    edges = np.concatenate([exp << fmt.frac_width | rng.choice(fracs, 50) for exp in exps])
    infinity = fmt.exp_inf << fmt.frac_width
    positive = np.concatenate([fmt.bias << fmt.frac_width | fracs, fmt.bias + 1 << fmt.frac_width | fracs, edges,
                               [0, infinity, 1 << fmt.frac_width]])
    negative = np.concatenate([edges, [0, infinity]]) | 1 << fmt.width - 1
    return np.concatenate([positive, negative])


@pytest.mark.parametrize("fmt", [TINY, TINIEST, SMALL, DEFAULT, SINGLE], ids=str)
def test_every_significand(bank, fmt):
    bits, known = operands(fmt), {}
    results = bank.run(bits, 0 * bits, fmt=fmt)
    assert results
    for wrapper, got in results:
        operator = wrapper.operator
        key = type(operator), operator.rounding
        if key not in known:
            known[key] = np.array([EXACT[key[0]](int(a), fmt.exp_width, fmt.frac_width,
                                                 truncate=operator.rounding is Rounding.TRUNCATE) for a in bits])
            emulate = operator.emulation[operator.rounding]
            emulated = [emulate(fmt.params, a) for a in fmt.decode(bits).tolist()]
            assert (fmt.encode(np.array(emulated)) == known[key]).all()
        wrong = np.flatnonzero(got != known[key])
        assert not wrong.size, (
            f"{key[0].__name__} {fmt} {operator.rounding} latency {operator.latency}: {wrong.size} wrong, "
            f"{[tuple(hex(x[i]) for x in (bits, got, known[key])) for i in wrong[:4]]}")


@pytest.mark.parametrize("cls", EXACT)
def test_every_latency_is_tested(cls):
    assert 0 < len(cls(TINY, latency=0)._delays()) < MAX_LATENCY[cls]
    assert 0 < len(cls(TINIEST, latency=0)._delays()) < MAX_LATENCY[cls]


@pytest.mark.parametrize("frac_width", range(1, 17))
def test_lines_are_near_enough(frac_width):
    """Only one number half-way between two members is within their error of the exact result, for every operand.

    That is what makes the check by one product right for operands that were not tried.
    """
    fmt = FloatFormat(7, frac_width)
    significands = (np.arange(1 << frac_width) + (1 << frac_width)).astype(object)
    half_unit = 2.0 ** -(frac_width + 2)

    table = Reciprocal._table(fmt)
    exact = np.array([(2 << frac_width) / (2 * x) for x in significands.tolist()])
    # A result below 1 has this unit; the table's is at least 2^29 times float64's.
    assert np.abs(table.values * 2.0 ** -table.value_width - exact).max() < half_unit

    table = TableDivider._table(fmt)
    rounded = (table.values >> 3) * 2.0 ** -(frac_width + 3)
    divisors = significands.astype(np.float64) * 2.0 ** -frac_width
    # The top bit of the product's operand is taken for granted.
    assert (table.values >> table.value_width - 1 == 1).all()
    # Quotients below 1 have dividends below the divisor, and the smaller unit.
    assert (divisors * np.abs(rounded - exact)).max() < half_unit
    assert (2 * np.abs(rounded - exact)).max() < 2 * half_unit

    table = _roots(frac_width)
    radicands = np.concatenate([divisors, 2 * divisors])
    assert np.abs(table.values * 2.0 ** -table.value_width - radicands ** -0.5).max() < half_unit


def test_lines_err_as_far_above_as_below():
    """Which is what makes a line's largest error least."""
    points, num_lines, value_width = 1 + np.arange(1 << 12) / (1 << 12), 16, 20
    table = LineTable(lambda x: 1 / x, points, num_lines=num_lines, value_width=value_width)
    errors = (table.values - 2.0 ** value_width / points).reshape(num_lines, -1)
    # A line's value at its start is a whole number.
    assert (np.abs(errors.max(1) + errors.min(1)) <= 1).all()
    assert table.max_error == np.abs(errors).max() / 2 ** value_width < 2.0 ** -10


@pytest.mark.parametrize("cls", [Reciprocal, ReciprocalSquareRoot, TableDivider])
def test_too_wide_for_a_table(cls):
    for make in (cls, cls.default_latency, lambda fmt: cls(fmt, latency=5)):
        with pytest.raises(ValueError, match=r"^By table goes a fraction of up to 16 bits, not 17; take a digit "
                                             r"recurrence: Divider, SquareRoot, DigitReciprocalSquareRoot$"):
            make(FloatFormat(7, 17))


@pytest.mark.parametrize(("frac_width", "cls"), [
    (16, ReciprocalSquareRoot), (17, DigitReciprocalSquareRoot), (23, DigitReciprocalSquareRoot)])
def test_root_for_a_format(frac_width, cls):
    assert reciprocal_square_root_for(FloatFormat(8, frac_width)) is cls


@pytest.mark.parametrize("frac_width", range(17, 24))
def test_float64_knows_the_side_of_every_reciprocal_root(frac_width):
    """Of wide significands too: where float64 comes near the middle between two members, it is on the root's side."""
    for doubled in (1, 2):
        radicands = np.arange(1 << frac_width, 2 << frac_width) * doubled
        # In units of half the last place, of which the odd ones are in the middle.
        roots = 2.0 ** (frac_width + 2) / np.sqrt(radicands * 2.0 ** -frac_width)
        middles = np.rint(roots)
        # What three roundings make of one to two significands reaches a millionth of this.
        near = np.flatnonzero((np.abs(roots - middles) < 2.0 ** -20) & (middles % 2 == 1))
        for radicand, root, middle in zip(radicands[near], roots[near], middles[near], strict=True):
            exact_is_above = int(radicand) * int(middle) ** 2 < 1 << 3 * frac_width + 4
            assert root > middle if exact_is_above else root < middle
