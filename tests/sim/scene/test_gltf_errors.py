import json
import struct

import numpy as np
import pytest

from sim.scene import SceneError, load_scene

from .gltf_builder import Builder


def simple():
    builder = Builder()
    builder.node(mesh=builder.mesh(dict(builder.triangle(), indices=builder.scalars([0, 1, 2], "H"))))
    return builder


def changed(*path):
    """Function that sets an entry of a simple document: keys, then the value; None removes it."""
    *keys, last, value = path

    def change(builder):
        place = builder.document
        for key in keys:
            place = place[key]
        if value is None:
            del place[last]
        elif isinstance(place, list) and last == len(place):
            place.append(value)
        else:
            place[last] = value

    return change


@pytest.mark.parametrize(("change", "message"), [
    (changed("buffers", 0, "uri", "../secret.bin"), r"buffers\[0\]: '../secret.bin' leads out of the scene's folder"),
    (changed("buffers", 0, "uri", "%2e%2e/secret.bin"), "leads out of the scene's folder"),
    (changed("buffers", 0, "uri", "/etc/passwd"), "leads out of the scene's folder"),
    (changed("buffers", 0, "uri", "..\\secret.bin"), "leads out of the scene's folder"),
    (changed("buffers", 0, "uri", "file:///etc/passwd"), "only files beside the scene are read"),
    (changed("buffers", 0, "uri", "http://a.example/b.bin"), "only files beside the scene are read"),
    (changed("buffers", 0, "uri", "none.bin"), r"buffers\[0\]: .*none.bin: No such file"),
    (changed("buffers", 0, "uri", "data:;base64,!!!"), r"buffers\[0\]: bad base64"),
    (changed("buffers", 0, "uri", "data:;base64,AAAA"), r"buffers\[0\]: claims 42 bytes but has 3; it is cut short"),
    (changed("buffers", 0, "uri", 7), r"buffers\[0\]: 'uri' must be a string, not 7"),
    (changed("buffers", 0, "byteLength", 10 ** 15), r"buffers\[0\]: claims 1000000000000000 bytes"),
    (changed("buffers", 0, "byteLength", -1), "'byteLength' must not be negative"),
    (changed("bufferViews", 0, "buffer", 1), r"bufferViews\[0\]: 'buffer' names buffers\[1\], which does not exist"),
    (changed("bufferViews", 0, "byteLength", 999), r"bufferViews\[0\]: ends at byte 999 of a buffer of 44"),
    (changed("bufferViews", 0, "byteStride", 4), r"bufferViews\[0\]: byteStride 4 is less than the 12 bytes"),
    (changed("bufferViews", 0, "byteOffset", -4), "'byteOffset' must not be negative"),
    (changed("accessors", 0, "count", 4), r"accessors\[0\]: 4 elements end at byte 48, bufferViews\[0\] has 36"),
    (changed("accessors", 0, "count", 10 ** 12), r"accessors\[0\]: 1000000000000 elements end at byte"),
    (changed("accessors", 0, "count", 2.5), "'count' must be a whole number, not 2.5"),
    (changed("accessors", 0, "byteOffset", 8), "end at byte 44"),
    (changed("accessors", 0, "bufferView", 9), r"accessors\[0\]: 'bufferView' names bufferViews\[9\]"),
    (changed("accessors", 0, "type", "VEC2"), "type VEC2 of component type 5126 cannot be used here; VEC3 can"),
    (changed("accessors", 0, "componentType", 5124), "component type 5124 cannot be used"),
    (changed("accessors", 1, "componentType", 5122), "SCALAR of unsigned integers can"),
    (changed("accessors", 0, "sparse", dict(count=1)), r"accessors\[0\].sparse: needs 'indices' and 'values'"),
    (changed("accessors", 0, "sparse", dict(count=1, indices=dict(bufferView=0, componentType=5121, byteOffset=15),
                                            values=dict(bufferView=0))), r"sparse.indices: index 63 is out of range"),
    (changed("accessors", 0, dict(componentType=5126, count=10 ** 12, type="VEC3")), "elements without data; at most"),
    (changed("meshes", 0, "primitives", 0, "indices", 7), r"primitives\[0\]: 'indices' names accessors\[7\]"),
    (changed("meshes", 0, "primitives", 0, "attributes", "NORMAL", 1), "type SCALAR"),
    (changed("meshes", 0, "primitives", 0, "material", 0), r"'material' names materials\[0\], which does not exist"),
    (changed("meshes", 0, "primitives", 5), r"meshes\[0\]: 'primitives' must be a list, not 5"),
    (changed("meshes", 0, 5), r"meshes\[0\]: must be a JSON object, not int"),
    (changed("nodes", 0, "mesh", 3), r"nodes\[0\]: 'mesh' names meshes\[3\], which does not exist; there are 1"),
    (changed("nodes", 0, "mesh", True), r"nodes\[0\]: 'mesh' must be a whole number, not True"),
    (changed("nodes", 0, "children", [0]), r"nodes\[0\]: is its own ancestor; the node hierarchy has a cycle"),
    (changed("nodes", 0, "children", ["a"]), r"'children' names nodes\['a'\]"),
    (changed("nodes", 0, "scale", [1, 0, 1]), r"node 'nodes\[0\]' \(instance 0\): transform is singular"),
    (changed("nodes", 0, "scale", [1, 1]), r"nodes\[0\]: 'scale' must be a list of 3 finite numbers"),
    (changed("nodes", 0, "matrix", [0] * 16), "transform is singular"),
    (changed("nodes", 0, "translation", [float("nan"), 0, 0]), "list of 3 finite numbers"),
    (changed("nodes", []), "scene is empty"),
    (changed("nodes", None), "scene is empty"),
    (changed("asset", "version", "1.0"), "glTF version 1.0 is not supported; convert it"),
    (changed("asset", None), "glTF version unknown"),
    (changed("extensionsRequired", ["KHR_draco_mesh_compression"]), "requires extensions .*draco.*export without"),
    (changed("scenes", [dict(nodes=[4])]), r"scenes\[0\]: 'nodes' names nodes\[4\]"),
])
def test_errors_name_the_element(load_glb, change, message):
    builder = simple()
    change(builder)
    with pytest.raises(SceneError, match=message):
        load_glb(builder)


