"""Materials, lights and skies: what may be in them, and what MTL and glTF make of theirs."""

import base64
import io
import math

import numpy as np
import pytest
from PIL import Image

from sim.scene import Light, Material, Scene, SceneError, Sky, load_scene

from .test_scene import TRIANGLE as MESH
from .test_scene import Instance

OBJ = "mtllib a.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl m\nf 1 2 3\n"


@pytest.fixture
def mtl(tmp_path):
    """Function from a material's lines to the material."""
    def write_and_load(lines):
        (tmp_path / "a.mtl").write_text("newmtl m\n" + lines)
        (tmp_path / "a.obj").write_text(OBJ)
        scene = load_scene(tmp_path / "a.obj")
        return scene.materials[scene.meshes[0].material_ids[0]]

    return write_and_load


def test_plain_mtl_is_matt_or_shiny(mtl):
    plain = mtl("Kd 0.5 0.25 0\nKs 0.1 0.4 0.2\nNs 37\nKe 0 0.5 9\n")
    assert (plain.base_color, plain.specular, plain.shininess, plain.emission) == ((0.5, 0.25, 0), 0.4, 37, (0, 0.5, 1))
    assert (plain.reflection, plain.transmission, plain.opacity, plain.alpha_mode) == (0, 0, 1, "opaque")
    assert mtl("Kd 0.5 0.25 0\nKs 1 1 1\nillum 1\n").specular == 0


def test_mtl_mirrors_metals_and_glass(mtl):
    chrome = mtl("Kd 0 0 0\nKs 0.8 0.8 0.8\nillum 3\n")
    assert (chrome.base_color, chrome.reflection, chrome.tinted) == ((0.8, 0.8, 0.8), 1, True)
    varnish = mtl("Kd 0.5 0 0\nKs 0.3 0.3 0.3\nillum 5\n")
    assert (varnish.reflection, varnish.fresnel, varnish.tinted) == (0.3, True, False)
    crystal = mtl("Kd 0 0 0\nKs .04 .04 .04\nTf .96 .9 .8\nd 0.1\nNi 1.5\nillum 4\n")
    assert (crystal.base_color, crystal.transmission, crystal.ior) == ((0.96, 0.9, 0.8), 0.9, 1.5)
    assert (crystal.reflection, crystal.fresnel, crystal.thin) == (0.04, True, False)
    assert mtl("Kd 1 1 1\nd 0.5\nillum 9\n").thin


@pytest.mark.parametrize("lines", ["d 0.25\n", "Tr 0.75\n"])
def test_mtl_veils(mtl, lines):
    veil = mtl("Kd 1 0 0\n" + lines)
    assert (veil.opacity, veil.alpha_mode, veil.transmission) == (0.25, "blend", 0)


@pytest.mark.parametrize(("lines", "message"), [
    ("Ns shiny\n", r"a\.mtl:2: could not convert string to float: 'shiny'"), ("Ni\n", r"a\.mtl:2: 'Ni' needs a finite"),
    ("d inf\n", r"a\.mtl:2: 'd' needs a finite number"), ("Tf 1 1\n", r"a\.mtl:2: 'Tf' needs three finite")])
def test_bad_numbers_in_mtl(mtl, lines, message):
    with pytest.raises(SceneError, match=message):
        mtl(lines)


def test_numbers_out_of_range_are_bounded(mtl):
    material = mtl("Kd 2 -1 0.5\nd 7\nNs -3\nNi 0\nKs 9 9 9\n")
    assert (material.base_color, material.opacity, material.shininess) == ((1, 0, 0.5), 1, 0)
    assert material.specular == 1


@pytest.mark.parametrize(("field", "value", "what"), [
    ("specular", 1.5, "within 0…1"), ("reflection", -0.1, "within 0…1"), ("opacity", math.nan, "within 0…1"),
    ("ior", 0.0, "positive"), ("ior", math.inf, "positive"), ("shininess", -1.0, "not negative"),
    ("alpha_mode", "clear", "opaque or mask or blend"), ("emission", (1, 2, 0), "three numbers within 0…1"),
    ("base_color", (0.5, 0.5), "three numbers within 0…1")])
