"""The reference in integers against the one in fractions."""

from fractions import Fraction
from math import inf, isinf

import numpy as np
import pytest

from fpu import FloatFormat
from tests.fpu import integers, reference
from tests.fpu.operands import all_pairs, members, random_pairs, structured_pairs

FORMATS = [FloatFormat(2, 3), FloatFormat(3, 2), FloatFormat(5, 10), FloatFormat(7, 16), FloatFormat(8, 23)]
BINARY = ["add", "subtract", "multiply", "divide", "order"]
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


def dot_product(a, b, c, *fmt, truncate):
    """In fractions, of scalars."""
    terms = []
    for pair in zip(a, b, strict=True):
        (sign_a, x), (sign_b, y) = (reference.unpack(bits, *fmt) for bits in pair)
        if (isinf(x) or isinf(y)) and (x == 0 or y == 0):
            return 0
        terms.append((sign_a ^ sign_b, inf if isinf(x) or isinf(y) else x * y))
    terms.append(reference.unpack(c, *fmt))
    infinite = {sign for sign, magnitude in terms if isinf(magnitude)}
    if infinite:
        return reference.pack(*infinite, inf, *fmt) if len(infinite) == 1 else 0
    total = sum(((-1) ** sign * magnitude for sign, magnitude in terms), Fraction(0))
    sign = int(total < 0) if total else int(all(sign for sign, _ in terms))
    return reference.pack(sign, abs(total), *fmt, truncate=truncate)


@pytest.mark.parametrize("truncate", [False, True])
@pytest.mark.parametrize("fmt", FORMATS, ids=str)
def test_dot_product(fmt, truncate):
    rng = np.random.default_rng(12)
    pairs = [structured_pairs(fmt, count=2_000, rng=rng) for _ in range(4)]
    (a, b), c = zip(*pairs[:3], strict=True), pairs[3][0]
    parameters = fmt.exp_width, fmt.frac_width
    got = integers.dot_product(a, b, c, *parameters, truncate=truncate)
    want = [dot_product(*rows, *parameters, truncate=truncate) for rows in
            zip(zip(*(row.tolist() for row in a), strict=True), zip(*(row.tolist() for row in b), strict=True),
                c.tolist(), strict=True)]
    assert got.tolist() == want
    assert len({*want}) > 30
