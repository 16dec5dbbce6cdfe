"""What rays of a packet may hit: between t_near and t_far, not their own triangle, anything or the closest."""

import numpy as np
import pytest

from fpu import FloatFormat
from sim.model.packet import ANY_HIT, COUNTS, HAS_LIMIT, trace_packet
from sim.scene import Material
from sim.scene.compile import CompiledScene

from ..golden.rooms import quad, scene_of

FORMAT = FloatFormat(7, 16)
SOLID, CLEAR = Material("solid", (1, 1, 1)), Material("clear", (1, 1, 1), transmission=1.0)


def sheets(*materials, flatten=True):
    """Sheets one above the other, at z = −1 + 2k/(n − 1) on the chip."""
    scene = scene_of(*(quad([(-3, -3, k), (3, -3, k), (3, 3, k), (-3, 3, k)], material)
                       for k, material in enumerate(materials)))
    return CompiledScene(scene, fmt=FORMAT, flatten=flatten).image(scene)


def trace(image, *, near=0.0, far=None, flags=0, excluded=(-1, -1), origins=None, shared=True):
    """Rays upwards from below all sheets: (hits, owners as the scene's instance numbers, counts)."""
    counts = np.zeros(len(COUNTS), np.int64)
    hits, owners = np.zeros((4, 4)), np.zeros((4, 2), np.int64)
    if origins is None:
        origins = np.tile((0.1, 0.3, -2.0), (4, 1))
    directions = np.array([(x, y, 1.0) for x in (0.0, 0.01) for y in (0.0, 0.01)])
    limits = np.tile((near, far or 0.0), (4, 1))
    assert trace_packet(0, FORMAT.params, image.root, image.nodes[:, 0].astype(np.int64), image.split_values(),
                        image.lists.astype(np.int64), image.matrix_values(), 4, 32, 0.0, FORMAT.quantize(origins),
                        FORMAT.quantize(directions), 15, limits, np.tile(np.array(excluded), (4, 1)),
                        np.full(4, flags | (0 if far is None else HAS_LIMIT)), shared, hits, owners, counts)
    missed = owners[:, 0] < 0
    instance, _ = image.owners(owners[:, 0], owners[:, 1])
    return hits, np.where(missed, -1, instance), owners, dict(zip(COUNTS, counts.tolist(), strict=True))


@pytest.mark.parametrize("flatten", [True, False])
def test_from_sheet_to_sheet(flatten):
    image = sheets(*[SOLID] * 4, flatten=flatten)
    near = 0.0
    for number in range(4):
        hits, instance, *_ = trace(image, near=near)
        assert (instance == number).all()
        # Strictly onwards: what has been met at t_near is not met again.
        assert (hits[:, 0] > near).all()
        near = float(hits[0, 0])
    assert (trace(image, near=near)[1] == -1).all()


@pytest.mark.parametrize("flatten", [True, False])
def test_a_triangle_is_excluded_in_its_instance_alone(flatten):
    image = sheets(SOLID, SOLID, flatten=flatten)
    _, instance, owners, _ = trace(image)
    assert (instance == 0).all()
    triangle, number = owners[0]
    assert (trace(image, excluded=(triangle, number))[1] == 1).all()
    assert (trace(image, excluded=(triangle, number + 1))[1] == 0).all()


def test_nothing_at_t_far_or_beyond():
    image = sheets(SOLID, SOLID)
    distance = float(trace(image)[0][0, 0])
    assert (trace(image, far=distance)[1] == -1).all()
    assert (trace(image, far=distance)[0][:, 0] == distance).all()
    assert (trace(image, far=np.nextafter(distance, 9))[1] == 0).all()
    assert (trace(image, near=distance, far=np.inf)[1] == 1).all()


@pytest.mark.parametrize("flatten", [True, False])
def test_any_solid_triangle_ends_a_ray(flatten):
    image = sheets(SOLID, SOLID, SOLID, flatten=flatten)
    hits, instance, _, counts = trace(image, far=np.inf, flags=ANY_HIT)
    assert (hits[:, 0] == 0.0).all()
    assert (instance >= 0).all()
    assert counts["triangle_tests"] <= trace(image, far=np.inf)[3]["triangle_tests"]


def test_what_light_goes_through_ends_no_ray():
    image = sheets(CLEAR, CLEAR, SOLID)
    hits, instance, _, _ = trace(image, far=np.inf, flags=ANY_HIT)
    assert (instance == 0).all()
    assert (hits[:, 0] > 0.0).all()
    hits, instance, _, _ = trace(image, near=float(hits[0, 0]), far=np.inf, flags=ANY_HIT)
    assert (instance == 1).all()
    hits, instance, _, _ = trace(image, near=float(hits[0, 0]), far=np.inf, flags=ANY_HIT)
    assert (instance == 2).all()
    assert (hits[:, 0] == 0.0).all()


@pytest.mark.parametrize("flatten", [True, False])
def test_a_shared_origin_is_transformed_once(flatten):
    image = sheets(SOLID, SOLID, SOLID, flatten=flatten)
    once, each = trace(image), trace(image, shared=False)
    assert (once[0] == each[0]).all()
    assert (once[2] == each[2]).all()
    vectors, tests = once[3]["transformed_vectors"], once[3]["triangle_tests"]
    entered = once[3]["instances"]
    # A vector for each direction, and one for each origin.
    assert each[3]["transformed_vectors"] == 2 * (tests + 4 * entered)
    assert vectors < each[3]["transformed_vectors"]