def test_materials_must_make_sense(field, value, what):
    with pytest.raises(SceneError, match=f"material 'm': {field} must be {what}, not"):
        Material("m", **{"base_color": (1, 1, 1), field: value})


@pytest.mark.parametrize(("values", "message"), [
    (dict(kind="area"), "light 'l': kind must be point, spot, directional, not 'area'"),
    (dict(position=(1, 2)), "light 'l': position must be three finite numbers"),
    (dict(position=(1, 2, math.nan)), "light 'l': position must be three finite numbers"),
    (dict(direction=(0, 0, 0)), "light 'l': direction is zero"),
    (dict(color=(1, -1, 0)), "light 'l': color must be three finite numbers, not negative"),
    (dict(intensity=-1.0), "light 'l': intensity must not be negative, it is -1.0"),
    (dict(intensity=math.inf), "light 'l': intensity must not be negative, it is inf"),
    (dict(reach=-2.0), "light 'l': reach must not be negative")])
def test_lights_must_make_sense(values, message):
    with pytest.raises(SceneError, match=message):
        Light(**{"kind": "point", "name": "l", **values})


def test_the_shader_has_room_for_256_lights():
    def scene(count):
        return Scene([MESH], [Instance(0, np.eye(3, 4), "i")], [Material("m", (1, 1, 1))],
                     lights=[Light("point")] * count)

    assert len(scene(256).lights) == 256
    with pytest.raises(SceneError, match="scene has 257 lights; the shader has room for 256; leave some out"):
        scene(257)


@pytest.mark.parametrize("pixels", [np.zeros((4, 8, 3), np.uint8), np.zeros((6, 6, 3), np.uint8),
                                    np.zeros((4, 4, 4), np.uint8), np.zeros((4, 4, 3)), np.zeros((0, 0, 3), np.uint8)])
def test_skies_are_square(pixels):
    with pytest.raises(SceneError, match=r"sky must be uint8\[N, N, 3\] with N a power of two"):
        Sky(pixels)


def gltf_material(builder, load_glb, **properties):
    builder.document["materials"] = [dict(name="m", **properties)]
    builder.node(mesh=builder.mesh(builder.triangle(material=0)))
    scene = load_glb(builder)
    return scene.materials[1], scene.warnings


def test_gltf_metal_and_matt(builder, load_glb):
    material, warnings = gltf_material(builder, load_glb, pbrMetallicRoughness=dict(
        baseColorFactor=[1, 0.5, 0.25, 1], metallicFactor=1, roughnessFactor=0.0), emissiveFactor=[0, 0.5, 0])
    assert (material.reflection, material.tinted, material.fresnel) == (1, True, False)
    assert (material.shininess_log2, material.specular, material.emission) == (10, 1, (0, 0.5, 0))
    assert warnings == []


def test_gltf_rough_dielectric_mirrors_nothing(builder, load_glb):
    material, _ = gltf_material(builder, load_glb, pbrMetallicRoughness=dict(metallicFactor=0, roughnessFactor=0.5))
    # α = 1/4: Blinn's exponent 2/α² − 2 = 30, a quarter about the mirrored direction; (30 + 2)/8 · 0.04 strong.
    assert (material.reflection, material.tinted, material.shininess) == (0, False, 7.5)
    assert material.specular == pytest.approx(0.16)


@pytest.mark.parametrize(("extra", "thin"), [({}, True), (dict(KHR_materials_volume=dict(thicknessFactor=0.1)), False)])
def test_gltf_glass(builder, load_glb, extra, thin):
    builder.document["extensionsRequired"] = ["KHR_materials_transmission"]
    material, warnings = gltf_material(
        builder, load_glb, pbrMetallicRoughness=dict(metallicFactor=0, roughnessFactor=0),
        extensions=dict(KHR_materials_transmission=dict(transmissionFactor=0.75), KHR_materials_ior=dict(ior=2.0),
                        **extra))
    assert (material.transmission, material.ior, material.thin, material.fresnel) == (0.75, 2, thin, True)
    assert material.reflection == pytest.approx(1 / 9)
    assert warnings == []


