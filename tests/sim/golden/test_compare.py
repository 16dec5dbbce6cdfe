from dataclasses import replace

import numpy as np
import pytest

from sim.golden import Hits, compare, psnr


@pytest.fixture
def golden():
    t = np.array([[1.0, 2.0, 4.0], [8.0, np.inf, 16.0]])
    prim_id = np.array([[0, 1, 2], [3, -1, 5]], np.int32)
    zero = np.zeros((2, 3))
    return Hits(np.where(prim_id < 0, -1, 0).astype(np.int32), prim_id, t, zero, zero, zero)


def changed(hits, pixel, **values):
    """The same hits with some fields of one pixel changed."""
    fields = {}
    for name, value in values.items():
        fields[name] = getattr(hits, name).copy()
        fields[name][pixel] = value
    return replace(hits, **fields)


def test_equal(golden):
    result = compare(golden, golden)
    assert (result.num_pixels, result.num_wrong, result.num_ambiguous, result.num_cracks) == (6, 0, 0, 0)
    assert result.max_t_error == result.mean_t_error == 0


def test_error_of_t_is_relative_and_only_where_the_triangle_is_right(golden):
    other = changed(changed(golden, (0, 1), t=2.002), (1, 0), t=100.0, prim_id=7)
    result = compare(golden, other)
    assert result.max_t_error == pytest.approx(1e-3)
    assert result.mean_t_error == pytest.approx(1e-3 / 4)


def test_another_triangle_at_the_same_distance_is_ambiguous(golden):
    result = compare(golden, changed(golden, (0, 2), prim_id=9, t=4.0001))
    assert (result.num_wrong, result.num_ambiguous, result.num_cracks) == (1, 1, 0)


def test_a_second_surface_judges_ambiguity_if_given(golden):
    other = changed(golden, (0, 2), prim_id=9)
    apart, close = changed(golden, (0, 2), t=4.5), changed(golden, (0, 2), t=4.001)
    assert compare(golden, other, runner_up=apart).num_ambiguous == 0
    assert compare(golden, other, runner_up=close).num_ambiguous == 1


def test_the_same_triangle_of_another_instance_is_wrong(golden):
    assert compare(golden, changed(golden, (0, 0), instance_id=1)).num_wrong == 1


@pytest.mark.parametrize("values", [dict(instance_id=-1, prim_id=-1, t=np.inf), dict(prim_id=4, t=9.0), dict(t=8.1)])
def test_cracks(golden, values):
    result = compare(golden, changed(golden, (1, 0), **values))
    assert result.num_cracks == 1
    assert result.num_ambiguous == 0


def test_something_in_front_is_no_crack(golden):
    assert compare(golden, changed(golden, (1, 0), prim_id=4, t=1.0)).num_cracks == 0


def test_a_hit_instead_of_a_miss_is_wrong_but_no_crack(golden):
    result = compare(golden, changed(golden, (1, 1), instance_id=0, prim_id=4, t=1.0))
    assert (result.num_wrong, result.num_ambiguous, result.num_cracks) == (1, 0, 0)


def test_psnr():
    a = np.full((4, 4, 3), 100, np.uint8)
    assert psnr(a, a) == np.inf
    assert psnr(a, a + np.uint8(255 - 100)) == pytest.approx(20 * np.log10(255 / 155))
    # Differences downwards do not wrap around.
    assert psnr(a, a - np.uint8(100)) == pytest.approx(20 * np.log10(2.55))


@pytest.mark.parametrize("other", [np.zeros((2, 2, 3), np.uint8), np.zeros((4, 4, 3))])
def test_psnr_wants_pictures_of_one_shape(other):
    with pytest.raises(ValueError, match="uint8 of one shape"):
        psnr(np.zeros((4, 4, 3), np.uint8), other)
