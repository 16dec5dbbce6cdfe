"""Full shading by the chip's arithmetic against golden's float64, effect by effect."""

from dataclasses import replace

import numpy as np
import pytest

from fpu import FloatFormat
from rtl.config import ChipConfig
from rtl.shader_program import stack_words
from sim.golden import psnr, render_golden
from sim.model import render_full
from sim.scene import Camera, Light, Material, Sky, Texture, load_scene
from sim.scene.compile import CompiledScene

from ..golden.rooms import CHECKED, WHITE, ball, ground, leaf, quad, scene_of

FORMAT = FloatFormat(7, 16)
SIZE = 64, 48
SUN = Light("directional", direction=(0.5, 0.3, -1.0), color=(1.0, 0.9, 0.7), intensity=0.8)
LAMP = Light("point", position=(1.0, -2.0, 3.0), intensity=6.0, radius=0.2)
EYE = Camera((3.0, -5.0, 3.0), (0.0, 0.0, 0.5), (0.0, 0.0, 1.0), 50.0)
GRAY = Material("gray", (0.5, 0.4, 0.3))
GLASS = Material("glass", (0.9, 1.0, 0.8), reflection=0.04, fresnel=True, transmission=1.0, ior=1.5)
_TEXELS = np.random.default_rng(1).integers(0, 256, (8, 16, 4), np.uint8)
_UVS = [(-0.3, 0.2), (5.7, 0.2), (5.7, 4.2), (-0.3, 4.2)]


def both(scene, camera=EYE, *, depth=4, fmt=FORMAT, size=SIZE, flatten=None, background=(20, 40, 80)):
    """The picture of the model and of golden."""
    image = CompiledScene(scene, fmt=fmt, flatten=flatten).image(
        scene, eye=camera.eye, is_full=True, background=background)
    model = render_full(image, camera, *size, config=ChipConfig(fmt=fmt), depth=depth)
    return model, render_golden(scene, camera, *size, shading="full", depth=depth, background=background)


def off(model, golden):
    """int[H, W]: by how many levels pixels differ."""
    return np.abs(model.color.astype(int) - golden.color).max(axis=2)


def floor(**others):
    return quad([(-4, -4, 0), (4, -4, 0), (4, 4, 0), (-4, 4, 0)], Material("floor", (0.8, 0.8, 0.8), **others),
                uvs=_UVS)


def textured(*, filtered=True, opaque=True, **others):
    texels = _TEXELS.copy()
    if opaque:
        texels[..., 3] = 255
    return floor(texture=Texture("noise", texels, filtered), **others)


def roof(material, z=1.0):
    return quad([(-1, -1, z), (1, -1, z), (1, 1, z), (-1, 1, z)], material, uvs=[(0, 0), (2, 0), (2, 2), (0, 2)])


def sky():
    return Sky.gradient(zenith=(0.1, 0.3, 0.7), horizon=(0.7, 0.8, 0.9), ground=(0.2, 0.1, 0.05), size=64)


BALL = ball((0, 0, 1.2), 1.0, GRAY, smooth=True)
VEIL = Material("veil", (0.9, 0.3, 0.2), CHECKED, alpha_mode="blend", opacity=0.7)
LACE = Material("lace", (0.9, 0.3, 0.2), CHECKED, alpha_mode="mask")
PANE = Material("pane", (0.9, 0.4, 0.3), transmission=0.8, reflection=0.1, thin=True)