@pytest.mark.parametrize(("mode", "expected"), [("OPAQUE", "opaque"), ("MASK", "mask"), ("BLEND", "blend")])
def test_gltf_alpha(builder, load_glb, mode, expected):
    material, _ = gltf_material(builder, load_glb, alphaMode=mode, alphaCutoff=0.25,
                                pbrMetallicRoughness=dict(baseColorFactor=[1, 1, 1, 0.5]))
    assert (material.alpha_mode, material.opacity, material.alpha_cutoff) == (expected, 0.5, 0.25)


PICTURE = np.random.default_rng(1).integers(0, 256, (2, 4, 4), dtype=np.uint8)


def picture():
    file = io.BytesIO()
    Image.fromarray(PICTURE).save(file, "PNG")
    return file.getvalue()


@pytest.mark.parametrize("where", ["view", "data", "file"])
def test_gltf_textures(builder, load_glb, tmp_path, where):
    (tmp_path / "a b.png").write_bytes(picture())
    image = {"view": lambda: dict(bufferView=builder.view(picture()), mimeType="image/png"),
             "data": lambda: dict(uri="data:image/png;base64," + base64.b64encode(picture()).decode()),
             "file": lambda: dict(uri="a%20b.png")}[where]()
    builder.document.update(images=[image], samplers=[dict(magFilter=9728)],
                            textures=[dict(source=0, sampler=0), dict(source=0)])
    for index, filtered in ((0, False), (1, True)):
        material, warnings = gltf_material(builder, load_glb,
                                           pbrMetallicRoughness=dict(baseColorTexture=dict(index=index)))
        assert (material.texture.pixels == PICTURE).all()
        assert material.texture.filtered == filtered
        assert warnings == []


def test_what_gltf_has_and_nothing_draws_is_named_once(builder, load_glb):
    builder.document.update(
        images=[dict(bufferView=builder.view(picture()))], samplers=[dict(wrapS=33071)],
        textures=[dict(source=0, sampler=0)], materials=[
            dict(normalTexture=dict(index=0), extensions=dict(KHR_materials_sheen={}),
                 pbrMetallicRoughness=dict(baseColorTexture=dict(index=0, texCoord=1))) for _ in range(3)])
    part = builder.triangle(material=0)
    part["attributes"]["COLOR_0"] = part["attributes"]["POSITION"]
    builder.node(mesh=builder.mesh(part, dict(part)))
    assert load_glb(builder).warnings == [
        "vertex colours (COLOR_0) cannot be drawn; left out",
        "materials[0].pbrMetallicRoughness.baseColorTexture and 2 more: a second set of texture coordinates cannot be "
        "drawn; left out",
        "samplers[0] and 2 more: a wrap mode other than repeat cannot be drawn; left out",
        "materials[0] and 2 more: extension KHR_materials_sheen cannot be drawn; left out",
        "materials[0] and 2 more: normalTexture cannot be drawn; left out"]


@pytest.mark.parametrize(("image", "message"), [
    (dict(uri="../x.png"), r"images\[0\]: '../x.png' leads out of the scene's folder"),
    (dict(uri="http://a.example/x.png"), r"images\[0\]: .*only files beside the scene are read"),
    (dict(uri="none.png"), r"images\[0\]: .*none.png: No such file"),
    (dict(uri="data:image/png;base64,AAAA"), r"images\[0\]: texture 'data.*cannot be read: not a picture"),
    (dict(uri="data:image/png;base64,!"), r"images\[0\]: bad base64"),
    (dict(bufferView=7), r"images\[0\]: 'bufferView' names bufferViews\[7\]"),
    ({}, r"images\[0\]: 'bufferView' is missing")])
