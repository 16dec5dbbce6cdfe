import base64
import json
import struct

import numpy as np
import pytest
import trimesh

from sim.scene import SceneError, load_scene

COMPONENTS = {"b": 5120, "B": 5121, "h": 5122, "H": 5123, "I": 5125, "f": 5126}
TYPES = {1: "SCALAR", 2: "VEC2", 3: "VEC3", 4: "VEC4"}


class Builder:
    """Puts a glTF document together: every accessor gets a view of its own in one buffer."""

    def __init__(self):
        self.binary = b""
        self.document = dict(asset=dict(version="2.0"), buffers=[dict(byteLength=0)], bufferViews=[], accessors=[],
                             meshes=[], nodes=[])

    def view(self, data, **extra):
        self.binary += b"\0" * (-len(self.binary) % 4)
        self.document["bufferViews"].append(
            dict(buffer=0, byteOffset=len(self.binary), byteLength=len(data), **extra))
        self.binary += data
        self.document["buffers"][0]["byteLength"] = len(self.binary)
        return len(self.document["bufferViews"]) - 1

    def accessor(self, values, code="f", **extra):
        values = np.atleast_2d(np.array(values, dtype=np.dtype(code).newbyteorder("<")))
        if values.shape[0] == 1 and extra.pop("scalars", False):
            values = values.T
        self.document["accessors"].append(dict(
            bufferView=self.view(values.tobytes()), componentType=COMPONENTS[code], count=values.shape[0],
            type=TYPES[values.shape[1]], **extra))
        return len(self.document["accessors"]) - 1

    def scalars(self, values, code="f", **extra):
        return self.accessor(values, code, scalars=True, **extra)

    def mesh(self, *primitives, **extra):
        self.document["meshes"].append(dict(primitives=list(primitives), **extra))
        return len(self.document["meshes"]) - 1

    def triangle(self, **extra):
        return dict(attributes=dict(POSITION=self.accessor([(0, 0, 0), (1, 0, 0), (0, 1, 0)])), **extra)

    def node(self, **properties):
        self.document["nodes"].append(properties)
        return len(self.document["nodes"]) - 1

    def glb(self):
        text = json.dumps(self.document).encode()
        text += b" " * (-len(text) % 4)
        binary = self.binary + b"\0" * (-len(self.binary) % 4)
        chunks = struct.pack("<II", len(text), 0x4E4F534A) + text + struct.pack("<II", len(binary), 0x004E4942) + binary
        return struct.pack("<III", 0x46546C67, 2, 12 + len(chunks)) + chunks


@pytest.fixture
def builder():
    return Builder()


@pytest.fixture
def load(tmp_path):
    def write_and_load(builder):
        (tmp_path / "test.glb").write_bytes(builder.glb())
        return load_scene(tmp_path / "test.glb")

    return write_and_load


def corners(mesh):
    return mesh.vertices[mesh.triangles].tolist()


def test_one_triangle_in_each_container(builder, tmp_path):
    builder.node(mesh=builder.mesh(builder.triangle(), name="tri"), name="here")
    (tmp_path / "a.glb").write_bytes(builder.glb())
    uris = {"b.gltf": "b%20b.bin", "c.gltf": "data:application/octet-stream;base64," +
            base64.b64encode(builder.binary).decode()}
    (tmp_path / "b b.bin").write_bytes(builder.binary)
    for name, uri in uris.items():
        builder.document["buffers"][0]["uri"] = uri
        (tmp_path / name).write_text(json.dumps(builder.document))
    for name in ("a.glb", *uris):
        scene = load_scene(tmp_path / name)
        assert corners(scene.meshes[0]) == [[[0, 0, 0], [1, 0, 0], [0, 1, 0]]]
        assert scene.instances[0].name == "here" and scene.meshes[0].name == "tri"
        assert scene.warnings == [] and not scene.is_animated