SCENES = {
    "headlight": scene_of(floor(), BALL),
    "point light": scene_of(floor(), BALL, lights=[LAMP], ambient=(0.1, 0.05, 0.02)),
    "inside a light": scene_of(floor(), BALL, lights=[replace(LAMP, radius=5.0)]),
    "fading light": scene_of(floor(), BALL, lights=[replace(LAMP, reach=5.0)]),
    "sun": scene_of(floor(), BALL, lights=[SUN]),
    "spot": scene_of(floor(), BALL, lights=[Light.spot((1, -2, 3), (-0.3, 0.6, -1), inner_angle=0.2, outer_angle=0.6,
                                                      intensity=8.0, radius=0.5)]),
    "fading spot": scene_of(floor(), BALL, lights=[
        Light.spot((1, -2, 3), (-0.3, 0.6, -1), inner_angle=0.2, outer_angle=0.6, intensity=8.0, reach=6.0), LAMP]),
    "patch": scene_of(floor(), BALL, lights=[Light.patch((1, -2, 3), (-0.3, 0.6, -1), intensity=8.0), SUN]),
    "highlights": scene_of(floor(specular=0.5, shininess=1024.0),
                           ball((0, 0, 1.2), 1.0, Material("m", (0.6, 0.3, 0.1), specular=0.8, shininess=16.0,
                                                           tinted=True), smooth=True), lights=[LAMP, SUN]),
    "emission": scene_of(floor(), roof(Material("m", (0.2, 0.2, 0.2), emission=(0.7, 0.5, 0.01)))),
    "texture": scene_of(textured(), lights=[LAMP]),
    "nearest texel": scene_of(textured(filtered=False), lights=[LAMP]),
    "sky": scene_of(floor(reflection=0.5), BALL, lights=[SUN], sky=sky()),
    "mirror": scene_of(floor(reflection=0.6, tinted=True), BALL, lights=[LAMP]),
    "mirror by angle": scene_of(floor(reflection=0.1, fresnel=True), BALL, lights=[LAMP], sky=sky()),
    "glass ball": scene_of(textured(), ball((0, 0, 1.2), 1.0, GLASS, smooth=True), lights=[LAMP], sky=sky()),
    "thin glass": scene_of(textured(), quad([(-1, -2, 0), (1, -2, 0), (1, -2, 2), (-1, -2, 2)], PANE), lights=[LAMP]),
    "under water": scene_of(textured(), quad([(-40, -40, 2), (40, -40, 2), (40, 40, 2), (-40, 40, 2)],
                                             replace(GLASS, ior=1.33)), BALL, lights=[LAMP], sky=sky()),
    "air in glass": scene_of(textured(), ball((0, 0, 1.2), 1.0, replace(GLASS, ior=0.7)), lights=[SUN]),
    "holes": scene_of(textured(), roof(LACE), roof(LACE, 2.0), lights=[SUN, LAMP]),
    "veils": scene_of(textured(), roof(VEIL), roof(VEIL, 2.0), lights=[SUN, LAMP]),
    "a veil that mirrors": scene_of(textured(), roof(replace(VEIL, reflection=0.3, transmission=0.4, specular=0.3)),
                                    ball((2, 1, 1), 0.6, GRAY), lights=[LAMP], sky=sky()),
    "light through glass": scene_of(floor(specular=0.4), roof(PANE), roof(PANE, 1.5), lights=[SUN, LAMP]),
    "a wall behind glass": scene_of(floor(), roof(PANE), roof(GRAY, 1.5), roof(PANE, 1.7), lights=[SUN, LAMP]),
}
#: Levels that may differ but for pixels at an edge; more where a weight or an angle is made of differences.
WORST = {"under water": 3, "air in glass": 3, "glass ball": 3, "mirror by angle": 2, "a veil that mirrors": 2,
         "spot": 2, "fading spot": 2, "highlights": 4}


@pytest.mark.parametrize("flatten", [True, False], ids=["flat", "instances"])
@pytest.mark.parametrize("name", SCENES)
def test_effect(name, flatten):
    model, golden = both(SCENES[name], flatten=flatten)
    difference = off(model, golden)
    assert np.mean(difference > WORST.get(name, 1)) <= 0.01
    assert difference.mean() <= 0.4
    # It is not black, and the effect is in sight.
    assert golden.color.std() > 5


def test_sheared_and_mirrored_instances():
    shear = np.array([[1.0, 0.4, 0.0, 0.5], [0.0, 0.6, 0.0, 0.2], [0.1, 0.0, 0.8, 0.3]])
    mirrored = np.array([[-0.5, 0.0, 0.0, -1.2], [0.0, 0.5, 0.0, -1.0], [0.0, 0.0, 0.5, 0.0]])
    scene = scene_of(textured(), BALL, ball((0, 0, 1.2), 1.0, GLASS, smooth=True), lights=[LAMP], sky=sky(),
                     transforms=[np.eye(3, 4), shear, mirrored])
    for flatten in (True, False):
        difference = off(*both(scene, flatten=flatten))
        assert np.mean(difference > 2) <= 0.01
        assert difference.mean() <= 0.35


def hall():
    """Two mirrors that face each other, with a lamp between."""
    mirror = Material("mirror", (0.9, 0.95, 1.0), reflection=0.8, tinted=True)
    return scene_of(quad([(-2, 2, -9), (2, 2, -9), (2, 2, 9), (-2, 2, 9)], mirror),
                    quad([(-2, -2, -9), (-2, -2, 9), (2, -2, 9), (2, -2, -9)], mirror),
                    ball((0, 0, 0), 0.3, GRAY), lights=[Light("point", position=(0, 0, 1), intensity=3.0)])


