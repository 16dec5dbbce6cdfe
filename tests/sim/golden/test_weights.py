"""Opacity, what goes through, and how weights share the light."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sim.golden import shade_full
from sim.scene import Camera, Light, Material

from .rooms import CHECKED, DOWN, FAR, ball, ground, leaf, lit, quad, scene_of, see


def test_alpha_modes():
    light = [Light("directional", direction=DOWN)]
    glow = Material("glow", (0, 0, 0), emission=(1.0, 1.0, 1.0))

    def seen(x, y, **others):
        material = Material("m", (1.0, 1.0, 1.0), CHECKED, **others)
        return see(scene_of(leaf(material, 1), ground(glow), lights=light), (x, y, 2), DOWN)

    assert seen(1.5, 0.5, alpha_mode="opaque").tolist() == [0, 1, 0]
    assert seen(1.5, 0.5, alpha_mode="mask").tolist() == [1, 1, 1]
    assert seen(0.5, 1.5, alpha_mode="mask", alpha_cutoff=64 / 255).tolist() == [0, 0, 1]
    assert seen(0.5, 1.5, alpha_mode="mask", alpha_cutoff=65 / 255).tolist() == [1, 1, 1]
    a = 64 / 255
    assert seen(0.5, 1.5, alpha_mode="blend") == pytest.approx((1 - a, 1 - a, 1))
    a *= 102 / 255
    assert seen(0.5, 1.5, alpha_mode="blend", opacity=0.4) == pytest.approx((1 - a, 1 - a, 1))
    assert seen(1.5, 0.5, alpha_mode="blend").tolist() == [1, 1, 1]


def test_shadows_of_leaves_veils_and_coloured_glass():
    light = [Light("point", position=(1, 1, 400), intensity=400.0**2)]

    def lit_through(x, y, material):
        # Straight down under the leaf, looked at from below it.
        scene = scene_of(leaf(material, 1), ground(), lights=light)
        return see(scene, (x, y, 0.5), DOWN)

    white = Material("m", (1.0, 1.0, 1.0), CHECKED)
    assert lit_through(0.5, 0.5, white).tolist() == [0, 0, 0]
    assert lit_through(1.5, 0.5, white).tolist() == [0, 0, 0]
    masked = replace(white, alpha_mode="mask")
    assert lit_through(0.5, 0.5, masked).tolist() == [0, 0, 0]
    assert lit_through(1.5, 0.5, masked) == pytest.approx((1, 1, 1), rel=1e-4)
    assert lit_through(0.5, 1.5, replace(white, alpha_mode="blend")) == pytest.approx([1 - 64 / 255] * 3, rel=1e-4)
    pane = Material("pane", (1.0, 0.0, 0.2), transmission=0.8, reflection=0.2)
    tint = lit(Light("directional", direction=DOWN), material=Material("m", pane.base_color))
    expected = tint * (1 - 51 / 255) * 204 / 255
    assert lit_through(0.5, 0.5, pane) == pytest.approx(expected, rel=1e-4)
    scene = scene_of(leaf(pane, 1), leaf(pane, 1.5), ground(), lights=light)
    assert see(scene, (0.5, 0.5, 0.5), DOWN) == pytest.approx(expected * expected, rel=1e-4)


def test_rays_end_in_the_65th_hole():
    holes = Material("m", (1.0, 1.0, 1.0), CHECKED, alpha_mode="mask")
    for count, color, spent in ((64, 1.0, 0), (65, 0.0, 1)):
        leaves = [leaf(holes, 1 + k) for k in range(count)]
        scene = scene_of(*leaves, ground(), lights=[Light("point", position=(1.5, 0.5, 0.7), intensity=0.49)])
        colors, levels = shade_full(scene, (1.5, 0.5, 99), np.array([[DOWN]]))
        assert colors[0, 0, 0] == pytest.approx(color)
        assert levels[0]["spent"] == spent
        lamp = Light("point", position=(1.5, 0.5, 100), intensity=1e4)
        assert see(replace(scene, lights=[lamp]), (1.5, 0.5, 0.5), DOWN)[0] == pytest.approx(color)


share = st.integers(0, 255).map(lambda n: n / 255)
color = st.tuples(share, share, share)


@st.composite
def any_material(draw):
    return Material("any", draw(color), reflection=draw(share), transmission=draw(share), ior=draw(st.floats(0.5, 3)),
                    fresnel=draw(st.booleans()), tinted=draw(st.booleans()), thin=draw(st.booleans()),
                    opacity=draw(share), alpha_mode=draw(st.sampled_from(("opaque", "blend"))))


CAMERA = Camera((0, -2.5, 0.4), (0, 0, 0), (0, 0, 1), 40.0)


@settings(max_examples=40, deadline=None)
@given(any_material(), any_material())
def test_nothing_is_brighter_than_what_lights_it(outer, inner):
    """In white surroundings and white ambient light, no colour exceeds 1, and more generations only add."""
    scene = scene_of(ball((0, 0, 0), 1.0, outer, num_rings=8), ball((0, 0, 0), 0.5, inner, num_rings=6),
                     lights=[FAR], ambient=(1.0, 1.0, 1.0))
    previous = np.zeros((12, 16, 3))
    for depth in (0, 1, 3):
        colors, _ = shade_full(scene, *CAMERA.rays(16, 12), depth=depth, background=(255, 255, 255))
        assert (colors <= 1 + 1e-9).all()
        assert (colors >= previous - 1e-12).all()
        previous = colors


@settings(max_examples=40, deadline=None)
@given(any_material())
def test_white_in_white_surroundings_stays_white(material):
    """Weights of local light, reflection, refraction and what is behind sum to 1, so a white plate vanishes."""
    plate = quad([(-9, -9, 0), (9, -9, 0), (9, 9, 0), (-9, 9, 0)], replace(material, base_color=(1.0, 1.0, 1.0)))
    scene = scene_of(plate, lights=[FAR], ambient=(1.0, 1.0, 1.0))
    for origin in ((0.3, 0.1, 1.0), (0.3, 0.1, -1.0)):
        colors = see(scene, origin, np.array([(0.1, 0.2, -0.5), (0.9, 0.1, -0.2)]) * (1, 1, origin[2]), depth=1,
                     background=(255, 255, 255))
        assert colors == pytest.approx(1.0, abs=2**-11)