def test_a_file_written_by_another_program(tmp_path):
    box = trimesh.creation.box((1, 2, 3))
    scene = trimesh.Scene()
    places = [trimesh.transformations.rotation_matrix(angle, (1, 2, 3), (4, 5, 6)) for angle in (0.1, 1.0, 2.0)]
    scene.add_geometry(box, geom_name="box", node_name="n0", transform=places[0])
    for i, place in enumerate(places[1:], start=1):
        scene.graph.update(frame_to=f"n{i}", geometry="box", matrix=place)
    (tmp_path / "test.glb").write_bytes(scene.export(file_type="glb"))
    loaded = load_scene(tmp_path / "test.glb")
    assert len(loaded.meshes) == 1 and loaded.num_triangles == 36 and loaded.num_stored_triangles == 12
    for instance in loaded.instances:
        assert instance.transform == pytest.approx(places[int(instance.name[1:])][:3], abs=1e-6)


def test_hierarchy_is_multiplied_out_in_file_order(builder, load):
    mesh = builder.mesh(builder.triangle())
    half = np.sqrt(0.5)
    builder.node(mesh=mesh, translation=[1, 0, 0], name="leaf")
    builder.node(children=[0, 3], rotation=[0, 0, half, half], name="turn")
    builder.node(children=[1], scale=[2, 3, 4], translation=[10, 20, 30], name="root")
    builder.node(mesh=mesh, matrix=[1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 5, 0, 1], name="matrix")
    builder.node(mesh=mesh, name="alone")
    scene = load(builder)
    assert [instance.name for instance in scene.instances] == ["leaf", "matrix", "alone"]
    assert len(scene.meshes) == 1
    # Turned by 90° about z: x becomes y, y becomes -x; then stretched, then moved.
    linear = [[0, -2, 0], [3, 0, 0], [0, 0, 4]]
    assert scene.instances[0].transform == pytest.approx(np.column_stack([linear, [10, 23, 30]]), abs=1e-7)
    assert scene.instances[1].transform == pytest.approx(np.column_stack([linear, [0, 20, 30]]), abs=1e-7)
    assert (scene.instances[2].transform == np.eye(3, 4)).all()


def test_only_the_shown_scene_is_read(builder, load):
    mesh, other = builder.mesh(builder.triangle()), builder.mesh(dict(attributes=dict(POSITION=99)))
    builder.node(mesh=other)
    builder.node(mesh=mesh, name="child")
    builder.node(children=[1])
    builder.document.update(scenes=[dict(nodes=[0]), dict(nodes=[2])], scene=1)
    assert [instance.name for instance in load(builder).instances] == ["child"]


def test_modes_and_indices(builder, load):
    points = builder.accessor([(i, i * i, 0) for i in range(6)])
    primitives = [dict(attributes=dict(POSITION=points), mode=mode, **indices) for mode, indices in (
        (4, {}), (4, dict(indices=builder.scalars([5, 4, 3, 0, 1, 2, 1], "B"))),
        (5, dict(indices=builder.scalars([0, 1, 2, 3, 4], "H"))), (6, dict(indices=builder.scalars([5, 1, 2, 3], "I"))),
        (1, {}), (0, {}))]
    builder.node(mesh=builder.mesh(*primitives))
    scene = load(builder)
    (mesh,) = scene.meshes
    assert mesh.vertices[mesh.triangles][:, :, 0].tolist() == [
        [0, 1, 2], [3, 4, 5], [5, 4, 3], [0, 1, 2], [0, 1, 2], [2, 1, 3], [2, 3, 4], [5, 1, 2], [5, 2, 3]]
    assert scene.warnings == ["meshes[0].primitives[4]: mode 1 (lines) is not supported; left out",
                              "meshes[0].primitives[5]: mode 0 (points) is not supported; left out"]


