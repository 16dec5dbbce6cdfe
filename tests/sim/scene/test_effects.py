"""The scenes of single effects need what they show, and no more."""

from dataclasses import fields

import pytest

from sim.golden import render_golden
from sim.scene.effects import effect_scenes
from sim.scene.shading_image import needed_features

SCENES = effect_scenes()
COMMON = {"point_lights", "shadows"}
OWN = {
    "point light, shadow": set(), "spot light": {"spot_lights"}, "directional light": {"directional_lights"},
    "light with a range": {"fading_lights"}, "smooth normals": {"smooth"}, "texture": {"textures"},
    "highlight": {"highlights", "smooth"}, "emission": {"emission"}, "sky": {"sky"}, "instances": {"instances"},
    "reflection": {"reflection"}, "Fresnel reflection": {"reflection", "fresnel"},
    # What cannot go through is mirrored.
    "refraction": {"refraction", "reflection", "smooth"}, "transparency": {"transparency"},
    "holes": {"transparency", "textures"},
}
OTHER_LIGHTS = "spot light", "directional light"


def test_every_switch_has_an_effect():
    switches = {field.name for field in fields(needed_features(SCENES["holes"], instances=True)) if field.type is bool}
    assert set(OWN) == set(SCENES)
    assert COMMON.union(*OWN.values()) == switches


@pytest.mark.parametrize("name", SCENES)
def test_needs_its_own_switches(name):
    needed = needed_features(SCENES[name], instances=name == "instances")
    common = COMMON - {"point_lights"} if name in OTHER_LIGHTS else COMMON
    assert {field.name for field in fields(needed) if getattr(needed, field.name) is True} == common | OWN[name]


def test_each_looks_different():
    pictures = [render_golden(scene, scene.default_camera(), 32, 24, shading="full").color for scene in SCENES.values()]
    for number, picture in enumerate(pictures):
        assert all((picture != other).any(axis=-1).mean() > 0.01 for other in pictures[:number])
