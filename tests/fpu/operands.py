"""Operands that find faults: pairs of bit patterns."""

import numpy as np

__all__ = ["all_pairs", "members", "random_pairs", "structured_pairs"]


def members(fmt, bits):
    """``bits`` with the one pattern that infinity has of each sign."""
    return np.where(bits >> fmt.frac_width & fmt.exp_inf == fmt.exp_inf, bits & -(1 << fmt.frac_width), bits)


def all_pairs(fmt):
    bits = np.unique(members(fmt, np.arange(1 << fmt.width)))
    return [operand.ravel() for operand in np.meshgrid(bits, bits)]


def random_pairs(fmt, *, count, rng):
    return members(fmt, rng.integers(0, 1 << fmt.width, (2, count)))


def structured_pairs(fmt, *, count, rng):
    """Pairs of members: far and near exponents, near cancellation, long runs of ones, special values; and such that
    their product or quotient is as near as can be to halfway between two members."""
    frac_mask = (1 << fmt.frac_width) - 1

    def floats(exp):
        runs = frac_mask >> rng.integers(0, fmt.frac_width + 1, count) << rng.integers(0, fmt.frac_width + 1, count)
        frac = np.choose(rng.integers(0, 3, count), [rng.integers(0, frac_mask + 1, count), runs & frac_mask,
                                                     frac_mask - (runs & frac_mask)])
        sign = rng.integers(0, 2, count)
        return members(fmt, sign << fmt.width - 1 | np.clip(exp, 0, fmt.exp_inf) << fmt.frac_width | frac)

    a_exp = rng.integers(0, fmt.exp_inf + 1, count)
    near = a_exp + rng.integers(-2, 3, count)
    aligned = a_exp + rng.integers(-fmt.frac_width - 4, fmt.frac_width + 5, count)
    b_exp = np.choose(rng.integers(0, 4, count), [near, aligned, 2 * fmt.bias - near,
                                                  rng.integers(0, fmt.exp_inf + 1, count)])
    a, b = floats(a_exp), floats(b_exp)
    cancels = (a ^ rng.integers(0, 2, count) << fmt.width - 1) + rng.integers(-3, 4, count)
    inner = (a & frac_mask > 3) & (a & frac_mask < frac_mask - 3)
    halfway = fmt.decode(floats(fmt.bias + rng.integers(-3, 4, count))) * (1 + 2.0 ** -fmt.sig_width)
    with np.errstate(all="ignore"):
        divides, multiplies = halfway * fmt.decode(b), halfway / fmt.decode(b)
    kind = rng.integers(0, 8, count)
    for number, values in ((1, divides), (2, multiplies)):
        chosen = (kind == number) & np.isfinite(values)
        a = np.where(chosen, fmt.encode(np.where(chosen, values, 0.0)), a)
    return members(fmt, a), members(fmt, np.where((kind == 0) & inner, cancels, b))