def test_materials_follow_primitives(builder, load):
    builder.document["materials"] = [
        dict(name="a", pbrMetallicRoughness=dict(baseColorFactor=[0.25, 0.5, 2.0, 0.1])), dict()]
    builder.node(mesh=builder.mesh(builder.triangle(material=1), builder.triangle(material=0), builder.triangle()))
    scene = load(builder)
    looks = [scene.materials[i] for i in scene.meshes[0].material_ids]
    assert [look.base_color for look in looks] == [(1, 1, 1), (0.25, 0.5, 1), (0.8, 0.8, 0.8)]
    assert [look.name for look in looks] == ["materials[1]", "a", "default"]


def test_interleaved_normalized_and_sparse_accessors(builder, load):
    rows = np.zeros(3, dtype=[("position", "<f4", 3), ("uv", "<u2", 2), ("normal", "i1", 3), ("gap", "u1")])
    rows["position"] = [(0, 0, 0), (1, 0, 0), (0, 1, 0)]
    rows["uv"] = [(0, 65535), (65535, 0), (13107, 0)]
    rows["normal"] = [(0, 0, 127), (0, -127, 0), (-128, 0, 0)]
    view = builder.view(rows.tobytes(), byteStride=rows.itemsize)
    first = len(builder.document["accessors"])
    for offset, code, width, extra in ((0, "f", 3, {}), (12, "H", 2, dict(normalized=True)),
                                       (16, "b", 3, dict(normalized=True))):
        builder.document["accessors"].append(dict(bufferView=view, byteOffset=offset, componentType=COMPONENTS[code],
                                                  count=3, type=TYPES[width], **extra))
    sparse = dict(count=2, indices=dict(bufferView=builder.view(struct.pack("<2H", 0, 2)), componentType=5123),
                  values=dict(bufferView=builder.view(struct.pack("<6f", 7, 7, 7, 8, 8, 9))))
    builder.document["accessors"].append(dict(builder.document["accessors"][first], sparse=sparse))
    builder.document["accessors"].append(dict(componentType=5126, count=3, type="VEC3", sparse=sparse))
    attributes = dict(POSITION=first, TEXCOORD_0=first + 1, NORMAL=first + 2)
    builder.node(mesh=builder.mesh(dict(attributes=attributes), dict(attributes=dict(POSITION=first + 3)),
                                   dict(attributes=dict(POSITION=first + 4))))
    (mesh,) = load(builder).meshes
    assert corners(mesh) == [[[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[7, 7, 7], [1, 0, 0], [8, 8, 9]],
                             [[7, 7, 7], [0, 0, 0], [8, 8, 9]]]
    assert mesh.uvs[0] == pytest.approx(np.array([(0, 1), (1, 0), (0.2, 0)]))
    assert mesh.normals[0].tolist() == [[0, 0, 1], [0, -1, 0], [-1, 0, 0]]
    assert not mesh.uvs[1:].any() and not mesh.normals[1:].any()


def test_cameras(builder, load):
    builder.document["cameras"] = [
        dict(type="perspective", name="wide", perspective=dict(yfov=np.pi / 2, aspectRatio=2.0, znear=0.1)),
        dict(type="perspective", perspective=dict(yfov=2 * np.arctan(0.75), znear=0.1)),
        dict(type="orthographic", orthographic=dict())]
    builder.node(mesh=builder.mesh(builder.triangle()))
    half = np.sqrt(0.5)
    builder.node(camera=0, translation=[1, 2, 3], rotation=[0, half, 0, half], scale=[5, 5, 5])
    builder.node(camera=1, name="second")
    builder.node(camera=2)
    scene = load(builder)
    wide, second = scene.cameras
    assert wide.name == "wide" and second.name == "second"
    # Turned by 90° about y: -z becomes -x.
    right, up, forward = wide.basis()
    assert wide.eye.tolist() == [1, 2, 3]
    assert forward == pytest.approx([-1, 0, 0]) and up == pytest.approx([0, 1, 0]) and right == pytest.approx([0, 0, -1])
    assert wide.hfov_deg == pytest.approx(np.degrees(2 * np.arctan(2)))
    assert second.hfov_deg == pytest.approx(90) and scene.default_camera() is wide
    assert scene.warnings == ["cameras[2]: only perspective cameras are supported; left out"]


def animate(builder, node, path, times, values, **sampler):
    animation = dict(samplers=[dict(input=builder.scalars(times), output=builder.accessor(values), **sampler)],
                     channels=[dict(sampler=0, target=dict(node=node, path=path))])
    builder.document.setdefault("animations", []).append(animation)


def test_linear_step_and_spline_translation(builder, load):
    mesh = builder.mesh(builder.triangle())
    for _ in range(3):
        builder.node(mesh=mesh)
    animate(builder, 0, "translation", [1, 2, 4], [(0, 0, 0), (1, 2, 3), (5, 2, 3)])
    animate(builder, 1, "translation", [1, 2, 4], [(0, 0, 0), (1, 2, 3), (5, 2, 3)], interpolation="STEP")
    zero = (0, 0, 0)
    # In-tangent, value, out-tangent for each time.
    animate(builder, 2, "translation", [0, 2], [zero, zero, (1, 0, 0), (3, 0, 0), (4, 0, 0), zero],
            interpolation="CUBICSPLINE")
    scene = load(builder)
    assert scene.is_animated and scene.duration == 4

    def places(t):
        return [instance.transform[:, 3].tolist() for instance in scene.at_time(t).instances]

    # Hermite at s = 1/2 over 2 s: p0/2 + p1/2 + 2·(m0 − m1)/8 = 2 + (1 − 3)/4.
    assert places(1.0) == [[0, 0, 0], [0, 0, 0], [1.5, 0, 0]]
    assert places(1.5)[:2] == [[0.5, 1, 1.5], [0, 0, 0]]
    assert places(3.0) == [[3, 2, 3], [1, 2, 3], [4, 0, 0]]
    assert places(-1.0) == [[0, 0, 0], [0, 0, 0], [0, 0, 0]]
    assert places(99.0) == [[5, 2, 3], [5, 2, 3], [4, 0, 0]]
    assert (scene.instances[0].transform == np.eye(3, 4)).all()
    assert scene.at_time(3.0).meshes is scene.meshes


def test_rotation_goes_the_short_way_at_constant_speed_and_carries_children(builder, load):
    builder.node(children=[1])
    builder.node(mesh=builder.mesh(builder.triangle()), translation=[1, 0, 0])
    angle = np.radians(80)
    # The second quaternion is negated: the same rotation, the other way round.
    animate(builder, 0, "rotation", [0, 1], [(0, 0, 0, 1), (0, 0, -np.sin(angle / 2), -np.cos(angle / 2))])
    animate(builder, 0, "scale", [0, 1], [(1, 1, 1), (3, 3, 3)])
    scene = load(builder)
    for t in (0.0, 0.25, 0.5, 1.0):
        c, s, k = np.cos(t * angle), np.sin(t * angle), 1 + 2 * t
        expected = np.array([[c, -s, 0, c], [s, c, 0, s], [0, 0, 1, 0]]) * k
        assert scene.at_time(t).instances[0].transform == pytest.approx(expected, abs=1e-6)


def test_cameras_move_too(builder, load):
    builder.document["cameras"] = [dict(type="perspective", perspective=dict(yfov=1.0, aspectRatio=1.0))]
    builder.node(mesh=builder.mesh(builder.triangle()))
    builder.node(camera=0)
    animate(builder, 1, "translation", [0, 1], [(0, 0, 0), (2, 4, 6)])
    assert load(builder).at_time(0.5).cameras[0].eye.tolist() == [1, 2, 3]


def test_transform_that_becomes_singular_names_the_node(builder, load):
    builder.node(mesh=builder.mesh(builder.triangle()), name="flat")
    animate(builder, 0, "scale", [0, 1], [(1, 1, 1), (1, 1, -1)])
    scene = load(builder)
    with pytest.raises(SceneError, match="node 'flat'.*singular"):
        scene.at_time(0.5)


def test_unsupported_animation_is_warned_of(builder, load):
    builder.node(mesh=builder.mesh(builder.triangle()))
    animate(builder, 0, "weights", [0], [0.5])
    scene = load(builder)
    assert scene.warnings == ["animations[0].channels[0]: animation of 'weights' is not supported; left out"]
    assert not scene.is_animated


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


@pytest.mark.parametrize("change, message", [
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
def test_errors_name_the_element(load, change, message):
    builder = simple()
    change(builder)
    with pytest.raises(SceneError, match=message):
        load(builder)


def test_shown_scene_must_exist(load):
    builder = simple()
    builder.document.update(scenes=[dict(nodes=[0])], scene=2)
    with pytest.raises(SceneError, match=r"'scene' names scenes\[2\], which does not exist; there are 1"):
        load(builder)


@pytest.mark.parametrize("perspective", [dict(yfov=4.0), dict(yfov=0), dict(yfov=1.0, aspectRatio=0)])
def test_field_of_view_must_be_possible(load, perspective):
    builder = simple()
    builder.document["cameras"] = [dict(perspective=perspective)]
    builder.node(camera=0)
    with pytest.raises(SceneError, match=r"cameras\[0\].perspective: yfov must be within"):
        load(builder)


def test_index_out_of_range(builder, load):
    builder.node(mesh=builder.mesh(dict(builder.triangle(), indices=builder.scalars([0, 1, 3], "B"))))
    with pytest.raises(SceneError, match=r"primitives\[0\]: vertex index 3 is out of range; there are 3 vertices"):
        load(builder)


def test_longer_cycles_and_shared_children(builder, load):
    builder.node(mesh=builder.mesh(builder.triangle()))
    builder.node(children=[2])
    builder.node(children=[1])
    with pytest.raises(SceneError, match=r"nodes\[1\]: is its own ancestor"):
        load(builder)
    builder.document["nodes"][2]["children"] = [0]
    builder.document["nodes"][1]["children"] = [0]
    with pytest.raises(SceneError, match=r"nodes\[2\]: node 0 is a child of node 1 too"):
        load(builder)


@pytest.mark.parametrize("times, values, sampler, message", [
    ([0, 0], [(1, 1, 1)] * 2, {}, "must be finite and increasing"),
    ([1, 0], [(1, 1, 1)] * 2, {}, "must be finite and increasing"),
    ([0, np.inf], [(1, 1, 1)] * 2, {}, "must be finite and increasing"),
    ([0, 1], [(1, 1, 1)] * 3, {}, "needs 2 finite values for 2 key frames, has 3"),
    ([0, 1], [(1, 1, 1)] * 2, dict(interpolation="CUBICSPLINE"), "needs 6 finite values for 2 key frames, has 2"),
    ([0, 1], [(1, 1, np.nan)] * 2, {}, "needs 2 finite values"),
    ([0, 1], [(1, 1, 1)] * 2, dict(interpolation="MAGIC"), "interpolation 'MAGIC' is unknown"),
    ([0, 1], [(1, 1, 1, 1)] * 2, {}, "type VEC4 .* VEC3 can")])
def test_bad_key_frames(builder, load, times, values, sampler, message):
    builder.node(mesh=builder.mesh(builder.triangle()))
    animate(builder, 0, "translation", times, values, **sampler)
    with pytest.raises(SceneError, match=message):
        load(builder)


@pytest.mark.parametrize("change, message", [
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


def test_terrain(scene_file):
    scene = load_scene(scene_file("terrain.glb"))
    assert (scene.num_triangles, scene.num_stored_triangles, len(scene.instances)) == (10_472_954, 198_494, 257)
    assert scene.instances[1].transform[0] == pytest.approx([-3.391032, 0.246783, 0, 51.515152], abs=1e-6)
