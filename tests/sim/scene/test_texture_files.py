"""Pictures in files: what is read, resampled, refused."""

import io
import zlib

import numpy as np
import pytest
from PIL import Image

from sim.scene import SceneError, Texture, load_scene
from sim.scene.texture import decode_texture

TRIANGLE = "v 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 0 1\nusemtl m\nf 1/1 2/2 3/3\n"
PIXELS = np.random.default_rng(1).integers(0, 256, (4, 8, 4), dtype=np.uint8)


def png(pixels, form="PNG"):
    file = io.BytesIO()
    Image.fromarray(pixels).save(file, form)
    return file.getvalue()


@pytest.fixture
def load(tmp_path):
    """Function from the lines of a material (and files by name) to the scene that uses it."""
    def write_and_load(lines, **files):
        folder = tmp_path / "scene"
        folder.mkdir(exist_ok=True)
        for name, data in files.items():
            (folder / name.replace("_", ".")).write_bytes(data)
        (folder / "a.mtl").write_text("newmtl m\n" + lines)
        (folder / "a.obj").write_text("mtllib a.mtl\n" + TRIANGLE)
        return load_scene(folder / "a.obj")

    return write_and_load


def material_of(scene):
    return scene.materials[scene.meshes[0].material_ids[0]]


def test_the_first_row_of_an_objs_texture_is_the_last_of_the_file(load):
    scene = load("map_Kd t.png\n", t_png=png(PIXELS))
    assert (material_of(scene).texture.pixels == PIXELS[::-1]).all()
    assert material_of(scene).alpha_mode == "opaque"
    assert scene.warnings == []


@pytest.mark.parametrize(("form", "pixels"), [("BMP", PIXELS[..., :3]), ("TGA", PIXELS), ("PNG", PIXELS[..., 0])])
def test_formats_and_modes(form, pixels):
    read = decode_texture(png(np.ascontiguousarray(pixels), form), "t", []).pixels
    expected = pixels if pixels.ndim == 3 else np.repeat(pixels[..., None], 3, axis=2)
    assert (read[..., :expected.shape[2]] == expected).all()
    if expected.shape[2] == 3:
        assert (read[..., 3] == 255).all()


def test_sixteen_bits_are_cut_to_eight():
    deep = np.array([[0, 255, 256, 65535]], np.uint16)
    assert decode_texture(png(deep), "t", []).pixels[0, :, 0].tolist() == [0, 0, 1, 255]


def test_odd_sizes_are_resampled_and_named_once(load):
    odd = np.full((3, 5, 3), 100, np.uint8)
    scene = load("map_Kd t.png\nnewmtl n\nmap_Kd u.png\nnewmtl o\nmap_Kd t.png\n", t_png=png(odd),
                 u_png=png(odd[:, :3]))
    assert material_of(scene).texture.pixels.shape == (4, 8, 4)
    assert (material_of(scene).texture.pixels[..., :3] == 100).all()
    assert scene.warnings == ["textures resampled, as sides are powers of two up to 4096: t.png from 5x3 to 8x4, "
                              "u.png from 3x3 to 4x4"]
    # Read once, though two materials name it.
    assert scene.materials[1].texture is scene.materials[3].texture


@pytest.mark.parametrize("lines", ["map_d t.png\n", "map_Kd u.png\nmap_d t.png\n"])
def test_opacity_has_its_own_picture(load, lines):
    veil = np.zeros((4, 4), np.uint8)
    veil[:, 2:] = 255
    scene = load(lines, t_png=png(veil), u_png=png(np.full((2, 2, 3), 7, np.uint8)))
    material = material_of(scene)
    assert material.alpha_mode == "mask"
    assert (material.texture.pixels[..., 3] == veil).all()
    assert (material.texture.pixels[..., 0] == (7 if "Kd" in lines else 255)).all()
    veil[:] = 100
    assert material_of(load(lines, t_png=png(veil))).alpha_mode == "blend"


def test_a_picture_of_opacity_with_a_fourth_channel_is_that_channel(load):
    material = material_of(load("map_Kd t.png\nmap_d t.png\n", t_png=png(PIXELS)))
    assert (material.texture.pixels == PIXELS[::-1]).all()


@pytest.mark.parametrize(("name", "message"), [
    ("../secret.png", r"'../secret.png' leads out of the scene's folder"),
    ("/etc/passwd", r"'/etc/passwd' leads out of the scene's folder"),
    ("..\\secret.png", "leads out of the scene's folder"),
    ("broken.png", r"texture 'broken.png': cannot be read: not a picture of a known format"),
    ("cut.png", r"texture 'cut.png': cannot be read: "),
    ("bomb.png", r"texture 'bomb.png': too many pixels; at most 67,108,864 are read"),
    ("large.png", r"texture 'large.png': too many pixels; at most 67,108,864 are read"),
])
def test_bad_pictures(load, tmp_path, name, message):
    (tmp_path / "secret.png").write_bytes(png(PIXELS))
    whole = png(np.random.default_rng(2).integers(0, 256, (64, 64, 3), dtype=np.uint8))
    with pytest.raises(SceneError, match=message):
        load(f"map_Kd {name}\n", broken_png=b"no picture", cut_png=whole[:2000], bomb_png=claiming(whole, 30000),
             large_png=claiming(whole, 9000))


def claiming(data, side):
    """The same PNG, with a header that claims so many pixels a side."""
    header = data[12:16] + side.to_bytes(4, "big") * 2 + data[24:29]
    return data[:12] + header + zlib.crc32(header).to_bytes(4, "big") + data[33:]


def test_a_missing_picture_is_warned_of(load):
    scene = load("map_Kd none.png\nKd 0.5 0 0\n")
    assert scene.warnings == ["texture 'none.png': No such file or directory; drawn without it"]
    assert material_of(scene).texture is None
    assert material_of(scene).base_color == (0.5, 0, 0)


def test_options_of_texture_lines_are_skipped_and_named(load):
    scene = load("map_Kd -s 2 3 -o 0.5 0 1 -clamp on t u.png\nbump b.png\nmap_Ks k.png\n", **{"t u_png": png(PIXELS)})
    assert material_of(scene).texture.name == "t u.png"
    (warning,) = scene.warnings
    assert warning.endswith("a.mtl: cannot be drawn, left out: bump, map_Ks, option -clamp of map_Kd, option -o of "
                            "map_Kd, option -s of map_Kd")


@pytest.mark.parametrize("pixels", [np.zeros((3, 4, 4), np.uint8), np.zeros((4, 4, 3), np.uint8), np.zeros((4, 4, 4)),
                                    np.zeros((0, 4, 4), np.uint8), np.zeros((8192, 1, 4), np.uint8)])
def test_textures_have_sides_that_the_shader_addresses(pixels):
    with pytest.raises(SceneError, match=r"texture 'x': must be uint8\[height, width, 4\] with sides that are powers"):
        Texture("x", pixels)
