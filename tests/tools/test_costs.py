"""The cost tables: that what is counted works, and that it is counted right."""

import json
from pathlib import Path

import numpy as np
import pytest

from fpu import FloatFormat
from sim.methods.plucker import plucker_test
from sim.methods.projection import projection_test
from tests.triangles import aimed_rays
from tools.costs import COLUMNS, cost_tables, measured_luts
from tools.designs import ray_shader

# Designs are counted without being built.
pytestmark = pytest.mark.filterwarnings("ignore::amaranth.hdl.UnusedElaboratable")

FMT = FloatFormat(8, 23)
RESULTS = Path(__file__).parents[2] / "docs" / "results" / "fpu.json"
COUNT = 4000


def named(name, array):
    return {f"{name}_{axis}": FMT.quantize(array[:, k]) for k, axis in enumerate("xyz")}


@pytest.fixture(scope="module")
def rays():
    return aimed_rays(FMT, COUNT)


def judged(results, rays, t_hit):
    *_, (t, u, v, inside), clear = rays
    assert (results["hit"][clear] == inside[clear]).all()
    for name, exact in (("t", t), ("u", u), ("v", v)):
        assert results[name][clear & inside] == pytest.approx(exact[clear & inside], abs=3e-4)
    decided = clear & (np.abs(t - t_hit) > 1e-3)
    assert (results["nearer"][decided] == (t < t_hit)[decided]).all()


def test_projection_test(rays):
    corners, origin, direction, *_ = rays
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    k = np.abs(normal).argmax(axis=1)
    assert (np.bincount(k) > COUNT / 10).all()
    each, axes = np.arange(COUNT), np.stack([k, (k + 1) % 3, (k + 2) % 3])
    n_k, n_u, n_v = normal[each, axes]
    ones, stored = np.ones(COUNT), {}
    # The lines are solved for: 1 at their own corner and 0 at the two others.
    projected = np.stack([corners[each[:, None], range(3), axes[1][:, None]],
                          corners[each[:, None], range(3), axes[2][:, None]], np.stack([ones] * 3, axis=1)], axis=2)
    for name, corner in (("b", 1), ("c", 2)):
        line = np.linalg.solve(projected, np.broadcast_to(np.eye(3)[corner], (COUNT, 3))[..., None])[..., 0]
        stored |= {f"{name}_{axis}": FMT.quantize(line[:, i]) for i, axis in enumerate("uvd")}
    stored |= {"n_u": FMT.quantize(n_u / n_k), "n_v": FMT.quantize(n_v / n_k),
               "n_d": FMT.quantize((normal * corners[:, 0]).sum(axis=1) / n_k)}
    dp = projection_test(FMT)
    judged(dp.model(**named("origin", origin), **named("direction", direction), along_x=k == 0, along_y=k == 1,
                    t_hit=0.75, **stored), rays, 0.75)
    assert dp.cost() == {"add": 12, "mul": 10, "div": 1, "cmp": 1}


@pytest.mark.parametrize(("stored", "cost"), [(True, (23, 30)), (False, (49, 51))])
def test_plucker_test(rays, stored, cost):
    corners, origin, direction, *_ = rays
    constants = {}
    if stored:
        for i in range(3):
            start, end = corners[:, (i + 1) % 3], corners[:, (i + 2) % 3]
            constants |= named(f"moment{i}", np.cross(start, end)) | named(f"edge{i}", end - start)
        normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        constants |= named("normal", normal) | {"distance": FMT.quantize((normal * corners[:, 0]).sum(axis=1))}
    else:
        for i in range(3):
            constants |= named(f"corner{i}", corners[:, i])
    dp = plucker_test(FMT, stored=stored)
    judged(dp.model(**named("origin", origin), **named("direction", direction), t_hit=0.75, **constants), rays, 0.75)
    assert dp.cost() == dict(zip(COLUMNS, (*cost, 1, 1), strict=True))


