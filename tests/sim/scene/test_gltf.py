import base64
import json
import struct

import numpy as np
import pytest
import trimesh

from sim.scene import SceneError, load_scene

from .gltf_builder import COMPONENTS, TYPES


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
        assert scene.instances[0].name == "here"
        assert scene.meshes[0].name == "tri"
        assert scene.warnings == []
        assert not scene.is_animated


def test_a_file_written_by_another_program(tmp_path):
    box = trimesh.creation.box((1, 2, 3))
    scene = trimesh.Scene()
    places = [trimesh.transformations.rotation_matrix(angle, (1, 2, 3), (4, 5, 6)) for angle in (0.1, 1.0, 2.0)]
    scene.add_geometry(box, geom_name="box", node_name="n0", transform=places[0])
    for i, place in enumerate(places[1:], start=1):
        scene.graph.update(frame_to=f"n{i}", geometry="box", matrix=place)
    (tmp_path / "test.glb").write_bytes(scene.export(file_type="glb"))
    loaded = load_scene(tmp_path / "test.glb")
    assert len(loaded.meshes) == 1
    assert loaded.num_triangles == 36
    assert loaded.num_stored_triangles == 12
    for instance in loaded.instances:
        assert instance.transform == pytest.approx(places[int(instance.name[1:])][:3], abs=1e-6)


def test_hierarchy_is_multiplied_out_in_file_order(builder, load_glb):
    mesh = builder.mesh(builder.triangle())
    half = np.sqrt(0.5)
    builder.node(mesh=mesh, translation=[1, 0, 0], name="leaf")
    builder.node(children=[0, 3], rotation=[0, 0, half, half], name="turn")
    builder.node(children=[1], scale=[2, 3, 4], translation=[10, 20, 30], name="root")
    builder.node(mesh=mesh, matrix=[1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 5, 0, 1], name="matrix")
    builder.node(mesh=mesh, name="alone")
    scene = load_glb(builder)
    assert [instance.name for instance in scene.instances] == ["leaf", "matrix", "alone"]
    assert len(scene.meshes) == 1
    # Turned by 90° about z: x becomes y, y becomes -x; then stretched, then moved.
    linear = [[0, -2, 0], [3, 0, 0], [0, 0, 4]]
    assert scene.instances[0].transform == pytest.approx(np.column_stack([linear, [10, 23, 30]]), abs=1e-7)
    assert scene.instances[1].transform == pytest.approx(np.column_stack([linear, [0, 20, 30]]), abs=1e-7)
    assert (scene.instances[2].transform == np.eye(3, 4)).all()


def test_only_the_shown_scene_is_read(builder, load_glb):
    mesh, other = builder.mesh(builder.triangle()), builder.mesh(dict(attributes=dict(POSITION=99)))
    builder.node(mesh=other)
    builder.node(mesh=mesh, name="child")
    builder.node(children=[1])
    builder.document.update(scenes=[dict(nodes=[0]), dict(nodes=[2])], scene=1)
    assert [instance.name for instance in load_glb(builder).instances] == ["child"]


def test_modes_and_indices(builder, load_glb):
    points = builder.accessor([(i, i * i, 0) for i in range(6)])
    primitives = [dict(attributes=dict(POSITION=points), mode=mode, **indices) for mode, indices in (
        (4, {}), (4, dict(indices=builder.scalars([5, 4, 3, 0, 1, 2, 1], "B"))),
        (5, dict(indices=builder.scalars([0, 1, 2, 3, 4], "H"))), (6, dict(indices=builder.scalars([5, 1, 2, 3], "I"))),
        (1, {}), (0, {}))]
    builder.node(mesh=builder.mesh(*primitives))
    scene = load_glb(builder)
    (mesh,) = scene.meshes
    assert mesh.vertices[mesh.triangles][:, :, 0].tolist() == [
        [0, 1, 2], [3, 4, 5], [5, 4, 3], [0, 1, 2], [0, 1, 2], [2, 1, 3], [2, 3, 4], [5, 1, 2], [5, 2, 3]]
    assert scene.warnings == ["meshes[0].primitives[4]: mode 1 (lines) is not supported; left out",
                              "meshes[0].primitives[5]: mode 0 (points) is not supported; left out"]


def test_materials_follow_primitives(builder, load_glb):
    builder.document["materials"] = [
        dict(name="a", pbrMetallicRoughness=dict(baseColorFactor=[0.25, 0.5, 2.0, 0.1])), dict()]
    builder.node(mesh=builder.mesh(builder.triangle(material=1), builder.triangle(material=0), builder.triangle()))
    scene = load_glb(builder)
    looks = [scene.materials[i] for i in scene.meshes[0].material_ids]
    assert [look.base_color for look in looks] == [(1, 1, 1), (0.25, 0.5, 1), (0.8, 0.8, 0.8)]
    assert [look.name for look in looks] == ["materials[1]", "a", "default"]


