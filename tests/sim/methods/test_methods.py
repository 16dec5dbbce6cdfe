"""Each ray/triangle test against Cramer's rule in float64, and against exact fractions at edges."""

from fractions import Fraction

import numpy as np
import pytest

from fpu import FloatFormat
from sim.methods import METHODS, closest_hits, near_pairs
from sim.methods.closest import Pairs
from sim.methods.method import built
from sim.methods.tolerant import scaled_map, tolerant
from sim.methods.unit_triangle import stored_matrix
from sim.scene.triangles import turned, weights
from tests.triangles import aimed_rays

FINE, FMT = FloatFormat(8, 23), FloatFormat(7, 16)
COUNT = 4000


@pytest.fixture(scope="module")
def rays():
    return aimed_rays(FINE, COUNT)


@pytest.mark.parametrize("method", METHODS.values(), ids=METHODS)
def test_well_conditioned(method, rays):
    corners, origin, direction, exact, clear = rays
    stored, usable = method.store(FINE, corners)
    assert usable.all()
    found = method.test(FINE, stored, method.begin(FINE, origin, direction))
    inside = exact[3]
    assert (found.hit[clear] == inside[clear]).all()
    assert not found.is_soft[clear].any()
    first = turned(corners)[1] if method.stored is stored_matrix else np.zeros(len(corners), np.int8)
    for value, wanted in zip((found.t, *weights(first, found.u, found.v)), exact[:3], strict=True):
        assert value[clear & inside] == pytest.approx(wanted[clear & inside], abs=3e-4)


def test_operators():
    costs = {name: method.cost(FMT)[0] for name, method in METHODS.items()}
    for name in ("printed", "firm edges", "terms 8"):
        assert costs[name] == {"add": 12, "mul": 11, "div": 1, "cmp": 1}
    assert costs["default"] == costs["printed"] | {"cmp": 3}
    assert costs["fused"] == {"add": 6, "mul": 2, "div": 1, "cmp": 1, "dot": 3}
    assert costs["Möller-Trumbore"] == {"add": 18, "mul": 27, "div": 1, "cmp": 1}
    assert costs["Plücker"] == {"add": 23, "mul": 30, "div": 1, "cmp": 1}
    assert costs["Plücker, relative"] == {"add": 30, "mul": 35, "div": 2, "cmp": 1}
    assert costs["Wald's projection"] == {"add": 12, "mul": 10, "div": 1, "cmp": 1}
    assert METHODS["Woop 2013"].cost(FMT) == ({"add": 22, "mul": 21, "div": 1, "cmp": 1},
                                              {"add": 0, "mul": 0, "div": 3, "cmp": 3})


def test_the_largest_product():
    rng = np.random.default_rng(3)
    names = built(scaled_map, FMT).input_names
    values = {name: FMT.quantize(rng.normal(size=500)) for name in names if name != "is_point"}
    results = built(scaled_map, FMT).model(is_point=True, **values)
    for number, axis in enumerate("xyz"):
        products = [FMT.quantize(values[f"row{number}_{k}"] * FMT.quantize(values[f"vector_{k}"]
                                                                           - values[f"center_{k}"])) for k in "xyz"]
        assert (results[f"result_scale_{axis}"] == 2.0 ** np.floor(np.log2(np.abs(products).max(axis=0)))).all()


@pytest.mark.parametrize(("ulp", "options", "message"), [
    (3, {}, r"^Tolerance and cap must be powers of two, not 3 and 0\.125$"),
    (4, {"cap": 0.3}, r"^Tolerance and cap must be powers of two, not 4 and 0\.3$"),
    (4, {"bound": "none"}, "^Bound must be one of full, products, terms, not 'none'$")])
def test_bad_tolerances(ulp, options, message):
    with pytest.raises(ValueError, match=message):
        tolerant(ulp, **options)


@pytest.mark.parametrize(("method", "close", "reach"), [
    (METHODS["firm edges"], 1, 1), (METHODS["default"], 8, 16), (tolerant(2), 2, 4),
    (tolerant(8, bound="full"), None, 8), (tolerant(8, bound="products"), None, 8),
    (tolerant(8, bound="terms"), None, 8), (tolerant(2.0**14), 2**13, 2**13),
    (tolerant(2.0**14, bound="terms", cap=2.0**-10), None, 2**6)])
