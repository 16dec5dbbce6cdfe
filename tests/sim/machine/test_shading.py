"""The chip with a shader against its model: every pixel's colour, whatever the memories' latencies."""

from dataclasses import replace

import numpy as np
import pytest

from rtl.config import ChipConfig
from rtl.program.features import ShaderFeatures
from sim.machine import render_rtl
from sim.model import render_full
from sim.scene import Camera, Light, Material, Sky, load_scene
from sim.scene.compile import CompiledScene

from ..golden.rooms import CHECKED, ball, quad, scene_of

# Compiled chips are kept; one worker for all of these compiles each only once.
pytestmark = [pytest.mark.chip, pytest.mark.xdist_group("shading_chip")]

SWITCHES = ("reflection", "refraction", "transparency", "textures", "highlights", "fresnel", "emission",
            "point_lights", "spot_lights", "directional_lights", "fading_lights", "shadows", "sky", "instances",
            "smooth")
EVERYTHING = ShaderFeatures(**dict.fromkeys(SWITCHES, True), depth=4)
MIRRORS = ShaderFeatures(**{name: name in ("reflection", "point_lights", "shadows") for name in SWITCHES}, depth=16)

#: Everything is short, caches, queues and threads, so that all of it fills up.
SMALL = replace(ChipConfig(), num_threads=1, node_lines=32, list_lines=16, matrix_lines=8, num_fetches=2,
                shading_lines=8, texture_lines=8, mailbox_entries=1, shader=EVERYTHING)
CHIPS = {
    "two shaders": replace(SMALL, num_threads=7, num_shaders=2),
    "mirrors and shadows, two pipelines": replace(SMALL, num_threads=4, num_pipelines=2, shader=MIRRORS),
}
EYE = Camera((3.0, -5.0, 3.0), (0.0, 0.0, 0.5), (0.0, 0.0, 1.0), 50.0)


@pytest.fixture(autouse=True)
def quickly_compiled(monkeypatch):
    """These chips draw so little that compiling them takes most of the time."""
    monkeypatch.setenv("DYNRT_OPTIMISE", "-O0")


def floor(**others):
    return quad([(-4, -4, 0), (4, -4, 0), (4, 4, 0), (-4, 4, 0)], Material("floor", (0.8, 0.7, 0.6), **others),
                uvs=[(-0.3, 0.2), (5.7, 0.2), (5.7, 4.2), (-0.3, 4.2)])


def glass_and_veils():
    """A ball of glass, a veil with holes over it, a lamp that fades, a spot, a sun."""
    veil = Material("veil", (0.9, 0.3, 0.2), CHECKED, alpha_mode="blend", opacity=0.7, reflection=0.2)
    lace = Material("lace", (0.2, 0.9, 0.3), CHECKED, alpha_mode="mask", specular=0.4, shininess=16.0)
    glass = Material("glass", (0.9, 1.0, 0.8), reflection=0.04, fresnel=True, transmission=1.0, ior=1.5)
    lights = [Light("point", position=(1.0, -2.0, 3.0), intensity=4.0, reach=9.0, radius=0.2),
              Light.spot((-1, -2, 3), (0.3, 0.6, -1), inner_angle=0.2, outer_angle=0.7, intensity=6.0, radius=0.5),
              Light("directional", direction=(0.5, 0.3, -1.0), color=(1.0, 0.9, 0.7), intensity=0.4)]
    sky = Sky.gradient(zenith=(0.1, 0.3, 0.7), horizon=(0.7, 0.8, 0.9), ground=(0.2, 0.1, 0.05), size=32)
    sheared = np.array([[1.0, 0.4, 0.0, 0.5], [0.0, -0.6, 0.0, 0.2], [0.1, 0.0, 0.8, 0.3]])
    return scene_of(
        floor(texture=CHECKED, reflection=0.2, emission=(0.05, 0.0, 0.02)),
        ball((0, 0, 0.9), 0.8, glass, num_rings=8, smooth=True),
        quad([(-1, -1, 2), (1, -1, 2), (1, 1, 2), (-1, 1, 2)], veil, uvs=[(0, 0), (2, 0), (2, 2), (0, 2)]),
        quad([(0, -2, 0), (2, -2, 0), (2, -2, 2), (0, -2, 2)], lace, uvs=[(0, 0), (2, 0), (2, 2), (0, 2)]),
        lights=lights, sky=sky, ambient=(0.1, 0.05, 0.02), transforms=[np.eye(3, 4), sheared])


def assert_equal(scene, *, config, size, flatten=None, camera=None, **memory):
    camera = scene.default_camera() if camera is None else camera
    image = CompiledScene(scene, fmt=config.fmt, stack_depth=config.stack_depth, flatten=flatten).image(
        scene, eye=camera.eye, is_full=True, background=(20, 40, 80))
    model = render_full(image, camera, *size, config=config)
    frame = render_rtl(image, camera, *size, config=config, **memory)
    assert (frame.color == model.color).all()
    counts = model.report["counts"]
    # What has been done does not depend on when.
    report = frame.report
    assert report["packets"] == -(-size[0] // 2) * -(-size[1] // 2)
    assert report["traces"] == model.report["packets_traced"]
    num_shaders = config.num_pipelines * config.num_shaders
    assert round(report["busy"]["shader"] * report["cycles"] * num_shaders) == counts["instructions"]
    looked_up = {name: sum(count.values()) for name, count in report["cache"].items()}
    assert (looked_up["nodes"], looked_up["lists"]) == (counts["steps"] + counts["leaves"], counts["entries"])
    return frame, model.report["ray_kinds"]


@pytest.mark.parametrize(("chip", "size", "seed"), [("two shaders", (20, 15), 2), ("two shaders", (12, 9), 6)])
def test_a_mirror_room(chip, size, seed):
    frame, kinds = assert_equal(load_scene("mirror-room"), config=CHIPS[chip], size=size, jitter=20, seed=seed)
    assert len(np.unique(frame.color.reshape(-1, 3), axis=0)) > size[0] * size[1] / 3
    assert min(kinds[kind] for kind in ("primary", "shadow", "reflection")) > 10


@pytest.mark.parametrize(("chip", "size", "seed"), [("two shaders", (12, 9), 3), ("two shaders", (24, 32), 4)])
@pytest.mark.parametrize("flatten", [True, False], ids=["flat", "instances"])
def test_glass_and_veils(chip, size, seed, flatten):
    frame, kinds = assert_equal(glass_and_veils(), config=CHIPS[chip], size=size, camera=EYE, flatten=flatten,
                                jitter=20, seed=seed)
    assert len(np.unique(frame.color.reshape(-1, 3), axis=0)) > size[0] * size[1] / 3
    assert min(kinds.values()) > 0


@pytest.mark.parametrize("jitter", [0, 30])
def test_mirrors_and_shadows_alone(jitter):
    scene = scene_of(floor(reflection=0.5), ball((0, 0, 1.2), 1.0, Material("brass", (0.7, 0.5, 0.2), reflection=0.3)),
                     lights=[Light("point", position=(1.0, -2.0, 3.0), intensity=6.0, radius=0.2)])
    frame, kinds = assert_equal(scene, config=CHIPS["mirrors and shadows, two pipelines"], size=(24, 16), camera=EYE,
                                flatten=True, jitter=jitter)
    assert frame.color.std() > 5
    assert min(kinds["reflection"], kinds["shadow"]) > 100
    assert not kinds["refraction"] + kinds["transparency"] + kinds["hole"]
