"""Shader scripts of Quake III, and the materials that surfaces get by them."""

import numpy as np
import pytest

from sim.scene import SceneError
from sim.scene.pk3 import Archive
from sim.scene.quake_looks import QuakeLooks
from sim.scene.shader_script import parse_shaders

from .quake_builder import picture, pk3

SCRIPT = """
// textures/none { map a.tga }
textures/Two/Stages
{
    surfaceparm trans /* a remark
    { in two lines } */ cull none
    DeformVertexes autosprite
    { map $lightmap
      rgbGen identity }
    {
        map Textures\\Other.TGA // behind it
        blendFunc filter
        tcMod scale 2 -.5
        tcmod SCALE 2 x
        tcMod scroll 1 1
    }
}
textures/two/stages { { map second.tga } }
other{{animmap 5 a.tga b.tga
alphafunc GE128
tcGen environment}}
"""


def test_what_is_in_a_script():
    shaders = parse_shaders(SCRIPT)
    assert list(shaders) == ["textures/two/stages", "other"]
    two = shaders["textures/two/stages"]
    assert two.odd == ["deformvertexes autosprite"]
    assert [stage.image for stage in two.stages] == ["$lightmap", "textures\\other.tga"]
    assert [stage.has_picture for stage in two.stages] == [False, True]
    assert two.stages[1].blend == ("gl_dst_color", "gl_zero")
    assert two.stages[1].scale == (4.0, -0.5)
    (stage,) = shaders["other"].stages
    assert (stage.image, stage.alpha, stage.odd) == ("a.tga", "ge128", ["tcgen environment"])


@pytest.mark.parametrize("text", ["", "}", "{", "a", "{}", "a { {", "a } }", "{ { { } } }", "a { { map } }", "/*",
                                  "a { /*", "a { { map animmap\nanimmap\nblendfunc\ntcmod scale\nalphafunc } }"])
def test_no_script_is_an_error(text):
    for shader in parse_shaders(text).values():
        assert all(stage.image is None or stage.has_picture for stage in shader.stages)


@pytest.fixture
def looks(tmp_path):
    """Function from a script and pictures to the looks that an archive with them has."""
    def read(script, **pictures):
        files = {f"textures/{name}.tga": picture(color) for name, color in pictures.items()}
        (tmp_path / "a.pk3").write_bytes(pk3({"scripts/a.shader": script.encode()} | files))
        return QuakeLooks(Archive(tmp_path / "a.pk3"))

    return read


def stages(*lines):
    return "x { { " + "\n} {\n".join(lines) + "\n} }"


@pytest.mark.parametrize(("lines", "mode", "transmission", "pixel"), [
    ("", "opaque", 0, (200, 100, 0, 128)),
    ("blendfunc gl_one gl_zero", "opaque", 0, (200, 100, 0, 128)),
    ("alphafunc ge128", "mask", 0, (200, 100, 0, 128)),
    ("alphafunc lt128", "mask", 0, (200, 100, 0, 127)),
    ("blendfunc blend", "blend", 0, (200, 100, 0, 128)),
    ("blendfunc filter", "opaque", 1, (200, 100, 0, 128)),
    ("blendfunc gl_zero gl_one_minus_src_color", "opaque", 1, (55, 155, 255, 128)),
])
def test_coverings(looks, lines, mode, transmission, pixel):
    look = looks(stages("map textures/a.jpg\n" + lines), a=(200, 100, 0, 128))
    material, scale = look.material("X")
    assert (material.alpha_mode, material.transmission, material.thin) == (mode, transmission, transmission == 1)
    assert material.texture.pixels[0, 0].tolist() == list(pixel)
    assert (material.base_color, scale) == ((1, 1, 1), (1, 1))
    assert look.warnings() == []


@pytest.mark.parametrize(("test", "alpha", "is_there"), [("gt0", 0, False), ("gt0", 1, True), ("ge128", 127, False),
                                                        ("ge128", 128, True), ("lt128", 127, True),
                                                        ("lt128", 128, False)])
