"""The fused dot product against exact fractions, and how near it is to the sum that it stands for."""

import math
from fractions import Fraction

import numpy as np
import pytest
from amaranth.hdl import Value

from fpu import DotProduct, FloatFormat, Rounding
from tests.bench import simulate
from tests.fpu import clocked, reference

TINY, DEFAULT = FloatFormat(3, 2), FloatFormat(7, 16)
# One more than the steps there are to put registers behind
MAX_LATENCY = 18


def exponent(x):
    return math.frexp(x)[1] - 1


def expected(fmt, guard_width, factors, addend, *, truncate):
    """Bit pattern by the words of DotProduct's docstring."""
    parameters = fmt.exp_width, fmt.frac_width
    terms, infinite = [], set()
    for a, b in [*factors, (addend, 1.0)]:
        if 0.0 in (a, b):
            continue
        if math.isinf(a) or math.isinf(b):
            infinite.add(math.copysign(1, a) * math.copysign(1, b))
        else:
            terms.append((exponent(a) + exponent(b), Fraction(a) * Fraction(b)))
    if infinite:
        return 0 if len(infinite) == 2 else reference.pack(int(-1.0 in infinite), math.inf, *parameters)
    if not terms:
        return 0
    unit = Fraction(2) ** (max(exp for exp, _ in terms) - fmt.frac_width - guard_width)
    total = sum(int(term / unit) for _, term in terms) * unit
    return reference.pack(int(total < 0), abs(total), *parameters, truncate=truncate) if total else 0


def samples(fmt, count, seed):
    """Rows of a₀ … a₂, b₀ … b₂, c: any patterns, near exponents, terms that cancel, some all but one, and zeros times
    the largest number beside small terms."""
    rng = np.random.default_rng(seed)
    bits = rng.integers(0, 1 << fmt.width, (count, 7))
    near = np.clip(fmt.bias + rng.integers(-12, 13, (count, 7)) * rng.integers(0, 3, (count, 1)), 1, fmt.exp_inf - 1)
    bits = np.where(rng.random((count, 1)) < 0.8, bits & ~(fmt.exp_inf << fmt.frac_width) | near << fmt.frac_width,
                    bits)
    rows = fmt.decode(bits)
    cancel = rng.random(count) < 0.3
    with np.errstate(invalid="ignore"):
        almost = rows[:, 0] * (1 + rng.integers(-2, 3, count) * 2.0 ** -fmt.frac_width)
    almost = fmt.quantize(np.where(np.isnan(almost), 0.0, almost))
    rows[cancel, 3] = 1.0
    rows[cancel, 6] = -almost[cancel]
    for row in np.flatnonzero(rng.random(count) < 0.1):
        small = 2.0 ** -round(0.3 * fmt.bias)
        rows[row] = rng.uniform(1, 2, 7) * np.array([small] * 6 + [small * small])
        place = rng.integers(3)
        rows[row, [place, 3 + place]] = rng.permutation([0.0, fmt.max]) * rng.choice([-1.0, 1.0], 2)
    return fmt.quantize(rows)


def simulated(dut, rows):
    got = []

    async def testbench(ctx):
        for now in range(len(rows) + dut.latency):
            if now < len(rows):
                row = rows[now].tolist()
                for index in range(3):
                    ctx.set(dut.a[index], row[index])
                    ctx.set(dut.b[index], row[3 + index])
                if dut.has_addend:
                    ctx.set(dut.c, row[6])
            if now >= dut.latency:
                got.append(ctx.get(Value.cast(dut.r)))
            await ctx.tick()

    simulate(clocked(dut), testbench, name="dot_product")
    return got


@pytest.mark.parametrize(("fmt", "parameters", "count"), [
    *((TINY, {"latency": latency}, 300) for latency in range(MAX_LATENCY + 1)),
    *((TINY, {"rounding": Rounding.TRUNCATE, "latency": latency}, 300) for latency in (0, 5, None)),
    (TINY, {"has_addend": False}, 300), (FloatFormat(2, 1), {}, 300),
    (DEFAULT, {}, 300), (DEFAULT, {"rounding": Rounding.TRUNCATE}, 150), (DEFAULT, {"guard_width": 2}, 300),
    (DEFAULT, {"guard_width": 6, "has_addend": False, "latency": 9}, 150),
    (FloatFormat(8, 23), {}, 150), (FloatFormat(5, 10), {"latency": 1}, 150),
], ids=str)
def test_sum(fmt, parameters, count):
    dut = DotProduct(fmt, **parameters)
    rows = samples(fmt, count, seed=1)
    if not dut.has_addend:
        rows[:, 6] = 0.0
    want = [expected(fmt, dut.guard_width, [(row[i], row[3 + i]) for i in range(3)], row[6],
                     truncate=dut.rounding is Rounding.TRUNCATE) for row in rows.tolist()]
    emulate = dut.emulation[dut.rounding]
    assert fmt.encode(np.array([emulate(fmt.params, dut.guard_width, *row) for row in rows.tolist()])).tolist() == want
    assert simulated(dut, rows) == want


@pytest.mark.parametrize("guard_width", [2, 6, 16, -1])
def test_error(guard_width):
    """Half a unit of the result, and one in the last place kept for each term that is cut."""
    rows = samples(DEFAULT, 20_000, seed=2)
    emulate = DotProduct.emulation[Rounding.NEAREST_EVEN]
    worst, num_cut = 0.0, 3 if guard_width in (16, -1) else 4
    window = 32 if guard_width < 0 else 16 + guard_width
    for row in rows.tolist():
        terms = [Fraction(row[i]) * Fraction(row[3 + i]) for i in range(3) if math.isfinite(row[i] * row[3 + i])]
        exact = sum(terms) + (Fraction(row[6]) if math.isfinite(row[6]) else 0)
        result = emulate(DEFAULT.params, guard_width, *row)
        if not all(map(math.isfinite, row)) or not math.isfinite(result) or abs(result) < 4 * DEFAULT.min_normal:
            continue
        highest = max(exponent(row[i]) + exponent(row[3 + i]) for i in range(3) if row[i] and row[3 + i])
        highest = max(highest, exponent(row[6]) if row[6] else highest)
        allowed = Fraction(2) ** (exponent(result) - 17) + num_cut * Fraction(2) ** (highest - window)
        error = abs(Fraction(result) - exact)
        assert error <= allowed
        worst = max(worst, float(error / allowed))
    assert worst > 0.3


def test_every_latency_is_tested():
    assert len(DotProduct(TINY, latency=0)._delays()) < MAX_LATENCY


@pytest.mark.parametrize("guard_width", [1, 17])
def test_guard_limits(guard_width):
    with pytest.raises(ValueError, match=rf"^Guard bits of a dot product in 7\.16 must be between 2 and 16, not "
                                         rf"{guard_width}$"):
        DotProduct(DEFAULT, guard_width=guard_width)
