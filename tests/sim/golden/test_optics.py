"""Directions of secondary rays, against the laws that define them."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sim.golden.optics import offset, reflect, refract, schlick

coordinate = st.floats(-1, 1)
vector = st.tuples(coordinate, coordinate, coordinate).filter(lambda v: np.linalg.norm(v) > 0.05)


def opposed(direction, normal):
    """The pair as arrays, the normal a unit vector against the direction; None where it is nearly in the surface."""
    direction, normal = np.array(direction), np.array(normal) / np.linalg.norm(normal)
    c = direction @ normal
    if abs(c) < 1e-3:
        return None
    return direction, -normal * np.sign(c)


def sine(direction, normal):
    return np.linalg.norm(np.cross(direction, normal)) / np.linalg.norm(direction)


@settings(max_examples=300, deadline=None)
@given(vector, vector)
def test_reflection_keeps_angle_length_and_plane(direction, normal):
    if (pair := opposed(direction, normal)) is None:
        return
    direction, normal = pair
    mirrored = np.array(reflect(tuple(direction), tuple(normal), direction @ normal))
    assert np.linalg.norm(mirrored) == pytest.approx(np.linalg.norm(direction), rel=1e-12)
    assert mirrored @ normal == pytest.approx(-(direction @ normal), rel=1e-9)
    assert np.cross(mirrored - direction, normal) == pytest.approx(np.zeros(3), abs=1e-12)


@settings(max_examples=500, deadline=None)
@given(vector, vector, st.floats(0.3, 3.0))
def test_refraction_obeys_snell(direction, normal, eta):
    if (pair := opposed(direction, normal)) is None:
        return
    direction, normal = pair
    kappa, bent = refract(tuple(direction), tuple(normal), direction @ normal, direction @ direction, eta)
    before = sine(direction, normal)
    if eta * before > 1 + 1e-9:
        assert kappa < 0
        return
    if eta * before > 1 - 1e-9:
        return
    bent = np.array(bent)
    # n₁ sin θ₁ = n₂ sin θ₂ with η = n₁/n₂.
    assert abs(eta * before - sine(bent, normal)) < 1e-9
    assert bent @ normal == pytest.approx(-kappa, abs=1e-9)
    assert bent @ normal < 0
    assert np.linalg.norm(bent) == pytest.approx(np.linalg.norm(direction), rel=1e-9)
    # In the plane of incidence, and on along the surface, not back.
    assert np.cross(direction, normal) @ bent == pytest.approx(0, abs=1e-9)
    assert (bent - (bent @ normal) * normal) @ direction >= -1e-12


def test_total_reflection_begins_at_the_critical_angle():
    for index in (1.1, 1.33, 1.5, 2.4):
        critical = math.asin(1 / index)
        for angle, is_total in ((critical - 1e-9, False), (critical + 1e-9, True)):
            direction = math.sin(angle), 0.0, -math.cos(angle)
            kappa, _ = refract(direction, (0.0, 0.0, 1.0), direction[2], 1.0, index)
            assert (kappa < 0) == is_total


@settings(max_examples=200, deadline=None)
@given(vector, vector, vector, st.floats(0.4, 1.0), st.floats(0.1, 50))
def test_one_matrix_makes_all_rays(origin, direction, normal, eta, t):
    """T_R = [D, N, O; 0] of docs/shading.md 3.6: points with third coordinate 1, directions with 0."""
    if (pair := opposed(direction, normal)) is None:
        return
    direction, normal = pair
    matrix, c, d2 = np.column_stack([direction, normal, origin]), direction @ normal, direction @ direction
    point = np.array(origin) + t * direction
    exponent = math.floor(math.log2(max(np.abs(origin).max(), np.abs(point).max())))
    e = 8 * 2.0 ** (exponent - 52)
    for side in (1.0, -1.0):
        moved = np.array(offset(tuple(point), tuple(normal), tuple(origin), side))
        assert moved == pytest.approx(matrix @ (t, side * e, 1), rel=1e-12, abs=1e-12)
        assert (moved - point) @ normal * side > 0.5 * e
    assert reflect(tuple(direction), tuple(normal), c) == pytest.approx(matrix @ (1, -2 * c, 0), abs=1e-12)
    kappa, bent = refract(tuple(direction), tuple(normal), c, d2, eta)
    assert bent == pytest.approx(matrix @ (eta, -(eta * c + kappa), 0), abs=1e-12)
    assert kappa == pytest.approx(math.sqrt(d2 - eta**2 * (d2 - c**2)))


def test_the_papers_refraction_bends_back():
    """μN − ηD with the ray's own D: beneath the surface, but along it the wrong way (DESIGN §7)."""
    direction, normal, eta = np.array((0.6, 0, -0.8)), np.array((0, 0, 1.0)), 1 / 1.5
    c = normal @ direction
    printed = (eta * c - math.sqrt(1 - eta**2 + (eta * c) ** 2)) * normal - eta * direction
    _, bent = refract(tuple(direction), tuple(normal), c, 1.0, eta)
    assert printed == pytest.approx((-bent[0], 0, bent[2]))


@given(st.floats(0, 1), st.floats(0, 1))
def test_schlick_is_between_its_ends(facing, cosine):
    value = schlick(facing, cosine)
    assert facing <= value <= 1
    assert schlick(facing, 1.0) == facing
    assert schlick(facing, 0.0) == pytest.approx(1)
    assert value == pytest.approx(facing + (1 - facing) * (1 - cosine) ** 5)
