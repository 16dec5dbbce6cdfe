"""Ten million pairs of operands and more through the operators in Verilator, against exact integers."""

import importlib.metadata
import json
import tempfile
from pathlib import Path

import click
import numpy as np

from fpu import (
    Adder,
    Comparator,
    Divider,
    Maximum,
    Minimum,
    Multiplier,
    Reciprocal,
    ReciprocalSquareRoot,
    Rounding,
    SquareRoot,
    Subtractor,
    TableDivider,
)
from tests.fpu import integers
from tests.fpu.operands import random_pairs, structured_pairs
from tests.fpu.verilated import Bank
from tools.errors import written_whole
from tools.options import FORMAT

EXACT = {Adder: integers.add, Subtractor: integers.subtract, Multiplier: integers.multiply, Divider: integers.divide,
         TableDivider: integers.divide, Comparator: integers.order, Minimum: integers.minimum,
         Maximum: integers.maximum, Reciprocal: integers.reciprocal,
         SquareRoot: integers.square_root, ReciprocalSquareRoot: integers.reciprocal_square_root}
_BATCH = 1 << 19
_SHOWN = 8


def roundings(cls):
    """What the operators of a class may be told of rounding, as keyword arguments."""
    emulation = getattr(cls, "emulation", {})
    return [{"rounding": rounding} for rounding in emulation] if len(emulation) > 1 else [{}]


def all_operators(fmt):
    """Each operator at its default latency, with each rounding there is."""
    return [cls(fmt, **choice) for cls in EXACT for choice in roundings(cls)]


def describe(operator):
    """What tells an operator from the others, by name."""
    rounding = {} if isinstance(operator, Comparator) else {"rounding": operator.rounding.value}
    return {"operator": type(operator).__name__, "latency": operator.latency, **rounding}


def expected(operator, a, b):
    """Exact results on bit patterns, of ``a`` alone if the operator is unary."""
    operands = [a, b] if hasattr(operator, "b") else [a]
    choice = {} if isinstance(operator, Comparator) else {"truncate": operator.rounding is Rounding.TRUNCATE}
    return EXACT[type(operator)](*operands, operator.fmt.exp_width, operator.fmt.frac_width, **choice)


def mismatches(bank, fmt, *, pairs, seed):
    """(operator, number of wrong results, the first of them as a, b, got, expected) for each operator."""
    rng = np.random.default_rng(seed)
    counts, shown = {}, {}
    for start in range(0, pairs, _BATCH):
        count = min(_BATCH, pairs - start)
        a, b = np.concatenate([structured_pairs(fmt, count=count - count // 2, rng=rng),
                               random_pairs(fmt, count=count // 2, rng=rng)], axis=1)
        for operator, got in bank.run(a, b, fmt=fmt):
            want = expected(operator, a, b)
            wrong = np.flatnonzero(got != want)
            counts[operator] = counts.get(operator, 0) + len(wrong)
            shown.setdefault(operator, [])
            shown[operator] += [tuple(int(x[i]) for x in (a, b, got, want)) for i in wrong[:_SHOWN]]
    return [(operator, count, shown[operator][:_SHOWN]) for operator, count in counts.items()]


@click.command()
@click.option("--format", "fmt", type=FORMAT, default="7.16", show_default=True,
              help="Float format, EXPONENT.FRACTION in bits")
@click.option("--pairs", default=10_000_000, show_default=True, type=click.IntRange(min=1),
              help="Pairs for each operator, half of them structured, half random")
@click.option("--seed", default=1, show_default=True, help="Of the random numbers")
@click.option("-o", "--output", type=click.Path(dir_okay=False, path_type=Path),
              help="Where the result goes as JSON, if there is no mismatch")
def main(fmt, pairs, seed, output):
    """Run operators at their default latency in Verilator on PAIRS pairs, and compare with exact integers."""
    with tempfile.TemporaryDirectory() as folder:
        bank = Bank(all_operators(fmt), Path(folder), optimise="-O2")
        found = mismatches(bank, fmt, pairs=pairs, seed=seed)
    rows = [{**describe(operator), "pairs": pairs, "mismatches": count} for operator, count, _ in found]
    for row, (_, _, shown) in zip(rows, found, strict=True):
        click.echo(", ".join(f"{name} {value}" for name, value in row.items()))
        for a, b, got, want in shown:
            click.echo(f"  a 0x{a:x}, b 0x{b:x}: 0x{got:x} instead of 0x{want:x}")
    if any(row["mismatches"] for row in rows):
        raise SystemExit(1)
    if output:
        versions = {name: importlib.metadata.version(name) for name in ("amaranth", "verilator", "numpy")}
        result = {"format": str(fmt), "seed": seed, "versions": versions, "operators": rows}
        with written_whole(output) as whole:
            whole.write_text(json.dumps(result, indent=1) + "\n")


if __name__ == "__main__":
    main()
