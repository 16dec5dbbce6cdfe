"""Edges that give: the chip's datapaths against the definition, in fractions of powers of two."""

import math

import numpy as np
import pytest

from fpu import FloatFormat
from rtl.affine_map import affine_map
from rtl.arithmetic import ARITHMETICS
from rtl.unit_triangle import GRAZING, MARGIN, MAX_MARGIN, MAX_TOLERANCE, REACH, unit_triangle

FMT = FloatFormat(7, 16)
COUNT = 3000
FUSED = next(arithmetic for arithmetic in ARITHMETICS if arithmetic.fused)


def power(value):
    return 2.0 ** math.floor(math.log2(abs(value))) if value else 0.0


def raised(t, units):
    """So many units in the last place farther from 0."""
    bits = FMT.encode(abs(t)) + (units if 0 < abs(t) < np.inf else 0)
    return math.copysign(FMT.decode(np.minimum(bits, FMT.exp_inf << FMT.frac_width)), t)


def is_inside(u, v, total, limits):
    return all(x >= 0 or abs(x) < limit for x, limit in zip((u, v), limits, strict=True)) and (
        total <= 1 or total < 1 + max(limits))


def random(rng, shape, spread=6):
    return FMT.quantize(rng.normal(size=shape) * 2.0 ** rng.integers(-spread, spread, shape))


def test_scale_is_the_largest_product_s():
    rng = np.random.default_rng(1)
    rows, vector, center = random(rng, (COUNT, 3, 3)), random(rng, (COUNT, 3)), random(rng, (COUNT, 3))
    inputs = {f"row{row}_{axis}": rows[:, row, k] for row in range(3) for k, axis in enumerate("xyz")}
    inputs |= {f"vector_{axis}": vector[:, k] for k, axis in enumerate("xyz")}
    inputs |= {f"center_{axis}": center[:, k] for k, axis in enumerate("xyz")}
    plain, scaled = affine_map(FMT), affine_map(FMT, scaled=True)
    for is_point in (True, False):
        found = scaled.model(is_point=is_point, **inputs)
        without = plain.model(is_point=is_point, **inputs)
        moved = FMT.quantize(vector - center) if is_point else vector
        for row, axis in enumerate("xyz"):
            assert (found[f"result_{axis}"] == without[f"result_{axis}"]).all()
            products = FMT.quantize(rows[:, row] * moved)
            assert found[f"result_scale_{axis}"].tolist() == [max(map(power, three)) for three in products.tolist()]


def test_fused_sums_have_no_scale():
    with pytest.raises(ValueError) as error:
        affine_map(FMT, arithmetic=FUSED, scaled=True)
    assert str(error.value) == "No scale is known of dot products: arithmetic 'fused' cannot be scaled"