def test_alpha_tests_at_their_bounds(looks, test, alpha, is_there):
    material, _ = looks(stages(f"map textures/a.tga\nalphafunc {test}"), a=(1, 2, 3, alpha)).material("x")
    assert (material.texture.pixels[0, 0, 3] / 255 >= round(255 * material.alpha_cutoff) / 255) == is_there


def test_added_stages_are_veils_of_the_same_light(looks):
    look = looks(stages("map textures/a.tga\nblendfunc add"), a=(200, 100, 0, 9))
    material, _ = look.material("x")
    assert material.alpha_mode == "blend"
    pixel = material.texture.pixels[0, 0] / 255

    def linear(encoded):
        return ((encoded + 0.055) / 1.055) ** 2.4

    assert pixel[3] == pytest.approx(linear(200 / 255), abs=1 / 255)
    assert pixel[3] * linear(pixel[:2]) == pytest.approx(linear(np.array((200, 100)) / 255), abs=0.01)
    assert look.warnings() == ["not drawn as the game does: added, as veils: x"]


def test_a_veil_without_opacity_is_opaque(looks):
    assert looks(stages("map textures/a.tga\nblendfunc blend"), a=(1, 2, 3)).material("x")[0].alpha_mode == "opaque"


def test_the_first_stage_says_how_the_first_picture_covers(looks):
    material, scale = looks(stages("map $lightmap", "map textures/a.tga\nblendfunc filter\ntcmod scale 3 4"),
                            a=(1, 2, 3)).material("x")
    assert (material.transmission, scale) == (0, (3, 4))


def test_what_cannot_be_drawn_is_named_once(looks):
    odd = "{ { map textures/a.tga\ntcgen environment\nblendfunc gl_dst_color gl_src_color } }\n"
    look = looks("".join(name + odd for name in "abcdef") + "fog { fogparms 1 }", a=(1, 2, 3))
    for name in "abcdefa":
        look.material(name)
    assert look.material("fog") is None
    assert look.material("textures/none")[0].base_color == (0.8, 0.8, 0.8)
    assert look.warnings() == [
        "not drawn as the game does: tcgen environment: a, b, c, d and 2 more; "
        "blendfunc gl_dst_color gl_src_color: a, b, c, d and 2 more; without a picture, left out: fog; "
        "without its picture, in grey: textures/none"]


def test_a_surface_without_a_shader_has_the_picture_of_its_name(looks):
    material, _ = looks("", a=(1, 2, 3)).material("textures\\A.jpg")
    assert material.texture.name == "textures/a.tga"
    assert material.texture.pixels[0, 0].tolist() == [1, 2, 3, 255]


def test_too_much(looks, tmp_path, monkeypatch):
    with pytest.raises(SceneError, match=rf"^{tmp_path}/a\.pk3: scripts/a\.shader: has 1,048,577 bytes; of texts at "
                                         "most 1,048,576 are read$"):
        looks("x" * ((1 << 20) + 1))
    monkeypatch.setattr("sim.scene.quake_looks._MAX_SCRIPTS", 5)
    with pytest.raises(SceneError, match=r"^scripts/a\.shader: with it there are more than 5 bytes of shader scripts$"):
        looks("123456")
    monkeypatch.setattr("sim.scene.quake_looks._MAX_TEXELS", 31)
    look = looks("", a=(1, 2, 3), b=(1, 2, 3))
    look.material("textures/a")
    with pytest.raises(SceneError, match=r"^texture 'textures/b\.tga': with it there are more than 31 texels$"):
        look.material("textures/b")
    monkeypatch.setattr("sim.scene.pk3._MAX_TOTAL", 60)
    with pytest.raises(SceneError, match=rf"^{tmp_path}/a\.pk3: textures/a\.tga: with it more than 60 bytes would have "
                                         "been unpacked$"):
        looks("", a=(1, 2, 3)).material("textures/a")