def test_shown_scene_must_exist(load_glb):
    builder = simple()
    builder.document.update(scenes=[dict(nodes=[0])], scene=2)
    with pytest.raises(SceneError, match=r"'scene' names scenes\[2\], which does not exist; there are 1"):
        load_glb(builder)


@pytest.mark.parametrize("perspective", [dict(yfov=4.0), dict(yfov=0), dict(yfov=1.0, aspectRatio=0)])
def test_field_of_view_must_be_possible(load_glb, perspective):
    builder = simple()
    builder.document["cameras"] = [dict(perspective=perspective)]
    builder.node(camera=0)
    with pytest.raises(SceneError, match=r"cameras\[0\].perspective: yfov must be within"):
        load_glb(builder)


def test_index_out_of_range(builder, load_glb):
    builder.node(mesh=builder.mesh(dict(builder.triangle(), indices=builder.scalars([0, 1, 3], "B"))))
    with pytest.raises(SceneError, match=r"primitives\[0\]: vertex index 3 is out of range; there are 3 vertices"):
        load_glb(builder)


def test_longer_cycles_and_shared_children(builder, load_glb):
    builder.node(mesh=builder.mesh(builder.triangle()))
    builder.node(children=[2])
    builder.node(children=[1])
    with pytest.raises(SceneError, match=r"nodes\[1\]: is its own ancestor"):
        load_glb(builder)
    builder.document["nodes"][2]["children"] = [0]
    builder.document["nodes"][1]["children"] = [0]
    with pytest.raises(SceneError, match=r"nodes\[2\]: node 0 is a child of node 1 too"):
        load_glb(builder)


@pytest.mark.parametrize(("times", "values", "sampler", "message"), [
    ([0, 0], [(1, 1, 1)] * 2, {}, "must be finite and increasing"),
    ([1, 0], [(1, 1, 1)] * 2, {}, "must be finite and increasing"),
    ([0, np.inf], [(1, 1, 1)] * 2, {}, "must be finite and increasing"),
    ([0, 1], [(1, 1, 1)] * 3, {}, "needs 2 finite values for 2 key frames, has 3"),
    ([0, 1], [(1, 1, 1)] * 2, dict(interpolation="CUBICSPLINE"), "needs 6 finite values for 2 key frames, has 2"),
    ([0, 1], [(1, 1, np.nan)] * 2, {}, "needs 2 finite values"),
    ([0, 1], [(1, 1, 1)] * 2, dict(interpolation="MAGIC"), "interpolation 'MAGIC' is unknown"),
    ([0, 1], [(1, 1, 1, 1)] * 2, {}, "type VEC4 .* VEC3 can")])
def test_bad_key_frames(builder, load_glb, times, values, sampler, message):
    builder.node(mesh=builder.mesh(builder.triangle()))
    builder.animate(0, "translation", times, values, **sampler)
    with pytest.raises(SceneError, match=message):
        load_glb(builder)


@pytest.mark.parametrize(("change", "message"), [
    (lambda data: data[:8], "GLB header is cut short: 8 bytes of 12"),
    (lambda data: data[:4] + struct.pack("<I", 1) + data[8:], "GLB version 1 is not supported"),
    (lambda data: data[:-1], "it is cut short"),
    (lambda data: data[:12] + struct.pack("<I", 10 ** 9) + data[16:], "GLB chunk at byte 12 claims 1000000000 bytes"),
    (lambda data: data[:16] + b"NOPE" + data[20:], "GLB has no JSON chunk"),
    (lambda data: b"{" + data[1:], "not valid JSON"),
    (lambda data: b"[1, 2]", "glTF: must be a JSON object, not list"),
    (lambda data: b"[" * 100_000, "not valid JSON")])
def test_broken_containers(tmp_path, change, message):
    (tmp_path / "test.glb").write_bytes(change(simple().glb()))
    with pytest.raises(SceneError, match=f"test.glb: {message}" if message[0] != "i" else message):
        load_scene(tmp_path / "test.glb")


def test_link_out_of_the_folder(tmp_path):
    builder = simple()
    (tmp_path / "secret.bin").write_bytes(builder.binary)
    (tmp_path / "scene").mkdir()
    (tmp_path / "scene" / "link.bin").symlink_to(tmp_path / "secret.bin")
    builder.document["buffers"][0]["uri"] = "link.bin"
    (tmp_path / "scene" / "test.gltf").write_text(json.dumps(builder.document))
    with pytest.raises(SceneError, match="leads out of the scene's folder"):
        load_scene(tmp_path / "scene" / "test.gltf")


def test_zeros_are_counted_over_the_whole_file(load_glb):
    builder = simple()
    builder.document["accessors"].append(dict(componentType=5121, count=3 << 20, type="VEC3"))
    builder.document["meshes"][0]["primitives"] = 9 * [
        dict(attributes=dict(POSITION=len(builder.document["accessors"]) - 1))]
    with pytest.raises(SceneError, match=r"3145728 elements without data; at most 16777216 are taken of a file"):
        load_glb(builder)
