"""The memories of full shading: what lies where."""

from dataclasses import replace

import numpy as np
import pytest

from fpu import FloatFormat
from rtl.microcode import lane_width
from rtl.program.records import FIRST_MATRIX, FadeFlag, LightFlag, MaterialFlag
from rtl.shader_program import ShaderFeatures
from rtl.srgb import COLOR_ONE, linear_colors
from sim.scene import Light, Material, Mesh, Scene, SceneError, Sky, Texture
from sim.scene.compile import CompiledScene
from sim.scene.image import SOLID_ENTRY
from sim.scene.scene import IDENTITY, Instance
from sim.scene.texels import FILTERED, FOLDED, pack_textures
from sim.scene.texture_memory import pack_texture
from sim.scene.triangles import pack_fields, unpack_fields

from ..golden.rooms import ball, leaf, quad, scene_of

FORMAT = FloatFormat(7, 16)
CORNERS = [(0, 0, 0), (2, 0, 0), (2, 2, 0), (0, 2, 0)]


def lanes(scene, *, fmt=FORMAT, flatten=None, **options):
    image = CompiledScene(scene, fmt=fmt, flatten=flatten).image(scene, eye=(0.0, 0.0, 5.0), is_full=True, **options)
    return image, *image.record_lanes()


def light_lanes(light, scene=None):
    image, floats, integers = lanes(scene or scene_of(quad(CORNERS, Material("m", (1, 1, 1))), lights=[light]))
    return image, floats[integers[0, 9]], integers[integers[0, 9]]


def test_fields_go_in_and_out():
    rng = np.random.default_rng(0)
    for width in (20, 24, 32):
        fields = rng.integers(0, 1 << width, (5, 12))
        assert (unpack_fields(pack_fields(fields, width), width) == fields).all()


def test_texels_lie_in_blocks():
    pixels = np.arange(4 * 8 * 4, dtype=np.uint8).reshape(4, 8, 4)
    words = pack_texture(pixels)
    for i in range(8):
        for j in range(4):
            word = words[4 * ((j >> 1) * 4 + (i >> 1)) + 2 * (j & 1) + (i & 1)]
            assert [word >> shift & 255 for shift in (0, 8, 16, 24)] == pixels[j, i].tolist()


@pytest.mark.parametrize(("width", "height"), [(1, 1), (1, 4), (4, 1), (2, 2)])
def test_sides_of_one_are_doubled(width, height):
    pixels = np.random.default_rng(0).integers(0, 256, (height, width, 4), np.uint8)
    words = pack_texture(pixels)
    assert len(words) == max(width, 2) * max(height, 2)
    for i in range(max(width, 2)):
        for j in range(max(height, 2)):
            word = words[4 * ((j >> 1) * (max(width, 2) >> 1) + (i >> 1)) + 2 * (j & 1) + (i & 1)]
            assert word & 255 == pixels[j % height, i % width, 0]


def test_a_texture_is_packed_once_and_begins_at_a_block():
    first = Texture("a", np.zeros((1, 1, 4), np.uint8))
    second = Texture("b", np.full((8, 16, 4), 7, np.uint8), filtered=False)
    descriptors, sky, texels = pack_textures([first, None, second, first], Sky(np.zeros((4, 4, 3), np.uint8)))
    assert descriptors == [(0, FILTERED), None, (4, 4 | 3 << 4), (0, FILTERED)]
    assert sky == (4 + 128, 2 | 2 << 4 | FILTERED | FOLDED)
    assert len(texels) == 4 + 128 + 16
    assert (texels[132:] >> 24 == 255).all()


def test_too_many_texels():
    textures = [Texture(str(k), np.zeros((4096, 4096, 4), np.uint8)) for k in range(2)]
    with pytest.raises(SceneError, match=r"textures have 33,554,432 texels, more than the 16,777,216"):
        pack_textures(textures, None)


