"""What is true of rays, by hand and by fractions, and what is judged a failure."""

import numpy as np
import pytest

from fpu import FloatFormat
from sim.methods import METHODS, Answers
from sim.stability.cases import CASES, Case, limits_of
from sim.stability.probe import Probe, rounded_rays
from sim.stability.truth import BLUR, _turned_to, judge, truth_of
from tests.sim.methods.test_methods import exact_hit

FMT = FloatFormat(7, 16)
ANGLE = BLUR * 2.0**-16
#: A square at z = 0, another at z = −1, seen from z = 1; x ≥ 0 is covered by the upper one.
UPPER = np.array([[(0.0, -1, 0), (1, -1, 0), (1, 1, 0)], [(0, -1, 0), (1, 1, 0), (0, 1, 0)]])
LOWER = np.array([[(-2.0, -2, -1), (2, -2, -1), (2, 2, -1)], [(-2, -2, -1), (2, 2, -1), (-2, 2, -1)]])
DOWN = np.array([(0.0, 0, -1)])


def down_at(corners, x):
    return truth_of(corners, np.array([(x, 0.25, 1.0)]), DOWN, fmt=FMT)


def test_near_an_outline_either_is_right():
    both = np.concatenate([UPPER, LOWER])
    inside, at, outside = (down_at(both, x) for x in (2 * ANGLE, 0.5 * ANGLE, -2 * ANGLE))
    assert (inside.nearest, inside.farthest) == (1, 1)
    assert (at.nearest, at.farthest) == pytest.approx((1, 2))
    assert (outside.nearest, outside.farthest) == pytest.approx((2, 2))
    assert all(truth.must_hit.item() for truth in (inside, at, outside))
    alone = [down_at(UPPER, x) for x in (2 * ANGLE, 0.5 * ANGLE, -2 * ANGLE)]
    assert [(truth.must_hit.item(), truth.must_miss.item()) for truth in alone] == [
        (True, False), (False, False), (False, True)]
    assert alone[1].farthest == np.inf


@pytest.mark.parametrize(("x", "t", "triangle", "kind"), [
    (0.5, 1.0, 1, None), (0.5, 1 + 0.9 * ANGLE, 1, None), (0.5, np.inf, -1, "is_crack"), (0.5, 2.0, 2, "is_crack"),
    (0.5, 2.0, 1, "is_distance"), (0.5, 0.99, 1, "is_distance"), (0.5, 0.5, 3, "is_phantom"),
    (-0.5, 2.0, 2, None), (-0.5, 1.0, 0, "is_phantom"), (-0.5, np.inf, -1, "is_crack"), (0.5 * ANGLE, 1.0, 1, None),
    (0.5 * ANGLE, 2.0, 2, None), (0.5 * ANGLE, np.inf, -1, "is_crack"), (3.0, np.inf, -1, None),
    (3.0, 2.0, 2, "is_phantom")])
def test_verdicts(x, t, triangle, kind):
    both = np.concatenate([UPPER, LOWER])
    verdict = judge(Answers(np.array([t]), np.array([triangle]), np.zeros(1, bool)), down_at(both, x))
    kinds = "is_crack", "is_phantom", "is_distance", "is_odd"
    assert [name for name in kinds if getattr(verdict, name)] == ([kind] if kind else [])
    assert verdict.is_failure.item() == (kind is not None)


@pytest.mark.parametrize(("gap", "answered", "is_phantom"), [
    (0.3, 0, False), (0.9, 0, False), (1.1, 0, True), (0.3, -1, True), (0.3, None, True), (0.3, 1, True)])
def test_a_tenth_ray_finds_the_tip_of_a_spike(gap, answered, is_phantom):
    """Between the eight, which are 45° apart, comes in a spike of a hundredth of the angle's width."""
    turn = np.radians(22.5)
    along, aside = np.array([np.cos(turn), np.sin(turn), 0]), np.array([-np.sin(turn), np.cos(turn), 0])
    tip = gap * ANGLE * along
    spike = np.stack([tip, tip + along + 1e-2 * ANGLE * aside, tip + along - 1e-2 * ANGLE * aside])
    corners = np.concatenate([spike[None], LOWER])
    truth = truth_of(corners, np.array([(0.0, 0, 1)]), DOWN, fmt=FMT,
                     answered=None if answered is None else np.array([answered]))
    assert len(truth.triangles) == (9 if answered is None else 10)
    verdict = judge(Answers(np.array([1.0]), np.array([0]), np.zeros(1, bool)), truth)
    assert verdict.is_phantom.item() == is_phantom


@pytest.mark.parametrize("seed", range(3))
def test_a_tenth_ray_is_within_the_angle_and_meets_its_triangle(seed):
    """In fractions; where it is not turned, no corner is within the angle."""
    rng = np.random.default_rng(seed)
    count = 200
    corners = rng.normal(size=(count, 3, 3))
    origins = rng.normal(size=(count, 3)) * 3
    near = np.einsum("ni,nij->nj", rng.dirichlet((0.3, 0.3, 0.3), count), corners)
    directions = near - origins + 1.5 * ANGLE * rng.normal(size=(count, 3))
    truth = truth_of(corners, origins, directions, fmt=FMT, answered=np.arange(count))
    turned = _turned_to(corners, origins, directions, ANGLE)
    moved = np.linalg.norm(turned - directions, axis=1) / np.linalg.norm(directions, axis=1)
    is_turned = moved > 0
    assert 20 < is_turned.sum()
    assert moved.max() <= ANGLE * (1 + 1e-9)
    hits = [exact_hit(corners[i], origins[i], turned[i]) is not None for i in np.flatnonzero(is_turned)]
    assert all(hits)
    assert truth.triangles.shape == (10, count)