def test_bad_gltf_images(builder, load_glb, image, message):
    builder.document.update(images=[image], textures=[dict(source=0)])
    with pytest.raises(SceneError, match=message):
        gltf_material(builder, load_glb, pbrMetallicRoughness=dict(baseColorTexture=dict(index=0)))


def lit(builder, *lights, nodes=None):
    builder.document["extensions"] = dict(KHR_lights_punctual=dict(lights=list(lights)))
    builder.node(mesh=builder.mesh(builder.triangle()))
    for node in nodes or [dict()] * len(lights):
        builder.node(**{"extensions": dict(KHR_lights_punctual=dict(light=0)), **node})


def test_gltf_lights_stand_where_their_nodes_are(builder, load_glb):
    half = math.sqrt(0.5)
    lit(builder, dict(type="spot", color=[1, 0.5, 0], intensity=2 * math.pi, range=9,
                      spot=dict(innerConeAngle=0.1, outerConeAngle=0.5)),
        nodes=[dict(translation=[1, 2, 3], rotation=[half, 0, 0, half], scale=[2, 2, 2])])
    (light,) = load_glb(builder).lights
    assert light.position == pytest.approx((1, 2, 3))
    # Turned by 90° about x, −z becomes +y.
    assert light.direction == pytest.approx((0, 1, 0))
    assert (light.kind, light.color, light.intensity, light.reach) == ("spot", (1, 0.5, 0), 2, 9)
    scale, offset, squarings = light.cone
    assert [math.cos(angle) * scale + offset for angle in (0.1, 0.5)] == pytest.approx([1, 0], abs=1e-12)
    assert squarings == 1


def test_gltf_lights_move(builder, load_glb):
    lit(builder, dict(type="point", intensity=math.pi))
    builder.animate(1, "translation", [0, 2], [(0, 0, 0), (4, 0, 0)])
    scene = load_glb(builder)
    assert scene.lights[0].position.tolist() == [0, 0, 0]
    assert scene.at_time(1.0).lights[0].position.tolist() == [2, 0, 0]
    assert scene.at_time(1.0).lights[0].intensity == 1


def test_only_as_many_gltf_lights_as_there_is_room_for(builder, load_glb):
    lit(builder, dict(type="directional"), nodes=[dict()] * 300)
    scene = load_glb(builder)
    assert len(scene.lights) == 256
    assert scene.warnings == ["the file has 300 lights; the first 256 are drawn"]


@pytest.mark.parametrize(("light", "message"), [
    (dict(type="area"), r"lights\[0\]: type 'area' is unknown; use point, spot or directional"),
    (dict(), r"lights\[0\]: 'type' is missing"), (dict(type="point", range=0), r"range must be positive, not 0"),
    (dict(type="spot", spot=dict(innerConeAngle=1, outerConeAngle=0.5)), r"lights\[0\].spot: angles must be 0 ≤ inner"),
    (dict(type="point", color=[1, 2]), r"'color' must be a list of 3 finite numbers")])
def test_bad_gltf_lights(builder, load_glb, light, message):
    lit(builder, light)
    with pytest.raises(SceneError, match=message):
        load_glb(builder)


def test_a_node_names_a_light_that_is_there(builder, load_glb):
    lit(builder, dict(type="point"), nodes=[dict(extensions=dict(KHR_lights_punctual=dict(light=1)))])
    message = r"nodes\[1\].extensions.KHR_lights_punctual: 'light' 1 does not exist; there are 1"
    with pytest.raises(SceneError, match=message):
        load_glb(builder)


def test_other_required_extensions_are_refused(builder, load_glb):
    builder.document["extensionsRequired"] = ["KHR_lights_punctual", "EXT_meshopt_compression"]
    with pytest.raises(SceneError, match=r"requires extensions .*export without"):
        gltf_material(builder, load_glb)