def test_interleaved_normalized_and_sparse_accessors(builder, load_glb):
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
    (mesh,) = load_glb(builder).meshes
    assert corners(mesh) == [[[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[7, 7, 7], [1, 0, 0], [8, 8, 9]],
                             [[7, 7, 7], [0, 0, 0], [8, 8, 9]]]
    assert mesh.uvs[0] == pytest.approx(np.array([(0, 1), (1, 0), (0.2, 0)]))
    assert mesh.normals[0].tolist() == [[0, 0, 1], [0, -1, 0], [-1, 0, 0]]
    assert not mesh.uvs[1:].any()
    assert not mesh.normals[1:].any()


def test_cameras(builder, load_glb):
    builder.document["cameras"] = [
        dict(type="perspective", name="wide", perspective=dict(yfov=np.pi / 2, aspectRatio=2.0, znear=0.1)),
        dict(type="perspective", perspective=dict(yfov=2 * np.arctan(0.75), znear=0.1)),
        dict(type="orthographic", orthographic=dict())]
    builder.node(mesh=builder.mesh(builder.triangle()))
    half = np.sqrt(0.5)
    builder.node(camera=0, translation=[1, 2, 3], rotation=[0, half, 0, half], scale=[5, 5, 5])
    builder.node(camera=1, name="second")
    builder.node(camera=2)
    scene = load_glb(builder)
    wide, second = scene.cameras
    assert wide.name == "wide"
    assert second.name == "second"
    # Turned by 90° about y: -z becomes -x.
    right, up, forward = wide.basis()
    assert wide.eye.tolist() == [1, 2, 3]
    assert forward == pytest.approx([-1, 0, 0])
    assert up == pytest.approx([0, 1, 0])
    assert right == pytest.approx([0, 0, -1])
    assert wide.hfov_deg == pytest.approx(np.degrees(2 * np.arctan(2)))
    assert second.hfov_deg == pytest.approx(90)
    assert scene.default_camera() is wide
    assert scene.warnings == ["cameras[2]: only perspective cameras are supported; left out"]


def test_linear_step_and_spline_translation(builder, load_glb):
    mesh = builder.mesh(builder.triangle())
    for _ in range(3):
        builder.node(mesh=mesh)
    builder.animate(0, "translation", [1, 2, 4], [(0, 0, 0), (1, 2, 3), (5, 2, 3)])
    builder.animate(1, "translation", [1, 2, 4], [(0, 0, 0), (1, 2, 3), (5, 2, 3)], interpolation="STEP")
    zero = (0, 0, 0)
    # In-tangent, value, out-tangent for each time.
    builder.animate(2, "translation", [0, 2], [zero, zero, (1, 0, 0), (3, 0, 0), (4, 0, 0), zero],
            interpolation="CUBICSPLINE")
    scene = load_glb(builder)
    assert scene.is_animated
    assert scene.duration == 4

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


def test_rotation_goes_the_short_way_at_constant_speed_and_carries_children(builder, load_glb):
    builder.node(children=[1])
    builder.node(mesh=builder.mesh(builder.triangle()), translation=[1, 0, 0])
    angle = np.radians(80)
    # The second quaternion is negated: the same rotation, the other way round.
    builder.animate(0, "rotation", [0, 1], [(0, 0, 0, 1), (0, 0, -np.sin(angle / 2), -np.cos(angle / 2))])
    builder.animate(0, "scale", [0, 1], [(1, 1, 1), (3, 3, 3)])
    scene = load_glb(builder)
    for t in (0.0, 0.25, 0.5, 1.0):
        c, s, k = np.cos(t * angle), np.sin(t * angle), 1 + 2 * t
        expected = np.array([[c, -s, 0, c], [s, c, 0, s], [0, 0, 1, 0]]) * k
        assert scene.at_time(t).instances[0].transform == pytest.approx(expected, abs=1e-6)


def test_cameras_move_too(builder, load_glb):
    builder.document["cameras"] = [dict(type="perspective", perspective=dict(yfov=1.0, aspectRatio=1.0))]
    builder.node(mesh=builder.mesh(builder.triangle()))
    builder.node(camera=0)
    builder.animate(1, "translation", [0, 1], [(0, 0, 0), (2, 4, 6)])
    assert load_glb(builder).at_time(0.5).cameras[0].eye.tolist() == [1, 2, 3]


def test_transform_that_becomes_singular_names_the_node(builder, load_glb):
    builder.node(mesh=builder.mesh(builder.triangle()), name="flat")
    builder.animate(0, "scale", [0, 1], [(1, 1, 1), (1, 1, -1)])
    scene = load_glb(builder)
    with pytest.raises(SceneError, match=r"node 'flat'.*singular"):
        scene.at_time(0.5)


def test_unsupported_animation_is_warned_of(builder, load_glb):
    builder.node(mesh=builder.mesh(builder.triangle()))
    builder.animate(0, "weights", [0], [0.5])
    scene = load_glb(builder)
    assert scene.warnings == ["animations[0].channels[0]: animation of 'weights' is not supported; left out"]
    assert not scene.is_animated


def test_terrain(scene_file):
    scene = load_scene(scene_file("terrain.glb"))
    assert (scene.num_triangles, scene.num_stored_triangles, len(scene.instances)) == (10_472_954, 198_494, 257)
    assert scene.instances[1].transform[0] == pytest.approx([-3.391032, 0.246783, 0, 51.515152], abs=1e-6)