@pytest.mark.parametrize("depth", [0, 1, 3, 16])
def test_hall_of_mirrors(depth):
    camera = Camera((1.0, -1.9, 0.2), (-0.2, 2.0, 0.0), (0.0, 0.0, 1.0), 60.0)
    model, golden = both(hall(), camera, depth=depth)
    assert np.mean(off(model, golden) > 1) <= 0.01
    assert model.report["ray_kinds"]["reflection"] == pytest.approx(
        sum(level["reflection"] for level in golden.report["levels"]), abs=20)
    assert model.report["ray_kinds"]["reflection"] <= depth * SIZE[0] * SIZE[1]
    assert model.report["counts"]["shader_stack"] == 0


def test_256_lights():
    rng = np.random.default_rng(2)
    lights = [Light("point", position=(*rng.uniform(-4, 4, 2), rng.uniform(1, 4)), color=tuple(rng.uniform(0, 1, 3)),
                    intensity=0.1, radius=0.3) for _ in range(256)]
    model, golden = both(scene_of(floor(), BALL, lights=lights))
    assert psnr(model.color, golden.color) >= 55
    assert np.mean(off(model, golden) > 2) <= 0.001
    assert model.report["ray_kinds"]["shadow"] == pytest.approx(
        sum(level["shadow"] for level in golden.report["levels"]), rel=0.01)


@pytest.mark.parametrize(("count", "ends"), [(64, 0), (65, 1)])
def test_rays_end_in_the_65th_hole(count, ends):
    glow = Material("glow", (0, 0, 0), emission=(1.0, 1.0, 1.0))
    scene = scene_of(*(leaf(LACE, 1 + k / 64) for k in range(count)), ground(glow), lights=[SUN])
    model, golden = both(scene, Camera((1.5, 0.5, 4.0), (1.5, 0.5, 0.0), (0.0, 1.0, 0.0), 0.5), size=(8, 8))
    assert (golden.color == (0 if ends else 255)).all()
    assert (model.color == golden.color).all()


@pytest.mark.parametrize(("count", "dark"), [(64, False), (65, True)])
def test_light_ends_in_the_65th_hole(count, dark):
    light = [Light("directional", direction=(0, 0, -1.0))]
    scene = scene_of(*(leaf(LACE, 1 + k / 64) for k in range(count)), ground(WHITE), lights=light)
    model, golden = both(scene, Camera((1.5, 0.5, 0.5), (1.5, 0.5, 0.0), (0.0, 1.0, 0.0), 5.0), size=(8, 8))
    assert (golden.color == (0 if dark else 255)).all()
    assert (model.color == golden.color).all()


@pytest.mark.parametrize("depth", [1, 2, 4, 6])
def test_the_stack_holds_two_rays_a_generation(depth):
    clear = replace(VEIL, reflection=0.4, transmission=0.5, thin=True)
    scene = scene_of(textured(), *(roof(clear, z) for z in (0.5, 0.8, 1.1, 1.4)), lights=[LAMP], sky=sky())
    model, golden = both(scene, depth=depth)
    features = replace(CompiledScene(scene, fmt=FORMAT).image(scene, eye=EYE.eye, is_full=True).needs, depth=depth)
    assert 0 < model.report["counts"]["shader_stack"] <= stack_words(features)
    assert stack_words(features) <= 4 * (2 * depth + 1) + 7
    assert np.mean(off(model, golden) > 2) <= 0.01


def test_a_shader_that_lacks_something_says_so():
    scene = SCENES["glass ball"]
    image = CompiledScene(scene, fmt=FORMAT).image(scene, eye=EYE.eye, is_full=True)
    with pytest.raises(ValueError, match=r"lacks what the scene needs: refraction, sky$"):
        render_full(image, EYE, *SIZE, config=ChipConfig(shader=replace(image.needs, refraction=False, sky=False)))


@pytest.mark.parametrize("arithmetic", range(6))
def test_every_arithmetic(arithmetic):
    scene = SCENES["glass ball"]
    image = CompiledScene(scene, fmt=FORMAT).image(scene, eye=EYE.eye, is_full=True, background=(20, 40, 80))
    model = render_full(image, EYE, *SIZE, config=ChipConfig(arithmetic=arithmetic))
    golden = render_golden(scene, EYE, *SIZE, shading="full", background=(20, 40, 80))
    assert psnr(model.color, golden.color) >= 45


@pytest.mark.parametrize(("name", "size", "least"), [
    ("room", (96, 72), 58), ("walk", (96, 72), 54), ("vpl", (48, 36), 55)])
def test_built_in_scenes(name, size, least):
    scene = load_scene(name)
    model, golden = both(scene, scene.default_camera(), size=size)
    assert psnr(model.color, golden.color) >= least


def test_mirror_room_in_a_wider_format():
    scene = load_scene("mirror-room")
    model, golden = both(scene, scene.cameras[1], size=(96, 72), fmt=FloatFormat(7, 20))
    assert psnr(model.color, golden.color) >= 50
