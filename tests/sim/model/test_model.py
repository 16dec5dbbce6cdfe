"""The model against golden: float64, another index, another intersection test."""

import numpy as np
import pytest

from fpu import FloatFormat
from rtl.config import ChipConfig
from sim.golden import render_golden
from sim.model import render_model
from sim.scene import load_scene
from sim.scene.compile import compile_scene

from ..machine.scenes import instances_scene, soup_scene

SIZE = 160, 120


def compare(scene, fmt, **options):
    image = compile_scene(scene, fmt=fmt, **options)
    model = render_model(image, scene.default_camera(), *SIZE, config=ChipConfig(fmt=fmt))
    return model, render_golden(scene, scene.default_camera(), *SIZE)


@pytest.mark.parametrize(("fmt", "most_wrong", "t_error"), [
    (FloatFormat(7, 16), 2e-3, 1e-4), (FloatFormat(8, 23), 1e-4, 1e-6), (FloatFormat(6, 12), 3e-2, 2e-3)])
def test_room(fmt, most_wrong, t_error):
    model, golden = compare(load_scene("room"), fmt)
    same = ~model.differs_in_surface(golden)
    assert 1 - same.mean() <= most_wrong
    # The rest are rays that graze their surface.
    assert np.quantile(np.abs(model.t / golden.t - 1)[same], 0.99) <= t_error
    assert np.quantile(np.abs(model.color.astype(int) - golden.color)[same], 0.99) <= 1


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize("build", [instances_scene, soup_scene])
def test_random_scenes(build, seed):
    model, golden = compare(build(seed), FloatFormat(8, 23))
    assert model.differs_in_surface(golden).mean() <= 1e-3


def test_weights_are_of_the_second_and_third_corner():
    scene = load_scene("room")
    model, golden = compare(scene, FloatFormat(8, 23))
    same = ~model.differs_in_surface(golden)
    assert np.quantile(np.abs(model.u - golden.u)[same], 0.99) < 1e-5
    assert np.quantile(np.abs(model.v - golden.v)[same], 0.99) < 1e-5


def test_a_stack_that_is_too_small_is_an_error():
    scene = load_scene("room")
    image = compile_scene(scene, fmt=FloatFormat(7, 16))
    with pytest.raises(OverflowError, match=r"the packet at pixel \(\d+, \d+\) needs more than the 2 stack entries of "
                                            "the chip"):
        render_model(image, scene.default_camera(), *SIZE, config=ChipConfig(stack_depth=2))
