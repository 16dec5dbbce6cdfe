"""What is beyond the chip's arithmetic is named, and nothing else."""

import json
from pathlib import Path

import numpy as np
import pytest

from fpu import FloatFormat
from rtl.config import ChipConfig
from sim.golden import render_golden
from sim.model import render_model
from sim.scene import Camera, Material, load_scene
from sim.scene.compile import CompiledScene
from sim.scene.limits import FAR, FLAT, STRETCHED, THIN, limit_warnings
from tests.sim.golden.rooms import ball, quad, scene_of

RESULTS = Path(__file__).parents[3] / "docs" / "results" / "stability.json"
FORMAT = FloatFormat(7, 16)
GREY = Material("grey", (0.5, 0.5, 0.5))
FLOOR = quad([(-1, -1, 0), (1, -1, 0), (1, 1, 0), (-1, 1, 0)], GREY)


@pytest.mark.parametrize("limit", [FAR, THIN, STRETCHED, FLAT])
def test_limits_are_those_of_the_measured_rows(limit):
    results = json.loads(RESULTS.read_text())
    assert results["format"] == "7.16"
    bound = results["bounds"][limit.case]["default"][limit.side]
    assert limit.ratio == pytest.approx(max(bound, 1 / bound))


@pytest.mark.parametrize(("bits", "ratio"), [(16, 1e3), (17, 2e3), (12, 62.5)])
def test_a_limit_doubles_with_every_bit(bits, ratio):
    assert FAR.at(FloatFormat(7, bits)) == ratio


@pytest.mark.parametrize("name", ["room", "mirror-room", "vpl", "walk", "sunflowers"])
def test_built_in_scenes_are_within(name):
    scene = load_scene(name)
    for flat in (True, False):
        assert limit_warnings(scene, fmt=FORMAT, is_flat=flat) == []


def sphere(radius):
    return ball((0.9, 0, 0), radius, GREY, num_rings=4)


@pytest.mark.parametrize(("radius", "says"), [
    (1e-3, []),
    (5e-4, ["object 'part1': up to 1,801 times its own size from the middle of the space that it shares with others, "
            "beyond the 1,000 that format 7.16 is good for; use --format 7.17, or give it a space of its own with "
            "--instances, or move it nearer to the others"]),
    (1e-6, ["object 'part1': up to 900,001 times its own size from the middle of the space that it shares with others, "
            "beyond the 1,000 that format 7.16 is good for; give it a space of its own with --instances, or move it "
            "nearer to the others"])])
def test_small_and_far(radius, says):
    assert limit_warnings(scene_of(FLOOR, sphere(radius)), fmt=FORMAT, is_flat=True) == says


def test_seen_from_the_eye_nothing_is_far():
    scene = scene_of(FLOOR, sphere(1e-6))
    assert limit_warnings(scene, fmt=FORMAT, is_flat=False) == []
    assert len(limit_warnings(scene, fmt=FORMAT, is_flat=False, from_eye=False)) == 1


def test_no_more_bits_than_there_are():
    text, = limit_warnings(scene_of(FLOOR, sphere(5e-6)), fmt=FloatFormat(7, 23), is_flat=True)
    assert "--format" not in text


def test_more_bits_are_enough():
    scene = scene_of(FLOOR, sphere(5e-5))
    text, = limit_warnings(scene, fmt=FORMAT, is_flat=True)
    assert "--format 7.21" in text or "--format 7.20" in text
    bits = int(text.split("--format 7.")[1][:2])
    assert limit_warnings(scene, fmt=FloatFormat(7, bits), is_flat=True) == []
    assert limit_warnings(scene, fmt=FloatFormat(7, bits - 1), is_flat=True)


def test_thin_triangles():
    blade = quad([(0, 0, 0), (1, 0, 0), (1, 6e-5, 0), (0, 6e-5, 0)], GREY)
    assert limit_warnings(scene_of(FLOOR, blade), fmt=FORMAT, is_flat=True) == [
        "mesh 'quad': triangles up to 16,667 times as long as wide, beyond the 10,000 that format 7.16 is good for; "
        "use --format 7.17, or split them into shorter ones"]


@pytest.mark.parametrize(("scales", "says"), [
    ((100, 1, 1), []), ((1, 1, 1e-3), []), ((400, 1, 1), ["stretched along one axis up to 400"]),
    ((1, 1, 5e-4), ["flattened along one axis to a part in 2,000"])])
def test_instances(scales, says):
    place = np.concatenate([np.linalg.qr(np.random.default_rng(1).normal(size=(3, 3)))[0] @ np.diag(scales),
                            np.zeros((3, 1))], axis=1)
    scene = scene_of(FLOOR, sphere(0.1), transforms=[np.eye(3, 4), place])
    found = limit_warnings(scene, fmt=FORMAT, is_flat=False)
    assert all(text.startswith(f"object 'part1': {words}") for text, words in zip(found, says, strict=True))


def test_the_worst_are_named():
    scene = scene_of(FLOOR, *(ball((0.5, y, 0), 1e-5 * (y + 2), GREY, num_rings=3) for y in (0.5, 0.1, 0.2, 0.3, 0.4)))
    text, = limit_warnings(scene, fmt=FORMAT, is_flat=True)
    assert text.startswith("objects 'part2', 'part3', 'part4' and 2 more: up to ")


def wrong_pixels(radius, fmt, *, flatten):
    """Part of the model's pixels that show another triangle than golden's: a ball beside a floor, three radii away."""
    middle = np.array((0.9, 0.37, 0.21))
    scene = scene_of(FLOOR, ball(middle, radius, GREY, num_rings=12))
    camera = Camera(middle + radius * np.array((3, 2, 1)), middle, (0, 0, 1), 40.0)
    image = CompiledScene(scene, fmt=fmt, flatten=flatten).image(scene, eye=camera.eye)
    drawn = render_model(image, camera, 160, 120, config=ChipConfig(fmt=fmt))
    return drawn.differs_in_surface(render_golden(scene, camera, 160, 120)).mean()


def test_the_limit_is_where_pictures_break_and_both_remedies_help():
    within, at, beyond = (wrong_pixels(size, FORMAT, flatten=True) for size in (1e-1, 1 / FAR.ratio, 0.1 / FAR.ratio))
    assert within < 0.001
    assert 0.01 < at < 0.05
    assert beyond > 0.1
    assert wrong_pixels(0.1 / FAR.ratio, FORMAT, flatten=False) < 0.001
    # Four bits more, a sixteenth of the size
    assert at / 2 < wrong_pixels(1 / FAR.ratio / 16, FloatFormat(7, 20), flatten=True) < 2 * at