@pytest.mark.parametrize("ulp", [1, 8, 64])
def test_edges_give_by_what_was_lost(ulp):
    rng = np.random.default_rng(ulp)
    origin, direction = random(rng, (COUNT, 3), 2), random(rng, (COUNT, 3), 2)
    # Points close to an edge, or to the one across.
    t = -origin[:, 2] / direction[:, 2]
    place = rng.choice([0.0, 1e-5, -1e-5, -3e-4, -2e-2, 0.5, 1.0, 1.00002, 1.01, -1.5 * ulp * 2.0**-16], (COUNT, 2))
    origin[:, :2] = FMT.quantize(place - t[:, None] * direction[:, :2])
    scales = {name: np.array([[power(x) for x in vector] for vector in values]) * 2.0 ** rng.integers(0, 6, (COUNT, 3))
              for name, values in (("origin", origin), ("direction", direction))}
    tolerance = ulp * 2.0**-16
    inputs = {f"{name}_{axis}": values[:, k] for name, values in (("origin", origin), ("direction", direction))
              for k, axis in enumerate("xyz")}
    # What is to be beaten lies on either side of what is found.
    t_hit = FMT.quantize(np.abs(t) * (1 + rng.choice([-3, -1, 0, 1, 3, 6], COUNT) * ulp * 2.0**-16))
    inputs["t_hit"] = np.where(rng.random(COUNT) < 0.1, np.inf, t_hit)
    tolerant = inputs | {f"{name}_scale_{axis}": values[:, k] for name, values in scales.items()
                         for k, axis in enumerate("xyz")} | {"tolerance": np.full(COUNT, tolerance),
                                                           "margin": np.full(COUNT, MARGIN * tolerance)}
    # One that waits is near as often as not.
    for name in ("soft_front", "soft_back"):
        t_soft = FMT.quantize(np.abs(t) * (1 + rng.choice([-1.5, -0.9, 0, 0.9, 1.5], COUNT) * REACH))
        tolerant[name] = np.where(rng.random(COUNT) < 0.3, np.inf, t_soft)
    for name in ("front_is_loose", "back_is_loose"):
        tolerant[name] = rng.random(COUNT) < 0.5
    plain, found = unit_triangle(FMT).model(**inputs), unit_triangle(FMT, tolerant=True).model(**tolerant)
    hits = beaten = waits = waits_behind = capped = 0
    loose_pairs = loose_apart = 0
    for i in range(COUNT):
        u, v, t = (float(plain[name][i]) for name in ("u", "v", "t"))
        assert (u, v, t) == tuple(float(found[name][i]) for name in ("u", "v", "t"))
        loss = scales["direction"][i, 2] / power(direction[i, 2])
        lost = [max(scales["origin"][i, k], power(FMT.quantize(t * direction[i, k])) * loss) for k in (0, 1)]
        total, times = float(FMT.quantize(u + v)), 1 if loss > GRAZING else 2
        inside, close = (is_inside(u, v, total, [min(units * part, MAX_TOLERANCE) for part in lost])
                         for units in (times * tolerance, tolerance))
        is_loose = not close
        is_firm, ahead = u >= 0 and v >= 0 and total <= 1, 0 < t < np.inf
        side = "back" if math.copysign(1, direction[i, 2]) < 0 else "front"
        waiting, other_is_loose = float(tolerant[f"soft_{side}"][i]), bool(tolerant[f"{side}_is_loose"][i])
        units = times * MARGIN * ulp * loss
        later, reach = raised(t, int(min(units, MAX_MARGIN * 2**16))), int(REACH * 2**16)
        pairs = waiting <= raised(t, reach) and t <= raised(waiting, reach)
        if inside and ahead and not is_firm and is_loose:
            assert found["is_loose"][i]
            loose_pairs += pairs and not other_is_loose
            loose_apart += pairs and other_is_loose
        pairs &= not (is_loose and other_is_loose)
        assert bool(found["hit"][i]) == (inside and ahead and (is_firm or pairs))
        is_nearer = (t if is_firm else later) < tolerant["t_hit"][i]
        assert bool(found["is_soft"][i]) == (inside and ahead and not is_firm and not pairs and is_nearer)
        assert not found["is_soft"][i] or bool(found["is_loose"][i]) == is_loose
        waits += bool(found["is_soft"][i])
        waits_behind += bool(found["is_soft"][i]) and waiting < t
        capped += not is_firm and units > MAX_MARGIN * 2**16
        hits += bool(found["hit"][i]) and not plain["hit"][i]
        # A hit by tolerance alone has to be nearer by the margin.
        key = t if is_firm else later
        assert found["key"][i] == key
        assert bool(found["nearer"][i]) == (key < inputs["t_hit"][i])
        beaten += bool(found["nearer"][i]) != bool(plain["nearer"][i])
        # Nothing is lost.
        assert found["hit"][i] or not plain["hit"][i]
    assert hits > COUNT / 200
    assert beaten > COUNT / 20
    assert waits > COUNT / 200
    assert waits_behind > 0
    assert (capped > 0) == (ulp == 64)
    assert min(loose_pairs, loose_apart) > 0