def test_triangles_and_materials():
    plain, tiled = Material("plain", (1.0, 0.5, 0.0)), Material("tiled", (1, 1, 1), Texture(
        "t", np.full((2, 2, 4), 255, np.uint8)))
    scene = scene_of(quad(CORNERS, plain), leaf(tiled, 1), (quad(CORNERS, tiled)[0], tiled),
                     ball((0, 0, 3), 0.5, plain, smooth=True, num_rings=6))
    image, floats, integers = lanes(scene)
    assert image.records.shape[1] == 12 * lane_width(FORMAT) // 32
    signs = set()
    for matrix in range(len(image.matrices)):
        row = FIRST_MATRIX + matrix
        part, prim = image.triangle_instance[matrix], image.triangle_prim[matrix]
        mesh = scene.meshes[part]
        corners = mesh.vertices[mesh.triangles[prim]]
        normal = np.cross(corners[1] - corners[0], corners[2] - corners[0])
        # Turned as it is in the matrix, and all that is on corners begins where the matrix does.
        sign = np.sign(image.matrix_values()[matrix, 2] @ normal)
        signs.add((part, int(sign)))
        normal, order = sign * normal, (image.triangle_first[matrix] + np.arange(3)) % 3
        assert floats[row, :3] == pytest.approx(normal / np.linalg.norm(normal), abs=2e-5)
        material = integers[integers[row, 5]]
        color = [linear_colors()[255], linear_colors()[188], 0] if part in (0, 3) else [COLOR_ONE] * 3
        assert material[:3].tolist() == color
        # A mesh without coordinates shows no texture.
        assert (material[3] >> MaterialFlag.TEXTURED & 1) == (part == 1)
        assert (integers[row, 11] > 0) == (part == 3)
        if part == 1:
            uvs = mesh.uvs[prim][order]
            assert floats[row, 9:11].tolist() == uvs[0].tolist()
            assert floats[row, 3:5].tolist() == (uvs[1] - uvs[0]).tolist()
            assert floats[row, 6:8].tolist() == (uvs[2] - uvs[0]).tolist()
        if part == 3:
            columns = floats[integers[row, 11]]
            n0, n1, n2 = sign * mesh.shading_normals[prim][order]
            assert columns[:9] == pytest.approx(np.concatenate([n1 - n0, n2 - n0, n0]), abs=2e-5)
    assert {sign for _, sign in signs} == {1, -1}
    assert len([sign for part, sign in signs if part == 3]) == 1


def test_whole_numbers_are_taken_off_texture_coordinates():
    material = Material("m", (1, 1, 1), Texture("t", np.zeros((2, 2, 4), np.uint8)))
    scene = scene_of(quad(CORNERS, material, uvs=[(1000.25, -7.5), (1001.25, -7.5), (1001.25, -6.5), (1000.25, -6.5)]))
    _, floats, _ = lanes(scene)
    # At the corners across from the diagonal
    assert sorted(floats[FIRST_MATRIX:FIRST_MATRIX + 2, 9:11].tolist()) == [[0.25, 1.5], [1.25, 0.5]]


def test_flags_of_materials():
    glass = Material("glass", (1, 1, 1), transmission=1.0, fresnel=True, specular=0.5, shininess=8.0)
    _, _, integers = lanes(scene_of(quad(CORNERS, glass)))
    flags = integers[integers[FIRST_MATRIX, 5], 3]
    assert {flag for flag in MaterialFlag if flags >> flag & 1} == {
        MaterialFlag.FRESNEL, MaterialFlag.CLEAR, MaterialFlag.BENDS, MaterialFlag.SHARES, MaterialFlag.GLOSSY,
        MaterialFlag.LIT, MaterialFlag.PARENT, MaterialFlag.FORKS, MaterialFlag.SQUARINGS}
    assert flags >> MaterialFlag.SQUARINGS == 0b111