@pytest.mark.parametrize("refraction", [False, True])
def test_ray_shader(refraction):
    rng = np.random.default_rng(6)
    origin, light = rng.uniform(-2, 2, (2, COUNT, 3))
    direction, normal = rng.normal(size=(2, COUNT, 3))
    direction, normal = (a / np.linalg.norm(a, axis=1, keepdims=True) for a in (direction, normal))
    normal *= -np.sign((direction * normal).sum(axis=1, keepdims=True))
    cosine, t, epsilon, eta = (direction * normal).sum(axis=1), rng.uniform(0, 4, COUNT), 2.0**-10, 0.7
    inputs = dict(named("origin", origin), **named("direction", direction), **named("normal", normal),
                  **named("light", light), t=FMT.quantize(t), epsilon=epsilon, twice_cosine=FMT.quantize(2 * cosine))
    kinds = ["is_shadow", "is_reflection"]
    if refraction:
        kinds.append("is_refraction")
        inputs |= {"cosine": FMT.quantize(cosine), "eta": FMT.quantize(eta),
                   "one_minus_eta2": FMT.quantize(1 - eta**2)}
    dp = ray_shader(FMT, refraction=refraction)

    def rays(kind):
        results = dp.model(**inputs, **{name: name == kind for name in kinds})
        return (np.stack([results[f"{name}_{axis}_out"] for axis in "xyz"], axis=1)
                for name in ("origin", "direction"))

    point = origin + t[:, None] * direction
    start, way = rays("is_shadow")
    assert start == pytest.approx(light, abs=1e-6)
    assert start + way == pytest.approx(point, abs=3e-6)
    start, way = rays("is_reflection")
    assert start == pytest.approx(point - epsilon * direction, abs=3e-6)
    # The angles to the normal are alike, and ray, normal and reflection lie in a plane.
    assert (way * normal).sum(axis=1) == pytest.approx(-cosine, abs=3e-6)
    assert np.linalg.norm(way, axis=1) == pytest.approx(1, abs=3e-6)
    assert (np.cross(direction, normal) * way).sum(axis=1) == pytest.approx(0, abs=3e-6)
    start, way = rays("none of them")
    assert start == pytest.approx(point + epsilon * direction, abs=3e-6)
    assert way == pytest.approx(direction, abs=1e-6)
    if refraction:
        _, way = rays("is_refraction")
        # Snell's law, as sines.
        assert np.cross(way, normal) == pytest.approx(eta * np.cross(direction, normal), abs=3e-6)
        assert np.linalg.norm(way, axis=1) == pytest.approx(1, abs=3e-6)
        assert ((way * normal).sum(axis=1) < 0).all()
    assert sum(dp.cost().values()) == (21 if refraction else 13)


def test_tables():
    luts = {"add": 300, "mul": 100, "div": 500, "cmp": 50, "sqrt": 250}
    tables = cost_tables(luts=luts)
    json.dumps(tables)
    rows = {row["unit"]: row for row in tables["table2"]}
    # As a pipeline the chip has just what the paper's has; one comparison is in another unit.
    assert [rows["total"][column] for column in COLUMNS] == [16, 11, 5, 13]
    assert rows["total"]["paper"] == {column: rows["total"][column] for column in COLUMNS}
    assert [rows["intersection"][column] for column in COLUMNS] == [3, 2, 1, 1]
    assert [rows["intersection, rays with t_near"][column] for column in COLUMNS] == [3, 2, 1, 2]
    parts = {part["part"]: part for part in tables["parts"]}
    assert parts["T"]["luts"] == 9 * 300 + 9 * 100
    assert parts["S with refraction"]["luts"] == 9 * 300 + 11 * 100 + 250
    ratios = {(row["design"], row["variant"], row["by"]): row for row in tables["table1"]}
    assert ratios["static", "", "units"]["without_traversal"] == (18 + 7) / (24 + 13)
    assert ratios["dyn2", "", "units"]["full"] == (20 + 18 + 7) / (20 + 18 + 24 + 13)
    assert ratios["dyn3", "", "units"]["paper"] == {"without_traversal": 0.23, "full": 0.32}
    assert ratios["static", "refraction", "luts"]["full"] == pytest.approx(
        (parts["K"]["luts"] + parts["T"]["luts"] + parts["I"]["luts"])
        / sum(parts[name]["luts"] for name in ("K", "I_w", "S with refraction")))
    assert {row["by"] for row in cost_tables()["table1"]} == {"units"}


def test_measured_luts(tmp_path):
    luts = measured_luts(RESULTS, fmt=FloatFormat(7, 16))
    assert luts.keys() == {"add", "mul", "div", "cmp", "sqrt"}
    assert luts["cmp"] < luts["mul"] < luts["add"]
    with pytest.raises(ValueError, match=r"fpu\.json: no Adder, .* of format 3\.3, grade 6; measure them with dynrt "
                                         "fpu-report"):
        measured_luts(RESULTS, fmt=FloatFormat(3, 3))