def test_what_is_odd_fails():
    verdict = judge(Answers(np.array([1.0]), np.array([0]), np.ones(1, bool)), down_at(UPPER, 0.5))
    assert verdict.is_odd.item()
    assert verdict.is_failure.item()


def test_nothing_that_has_an_area():
    truth = truth_of(np.zeros((3, 3, 3)), np.array([(0.0, 0, 1)]), DOWN, fmt=FMT)
    assert truth.must_miss.all()
    assert not truth.is_decided.any()


def test_an_instance_is_where_its_map_takes_rays():
    # Twice as large in the world, about (4, 0, 0).
    placement = np.array([(0.5, 0, 0), (0, 0.5, 0), (0, 0, 0.5), (4, 0, 0)])
    probe = Probe(FMT, UPPER, np.array([(5.0, 0.5, 2), (3, 0.5, 2)]), np.tile(DOWN, (2, 1)), placement=placement)
    assert probe.truth.must_hit.tolist() == [True, False]
    assert probe.truth.nearest[0] == 2
    assert probe.verdict(METHODS["default"]).is_failure.tolist() == [False, False]
    assert probe.verdict(METHODS["Woop 2013"]).is_failure.tolist() == [False, False]


@pytest.mark.parametrize("case", [case for case in CASES.values() if not case.is_of_chip], ids=lambda case: case.name)
def test_truth_by_fractions(case):
    """The middle one of the nine rays: an exact hit is between nearest and farthest, and an exact miss a miss of it."""
    value = case.easiest
    probe = case.probe(value, 24, fmt=FMT, rng=case.rng(value))
    if probe.must_miss:
        # A convex mesh, left outwards: nothing is ahead but what the point's rounding put there.
        assert probe.truth.must_miss.all()
        return
    origins, directions = probe._placed(probe.origins, probe.directions)
    ahead, near = 0, probe.pairs
    for ray in range(min(probe.num_rays, 12)):
        numbers = near.triangle[near.first[ray]:near.first[ray + 1]]
        hits = [exact_hit(probe.corners[number], origins[ray], directions[ray]) for number in numbers
                if probe.excluded is None or number != probe.excluded[ray]]
        nearest = min((t for t in hits if t is not None), default=None)
        if nearest is None:
            assert probe.truth.farthest[ray] == np.inf
        else:
            assert probe.truth.nearest[ray] * (1 - 1e-9) <= float(nearest) <= probe.truth.farthest[ray] * (1 + 1e-9)
            ahead += 1
    assert ahead >= (0 if case.name == "degenerate" else 8)


@pytest.mark.parametrize("case", CASES.values(), ids=CASES)
def test_rays_of_every_value(case):
    """They are in the format, as many as asked for or fewer, and the easiest value is decided."""
    assert list(case.values) == sorted(set(case.values))
    for value in (case.values[0], case.values[-1], case.easiest):
        if case.is_of_chip and value != case.easiest:
            continue
        made = case.probe(value, 40, fmt=FMT, rng=case.rng(value))
        probe = getattr(made, "probe", made)
        for array in (probe.corners, probe.origins, probe.directions):
            assert (FMT.quantize(array) == array).all()
        assert 0 < probe.num_rays <= 40
        assert probe.directions.any(axis=1).all()
    assert probe.truth.is_decided.mean() > 0.5


def test_what_is_known_to_fail_does():
    """The figures of first trials: rays at edges slip through the chip's test, and not through a watertight one."""
    case = CASES["edges"]
    probe = case.probe(288, 2000, fmt=FMT, rng=case.rng(288))
    failures = {name: probe.verdict(METHODS[name]).is_failure.sum()
                for name in ("printed", "firm edges", "default", "Woop 2013")}
    assert 100 < failures["firm edges"] < failures["printed"] < 500
    assert failures["default"] <= 4
    assert failures["Woop 2013"] == 0
    assert probe.verdict(METHODS["firm edges"]).is_crack.sum() == failures["firm edges"]


def test_rays_without_a_direction_are_left_out():
    origins = np.array([(0.0, 0, 0), (1e5, 0, 0), (1e30, 0, 0)])
    rays = rounded_rays(FMT, origins, origins + (0.0, 0, 1e-3), np.random.default_rng(0))
    assert rays[2].tolist() == [True, True, False]
    rays = rounded_rays(FMT, origins, origins, np.random.default_rng(0))
    assert rays[2].tolist() == [False] * 3


@pytest.mark.parametrize(("failures", "limits"), [
    ((0, 0, 0, 0), (1, 4)), ((3, 0, 0, 1), (2, 3)), ((0, 0, 5, 0), None), ((0, 2, 0, 0), (3, 4))])
def test_limits(failures, limits):
    case = Case("x", "y", (1, 2, 3, 4), 3, None)
    assert limits_of(case, dict(zip(case.values, failures, strict=True))) == limits
