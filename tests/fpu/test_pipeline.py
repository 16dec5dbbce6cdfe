"""Placement of registers against trying all placements."""

from itertools import combinations, pairwise

import numpy as np
import pytest

from fpu.pipeline import balance, depth_for


def stages(weights, registers):
    ends = [0, *(step + 1 for step, count in enumerate(registers) if count)]
    return [sum(weights[start:end]) for start, end in pairwise(ends)]


@pytest.mark.parametrize("latency", range(1, 7))
def test_balance(latency):
    for seed in range(20):
        weights = np.random.default_rng(seed).integers(1, 20, 6).tolist()
        registers = balance(weights, latency=latency)
        assert sum(registers) == latency
        assert registers[-1] == 1
        choices = combinations(range(5), latency - 1)
        placements = ([int(step in (*chosen, 5)) for step in range(6)] for chosen in choices)
        assert max(stages(weights, registers)) == min(max(stages(weights, placement)) for placement in placements)


def test_balance_limits():
    assert balance([1, 2, 3], latency=0) == [0, 0, 0]
    assert balance([1, 2, 3], latency=5) == [1, 1, 3]


def test_depth():
    assert depth_for([1, 1, 1, 1], stage_delay=4) == 1
    assert depth_for([3, 2, 2, 3], stage_delay=4) == 3
    assert depth_for([9, 1, 1], stage_delay=4) == 2
