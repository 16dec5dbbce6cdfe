"""Triangles that a format makes vanish, and meshes of nothing else."""

import pytest

from fpu import FloatFormat
from rtl.config import ChipConfig
from sim.model import render_model
from sim.scene import Camera, Material, SceneError
from sim.scene.compile import CompiledScene
from tests.sim.golden.rooms import quad, scene_of

NARROW, WIDE = FloatFormat(5, 10), FloatFormat(8, 23)
THIN = quad([(0, 0, 1), (1e-7, 0, 1), (1e-7, 1, 1), (0, 1, 1)], Material("thin", (1.0, 1.0, 1.0)))
SQUARE = quad([(-1, -1, 0), (1, -1, 0), (1, 1, 0), (-1, 1, 0)], Material("square", (0.2, 0.5, 1.0)))
CAMERA = Camera((0.1, 0.2, 3), (0, 0, 0), (0, 1, 0), 50.0)


def picture(compiled, scene, fmt):
    return render_model(compiled.image(scene, eye=CAMERA.eye), CAMERA, 16, 12, config=ChipConfig(fmt=fmt))


@pytest.mark.parametrize("flatten", [True, False])
def test_a_mesh_that_vanishes(flatten):
    scene, alone = scene_of(THIN, SQUARE), scene_of(SQUARE)
    compiled = CompiledScene(scene, fmt=NARROW, flatten=flatten)
    assert compiled.warnings == [
        f"mesh '{'scene' if flatten else 'quad'}': 2 triangles dropped that have no area once their vertices are "
        "rounded to format 5.10"]
    if not flatten:
        assert compiled.image(scene).num_instances == 1
    frame = picture(compiled, scene, NARROW)
    assert set(frame.instance_id.ravel().tolist()) == {-1, 1}
    other = picture(CompiledScene(alone, fmt=NARROW, flatten=flatten), alone, NARROW)
    assert ((frame.instance_id == 1) == (other.instance_id == 0)).all()


@pytest.mark.parametrize("flatten", [True, False])
def test_nothing_is_left(flatten):
    scene = scene_of(THIN)
    message = (r"^nothing is left of the scene: no triangle has an area once its vertices are rounded to format 5\.10; "
               "choose a format with more bits$")
    with pytest.raises(SceneError, match=message):
        CompiledScene(scene, fmt=NARROW, flatten=flatten)
    assert not CompiledScene(scene, fmt=WIDE, flatten=flatten).warnings