def test_tolerance_widens_by_what_it_says(method, close, reach):
    """Rays that meet the plane a few units in the last place beyond an edge; all terms are 1 there, but for the cap."""
    corners = np.array([[(0.0, 0, 0), (1, 0, 0), (0, 1, 0)]])
    off = np.array([0, 1, 2, 3, 7, 8, 9, 15, 16, 63, 64, 1023, 1024, 5000, 8191, 8192])
    distance = off * 2.0**-16
    stored, _ = method.store(FMT, corners)
    for origins in (np.stack([-1 - distance, np.full(len(off), 0.25), np.ones(len(off))], axis=1),
                    np.stack([distance - 0.5, np.full(len(off), 0.5), np.ones(len(off))], axis=1)):
        assert (FMT.quantize(origins) == origins).all()
        rays = method.begin(FMT, origins, np.tile((1.0, 0, -1), (len(off), 1)))
        found = method.test(FMT, {key: value[[0] * len(off)] for key, value in stored.items()}, rays)
        assert (found.hit | found.is_soft).tolist() == (off < reach).tolist()
        if found.is_soft.any():
            assert (found.is_soft & ~found.is_loose).tolist() == ((0 < off) & (off < close)).tolist()


def exact_hit(corners, origin, direction):
    """t of the hit by fractions, edges included, or None."""
    a, b, c = ([Fraction(float(x)) for x in corner] for corner in corners)
    o, d = ([Fraction(float(x)) for x in vector] for vector in (origin, direction))

    def less(p, q):
        return [x - y for x, y in zip(p, q, strict=True)]

    def cross(p, q):
        return [p[1] * q[2] - p[2] * q[1], p[2] * q[0] - p[0] * q[2], p[0] * q[1] - p[1] * q[0]]

    def dot(p, q):
        return sum(x * y for x, y in zip(p, q, strict=True))

    e1, e2, s = less(b, a), less(c, a), less(o, a)
    p, q = cross(d, e2), cross(s, e1)
    det = dot(e1, p)
    if det == 0:
        return None
    t, u, v = dot(e2, q) / det, dot(s, p) / det, dot(d, q) / det
    return t if t > 0 and u >= 0 and v >= 0 and u + v <= 1 else None


def test_closest_hits_by_fractions():
    """All triangles of a heap against each ray, exactly; the hits are as near as 8.23 allows."""
    rng = np.random.default_rng(8)
    corners = FINE.quantize(rng.uniform(-1, 1, (24, 1, 3)) + rng.uniform(-0.8, 0.8, (24, 3, 3)))
    origins = FINE.quantize(rng.uniform(2, 3, (60, 3)))
    directions = FINE.quantize(rng.uniform(-1, 1, (60, 3)) - origins)
    wanted = []
    for origin, direction in zip(origins, directions, strict=True):
        hits = [(exact_hit(triangle, origin, direction), number) for number, triangle in enumerate(corners)]
        wanted.append(min(((t, number) for t, number in hits if t is not None), default=(None, -1)))
    assert 15 < sum(number >= 0 for _, number in wanted) < 60
    everything = Pairs(np.arange(61) * 24, np.tile(np.arange(24), 60))
    near = near_pairs(corners, origins, directions, pad=np.full(24, 1e-3))
    assert len(near.triangle) < len(everything.triangle)
    for pairs in (everything, near):
        answers = closest_hits(METHODS["Woop 2013"], FINE, corners, origins, directions, pairs)
        assert answers.triangle.tolist() == [number for _, number in wanted]
        assert not answers.is_odd.any()
        for t, (exact, _) in zip(answers.t, wanted, strict=True):
            assert t == np.inf if exact is None else t == pytest.approx(float(exact), rel=1e-4)


def test_an_excluded_triangle():
    corners = np.array([[(-1.0, -1, 0), (1, -1, 0), (0, 1, 0)], [(-1, -1, -1), (1, -1, -1), (0, 1, -1)]])
    rays = np.tile((0.0, 0, 1), (2, 1)), np.tile((0.0, 0, -1), (2, 1))
    pairs = Pairs(np.array([0, 2, 4]), np.array([0, 1, 0, 1]))
    answers = closest_hits(METHODS["default"], FMT, corners, *rays, pairs, excluded=np.array([-1, 0]))
    assert answers.triangle.tolist() == [0, 1]
    assert answers.t.tolist() == [1.0, 2.0]


def test_what_has_no_area_is_left_out_where_there_is_a_matrix():
    corners = np.array([[(0.0, 0, 0), (1, 0, 0), (0, 1, 0)], [(0, 0, 0), (1, 1, 1), (2, 2, 2)]])
    for name, method in METHODS.items():
        assert method.store(FMT, corners)[1].tolist() == [True, not method.needs_area], name
    assert {name for name, method in METHODS.items() if not method.needs_area} == {
        "Möller-Trumbore", "Plücker", "Plücker, relative", "Woop 2013"}
