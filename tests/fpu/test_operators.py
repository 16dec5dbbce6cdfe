"""The operators' hardware and emulation against exact fractions and numpy's floats."""

import numpy as np
import pytest
from amaranth.back import rtlil

from fpu import (
    Adder,
    Comparator,
    Divider,
    FloatFormat,
    Maximum,
    Minimum,
    Multiplier,
    Rounding,
    Subtractor,
    TableDivider,
)
from fpu.product import Product
from fpu.reciprocal import MAX_FRAC_WIDTH
from tests.fpu import ECP5, reference
from tests.fpu.operands import all_pairs, structured_pairs
from tests.fpu.verilated import Bank

TINY, TINIEST = FloatFormat(3, 2), FloatFormat(2, 3)
DEFAULT = FloatFormat(7, 16)
NUMPY = {FloatFormat(5, 10): np.float16, FloatFormat(8, 23): np.float32}
EXACT = {Adder: reference.add, Subtractor: reference.subtract, Multiplier: reference.multiply,
         Divider: reference.divide, TableDivider: reference.divide, Minimum: reference.minimum,
         Maximum: reference.maximum}
# Its bank is compiled once.
pytestmark = pytest.mark.xdist_group("operators")


def latencies(cls, fmt):
    """All there are, and one more than there are steps to put registers behind."""
    return range(len(cls._step_delays(fmt)) + 2)


def with_each_rounding(cls, fmt, *, latency=None):
    """Operators with each rounding there is."""
    if len(cls.emulation) == 1:
        return [cls(fmt, latency=latency)]
    return [cls(fmt, latency=latency, rounding=rounding) for rounding in cls.emulation]


@pytest.fixture(scope="session")
def bank(tmp_path_factory):
    operators = [Comparator(fmt, latency=latency) for fmt in (TINY, TINIEST) for latency in latencies(Comparator, fmt)]
    operators += [Comparator(fmt) for fmt in (DEFAULT, *NUMPY)]
    for cls in EXACT:
        for fmt in (TINY, TINIEST):
            for latency in latencies(cls, fmt):
                operators += with_each_rounding(cls, fmt, latency=latency)
        operators += with_each_rounding(cls, DEFAULT)
        operators += [cls(fmt) for fmt in NUMPY if cls is not TableDivider or fmt.frac_width <= MAX_FRAC_WIDTH]
    return Bank(operators, tmp_path_factory.mktemp("bank"))


def expected(cls, rounding, a, b, fmt):
    parameters = fmt.exp_width, fmt.frac_width
    pairs = zip(a.tolist(), b.tolist(), strict=True)
    if cls is Comparator:
        return np.array([reference.order(*pair, *parameters) for pair in pairs])
    truncate = rounding is Rounding.TRUNCATE
    return np.array([EXACT[cls](*pair, *parameters, truncate=truncate) for pair in pairs])


def check(bank, a, b, fmt):
    known = {}
    results = bank.run(a, b, fmt=fmt)
    assert results
    for operator, got in results:
        key = type(operator), operator.rounding
        if key not in known:
            known[key] = expected(*key, a, b, fmt)
        wrong = np.flatnonzero(got != known[key])
        assert not wrong.size, (
            f"{type(operator).__name__} {fmt} {operator.rounding} latency {operator.latency}: {wrong.size} wrong, "
            f"{[tuple(hex(x[i]) for x in (a, b, got, known[key])) for i in wrong[:4]]}")


@pytest.mark.parametrize("fmt", [TINY, TINIEST], ids=str)
def test_every_pair(bank, fmt):
    check(bank, *all_pairs(fmt), fmt)


def test_structured_pairs(bank):
    check(bank, *structured_pairs(DEFAULT, count=6_000, rng=np.random.default_rng(1)), DEFAULT)


@pytest.mark.parametrize(("fmt", "dtype"), NUMPY.items(), ids=str)
def test_numpy(bank, fmt, dtype):
    a, b = structured_pairs(fmt, count=20_000, rng=np.random.default_rng(2))
    x, y = fmt.decode(a).astype(dtype), fmt.decode(b).astype(dtype)
    assert (x == fmt.decode(a)).all()
    with np.errstate(all="ignore"):
        want = {Adder: x + y, Subtractor: x - y, Multiplier: x * y, Divider: x / y, TableDivider: x / y,
                Minimum: np.where(x < y, x, y), Maximum: np.where(x > y, x, y),
                Comparator: 1 * (x < y) + 2 * (x == y) + 4 * (x > y)}
    for operator, got in bank.run(a, b, fmt=fmt):
        result = want[type(operator)]
        if isinstance(operator, Comparator):
            assert (got == result).all()
            continue
        got = fmt.decode(got)
        result = np.where(np.isnan(result), dtype(0), result).astype(np.float64)
        # numpy keeps subnormals. At the smallest normal it may have come by rounding up a subnormal, or not.
        assert (got[np.abs(result) < fmt.min_normal] == 0).all()
        normal = np.abs(result) > fmt.min_normal
        assert normal.sum() > 1000
        assert (got[normal] == result[normal]).all()
        assert (np.signbit(got) == np.signbit(result)).all()


@pytest.mark.parametrize(("cls", "rounding"), [(cls, rounding) for cls in EXACT for rounding in cls.emulation])
@pytest.mark.parametrize(("fmt", "pairs"), [
    (TINY, all_pairs(TINY)), (TINIEST, all_pairs(TINIEST)),
    (DEFAULT, structured_pairs(DEFAULT, count=3_000, rng=np.random.default_rng(3))),
    (FloatFormat(8, 23), structured_pairs(FloatFormat(8, 23), count=3_000, rng=np.random.default_rng(4))),
], ids=["3.2", "2.3", "7.16", "8.23"])
def test_emulation(cls, rounding, fmt, pairs):
    a, b = pairs
    emulate = cls.emulation[rounding]
    got = [emulate(fmt.params, *pair) for pair in zip(fmt.decode(a).tolist(), fmt.decode(b).tolist(), strict=True)]
    # A zero as of the format
    want = fmt.encode(fmt.decode(expected(cls, rounding, a, b, fmt)))
    assert (fmt.encode(np.array(got)) == want).all()
    assert (fmt.quantize(got) == got).all()


@pytest.mark.parametrize("latency", range(1, 6))
def test_block_has_the_output_register(latency):
    """One multiplier block, with one register less outside it."""
    def flip_flops(platform):
        text = rtlil.convert(Product(17, 17, cycles=latency), platform=platform)
        return text.count("cell \\MULT18X18D"), text.count("cell $dff")

    assert flip_flops(None) == (0, latency)
    assert flip_flops(ECP5()) == (1, latency - 1)


def test_block_is_left_to_inference():
    for product in (Product(17, 17, cycles=0), Product(19, 3, cycles=1)):
        assert "MULT18X18D" not in rtlil.convert(product, platform=ECP5())


def test_negative_latency():
    with pytest.raises(ValueError, match="Latency"):
        Adder(DEFAULT, latency=-1)
