"""The reference in integers against the one in fractions."""

from fractions import Fraction
from math import inf, isinf

import numpy as np
import pytest

from fpu import FloatFormat
from tests.fpu import integers, reference
from tests.fpu.operands import all_pairs, members, random_pairs, structured_pairs

FORMATS = [FloatFormat(2, 3), FloatFormat(3, 2), FloatFormat(5, 10), FloatFormat(7, 16), FloatFormat(8, 23)]
BINARY = ["add", "subtract", "multiply", "divide", "order", "minimum", "maximum"]
UNARY = ["reciprocal", "square_root", "reciprocal_square_root"]


def operands(fmt):
    if fmt.width < 8:
        return all_pairs(fmt)
    rng = np.random.default_rng(11)
    return np.concatenate([structured_pairs(fmt, count=4_000, rng=rng), random_pairs(fmt, count=1_000, rng=rng)], 1)


def same(name, fmt, *arrays):
    parameters = fmt.exp_width, fmt.frac_width
    for choice in ({},) if name == "order" else ({"truncate": False}, {"truncate": True}):
        rows = zip(*(array.tolist() for array in arrays), strict=True)
        want = [getattr(reference, name)(*row, *parameters, **choice) for row in rows]
        got = getattr(integers, name)(*arrays, *parameters, **choice)
        wrong = np.flatnonzero(got != want)
        assert not wrong.size, [(name, choice, *(hex(array[i]) for array in (*arrays, got)), hex(want[i]))
                                for i in wrong[:4]]


@pytest.mark.parametrize("fmt", FORMATS, ids=str)
@pytest.mark.parametrize("name", BINARY)
def test_binary(name, fmt):
    same(name, fmt, *operands(fmt))


@pytest.mark.parametrize("fmt", FORMATS, ids=str)
@pytest.mark.parametrize("name", UNARY)
def test_unary(name, fmt):
    same(name, fmt, members(fmt, np.arange(1 << fmt.width)) if fmt.width < 8 else operands(fmt)[0])


def exponent(magnitude):
    """Largest power of two that is not above, or none of zero."""
    if magnitude == 0:
        return None
    exp = magnitude.numerator.bit_length() - magnitude.denominator.bit_length()
    return exp if Fraction(2) ** exp <= magnitude else exp - 1


def dot_product(a, b, c, *fmt, window, truncate):
    """In fractions, of scalars."""
    terms = []
    for x_bits, y_bits in [*zip(a, b, strict=True), (c, None)]:
        sign, x = reference.unpack(x_bits, *fmt)
        y_sign, y = (0, Fraction(1)) if y_bits is None else reference.unpack(y_bits, *fmt)
        if x == 0 or y == 0:
            terms.append((0, Fraction(0), None))
        elif isinf(x) or isinf(y):
            terms.append((sign ^ y_sign, inf, None))
        else:
            terms.append((sign ^ y_sign, x * y, exponent(x) + exponent(y)))
    infinite = {sign for sign, magnitude, _ in terms if isinf(magnitude)}
    if infinite:
        return reference.pack(*infinite, inf, *fmt) if len(infinite) == 1 else 0
    highest = max((exp for _, _, exp in terms if exp is not None), default=0)
    unit = Fraction(2) ** (-4000 if window is None else highest - window)
    total = sum((-1) ** sign * (magnitude // unit * unit) for sign, magnitude, _ in terms)
    return reference.pack(int(total < 0), abs(total), *fmt, truncate=truncate)


@pytest.mark.parametrize("truncate", [False, True])
@pytest.mark.parametrize("windows", [lambda fmt: None, lambda fmt: 2 * fmt.frac_width, lambda fmt: fmt.frac_width + 2],
                         ids=["exact", "wide", "narrow"])
@pytest.mark.parametrize("fmt", FORMATS, ids=str)
def test_dot_product(fmt, windows, truncate):
    rng = np.random.default_rng(12)
    pairs = [structured_pairs(fmt, count=1_000, rng=rng) for _ in range(4)]
    # Terms that cancel
    pairs[1][0][::3], pairs[1][1][::3] = pairs[0][0][::3] ^ 1 << fmt.width - 1, pairs[0][1][::3] ^ 1
    (a, b), c = zip(*pairs[:3], strict=True), pairs[3][0]
    parameters, choice = (fmt.exp_width, fmt.frac_width), {"window": windows(fmt), "truncate": truncate}
    got = integers.dot_product(a, b, c, *parameters, **choice)
    want = [dot_product(*rows, *parameters, **choice) for rows in
            zip(zip(*(row.tolist() for row in a), strict=True), zip(*(row.tolist() for row in b), strict=True),
                c.tolist(), strict=True)]
    assert got.tolist() == want
    assert len({*want}) > 30