def test_solid_triangles_are_marked_in_the_lists():
    for material, solid in ((Material("m", (1, 1, 1)), True), (Material("m", (1, 1, 1), transmission=0.5), False),
                            (Material("m", (1, 1, 1), alpha_mode="mask"), False)):
        image, *_ = lanes(scene_of(quad(CORNERS, material)))
        assert (image.lists & SOLID_ENTRY != 0).all() == solid
        assert (image.lists & SOLID_ENTRY != 0).any() == solid
    image, *_ = lanes(scene_of(quad(CORNERS, Material("m", (1, 1, 1)))), flatten=False)
    assert not image.lists[0] & SOLID_ENTRY


def test_lights():
    light = Light("point", position=(1, 1, 0), color=(1.0, 0.5, 0.25), intensity=3.0, radius=0.5, reach=4.0)
    image, floats, integers = light_lanes(light)
    # The quad is 2 wide: the chip's unit is 1, its middle at (1, 1, 0).
    assert image.scale == 1.0
    assert floats[:3].tolist() == [0, 0, 0]
    assert floats[3:6] == pytest.approx([3.0, 3 * 128 / 255, 3 * 64 / 255], rel=1e-5)
    assert floats[9] == pytest.approx(4.0, rel=1e-3)
    assert floats[10] == pytest.approx(1 / 16, rel=2e-3)
    assert integers[9] & 7 == 1 << LightFlag.FADES
    _, floats, integers = light_lanes(Light.spot((1, 1, 2), (0, 0, -1), inner_angle=0.1, outer_angle=0.5))
    assert integers[9] & 7 == 1 << LightFlag.SPOT
    assert integers[10] & 15 == 1 << FadeFlag.CLAMPED | 1 << FadeFlag.SQUARINGS
    assert floats[8] == pytest.approx(-1 / (np.cos(0.1) - np.cos(0.5)), rel=1e-4)
    _, floats, integers = light_lanes(Light("directional", direction=(0, 3, -4)))
    assert integers[9] == 1 << LightFlag.DIRECTIONAL
    assert floats[:3] == pytest.approx([0, 0.6, -0.8], rel=1e-5)


def test_the_headlight_is_at_the_eye_and_does_not_fall_off():
    image, floats, _ = light_lanes(None, scene_of(quad(CORNERS, Material("m", (1, 1, 1)))))
    assert floats[:3].tolist() == ((np.array([0, 0, 5.0]) - image.center) * image.scale).tolist()
    assert floats[3] * floats[9] == pytest.approx(0.85, rel=1e-3)
    # One over its radius squared is below that of any scene.
    assert floats[9] <= 2.0**-20


def test_a_cone_squared_too_often():
    light = replace(Light("spot"), cone=(1.0, 0.0, 4), name="beam")
    with pytest.raises(SceneError, match=r"light 'beam': its cone is squared 4 times, more than the 3"):
        light_lanes(light)


def test_needed_features():
    material = Material("m", (1, 1, 1))
    image, *_ = lanes(scene_of(quad(CORNERS, material)))
    least = {"point_lights", "shadows"}
    assert {name for name in vars(image.needs) if getattr(image.needs, name) is True} == least
    mesh = Mesh("mesh", np.array(CORNERS, float), np.array([(0, 1, 2)], np.int32), np.zeros(1, np.int32))
    # A material that nothing has needs nothing.
    scene = Scene([mesh], [Instance(0, IDENTITY, "a"), Instance(0, IDENTITY, "b")],
                  [material, replace(material, transmission=1.0)], lights=[Light.patch((0, 0, 1), (0, 0, -1))])
    image, *_ = lanes(scene)
    assert image.needs == ShaderFeatures(**dict.fromkeys(
        [name for name in vars(image.needs) if name != "depth"], False) | {
            "spot_lights": True, "shadows": True, "instances": True})


def test_simple_shadings_image_has_no_records():
    scene = scene_of(quad(CORNERS, Material("m", (1, 1, 1))))
    image = CompiledScene(scene, fmt=FORMAT).image(scene)
    assert image.records is None
    assert image.texels is None
