import time

import numpy as np
import pytest

from sim.scene import SceneError, load_scene

TRIANGLE = "v 0 0 0\nv 1 0 0\nv 0 1 0\n"


@pytest.fixture
def load(tmp_path):
    """Function from an OBJ file's text (and other files' texts, by name) to its scene."""

    def write_and_load(text, **others):
        for name, content in others.items():
            (tmp_path / name.replace("_", ".")).write_text(content)
        (tmp_path / "test.obj").write_bytes(text.encode())
        return load_scene(tmp_path / "test.obj")

    return write_and_load


def corners(mesh):
    return mesh.vertices[mesh.triangles].tolist()


def test_faces_before_any_object_are_a_mesh_named_after_the_file(load):
    scene = load(TRIANGLE + "f 1 2 3\n")
    assert [mesh.name for mesh in scene.meshes] == ["test"]
    assert corners(scene.meshes[0]) == [[[0, 0, 0], [1, 0, 0], [0, 1, 0]]]
    assert scene.warnings == []


def test_objects_are_instances_in_file_order_and_empty_ones_are_none(load):
    scene = load("o b\n" + TRIANGLE + "f 1 2 3\no lines\nl 1 2\no a\nv 0 0 5\nf 2 3 4\nf 1 2 4\no b\nf 1 3 4\n")
    assert [instance.name for instance in scene.instances] == ["b", "a", "b"]
    assert [instance.mesh for instance in scene.instances] == [0, 1, 2]
    assert [mesh.num_triangles for mesh in scene.meshes] == [1, 2, 1]
    assert corners(scene.meshes[1]) == [[[1, 0, 0], [0, 1, 0], [0, 0, 5]], [[0, 0, 0], [1, 0, 0], [0, 0, 5]]]
    assert all((instance.transform == np.eye(3, 4)).all() for instance in scene.instances)
    assert scene.num_triangles == scene.num_stored_triangles == 4


def test_polygons_become_fans_in_file_order(load):
    points = "".join(f"v {i} {i * i} 0\n" for i in range(6))
    scene = load(points + "f 1 2 3\nf 1 2 3 4 5\nf 6 5 4 3\n")
    assert scene.meshes[0].vertices[scene.meshes[0].triangles][:, :, 0].tolist() == [
        [0, 1, 2], [0, 1, 2], [0, 2, 3], [0, 3, 4], [5, 4, 3], [5, 3, 2]]


def test_negative_numbers_count_back_from_the_line(load):
    scene = load(TRIANGLE + "f -3 -2 -1\nv 9 9 9\nv 8 8 8\nf -5 -1 -2\n")
    assert corners(scene.meshes[0]) == [[[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 0, 0], [8, 8, 8], [9, 9, 9]]]


def test_all_forms_of_corners_in_one_file(load):
    text = (TRIANGLE + "vt 0.1 0.2\nvt 0.3 0.4 0.5\nvt 0.6 0.7\nvn 0 0 1\nvn 1 0 0\n"
            "f 1 2 3\nf 1/1 2/2 3/3\nf 1//1 2//2 3//1\nf 1/3/1 2/-2/2 -1/1/-1\n")
    (mesh,) = load(text).meshes
    assert mesh.uvs.tolist() == [[[0, 0]] * 3, [[0.1, 0.2], [0.3, 0.4], [0.6, 0.7]], [[0, 0]] * 3,
                                 [[0.6, 0.7], [0.3, 0.4], [0.1, 0.2]]]
    z, x, none = [0, 0, 1], [1, 0, 0], [0, 0, 0]
    assert mesh.normals.tolist() == [[none] * 3, [none] * 3, [z, x, z], [z, x, x]]


def test_mesh_without_attributes_has_none(load):
    (mesh,) = load(TRIANGLE + "f 1 2 3").meshes
    assert mesh.uvs is None
    assert mesh.normals is None


def test_comments_tabs_continuations_and_line_ends(load):
    scene = load("# o x\r\n\tv  0\t0 0 # origin\r\nv 1 \\\r\n0 0\r\nv 0 1 0 1.0\r\n\r\ng any\ns off\nf 1 2 \\\n3\n")
    assert corners(scene.meshes[0]) == [[[0, 0, 0], [1, 0, 0], [0, 1, 0]]]


def test_materials(load):
    scene = load("mtllib a.mtl\n" + TRIANGLE + "f 1 2 3\nusemtl red\nf 1 2 3\nusemtl metal\nf 1 2 3\nusemtl lamp\n"
                 "f 1 2 3\nusemtl black\nf 1 2 3\nusemtl plain\nf 1 2 3\n", a_mtl=(
                     "newmtl red\nKd 1 0 0 # pure\nKs 1 1 1\nnewmtl metal\nKd 0 0 0\nKs 0.5 0.25 0\nnewmtl lamp\n"
                     "Kd 0 0 0\nKe 40 0.5 0\nnewmtl black\nKd 0 0 0\nnewmtl plain\nillum 2\n"))
    (mesh,) = scene.meshes
    looks = [scene.materials[i] for i in mesh.material_ids]
    assert [material.name for material in looks] == ["default", "red", "metal", "lamp", "black", "plain"]
    assert [material.base_color for material in looks] == [
        (0.8, 0.8, 0.8), (1, 0, 0), (0.5, 0.25, 0), (1, 0.5, 0), (0, 0, 0), (0.8, 0.8, 0.8)]


def test_missing_material_file_and_material_are_warned_of(load):
    scene = load("mtllib no.mtl\nusemtl x\n" + TRIANGLE + "f 1 2 3\n")
    assert len(scene.warnings) == 2
    assert "no.mtl: material file is missing" in scene.warnings[0]
    assert "material 'x' is not defined" in scene.warnings[1]
    assert scene.materials[scene.meshes[0].material_ids[0]].base_color == (0.8, 0.8, 0.8)


def test_unusable_triangles_are_kept_counted_and_reported(load):
    scene = load("o mine\nv nan 0 0\nv 0 0 0\nv 1 0 0\nv 2 0 0\nv 0 1 0\nf 1 2 3\nf 2 3 4\nf 3 3 5\nf 2 3 5\n")
    assert scene.meshes[0].num_triangles == 4
    assert scene.meshes[0].usable.tolist() == [False, False, False, True]
    assert scene.warnings == [scene.warnings[0], "mesh 'mine': 1 non-finite triangle dropped",
                              "mesh 'mine': 2 degenerate triangles dropped"]
    assert "test.obj:2: vertex is not finite (1 such in the file)" in scene.warnings[0]


@pytest.mark.parametrize(("text", "message"), [
    ("v 0 0\n", r"test.obj:1: 'v' needs 3 numbers, has 2"),
    ("v 0 0 0\nv 0 x1 0\n", r"test.obj:2: 'x1' is not a number"),
    (TRIANGLE + "vt 1\nf 1 2 3\n", r"test.obj:4: 'vt' needs 2 numbers, has 1"),
    (TRIANGLE + "f 1 2\n", r"test.obj:4: face with 2 corners; at least 3"),
    (TRIANGLE + "f 1 2 3\nf 1 2 4\n", r"test.obj:5: 'v' index 4 is out of range; the file has 3"),
    (TRIANGLE + "f 0 1 2\n", r"test.obj:4: 'v' index 0 is out of range"),
    (TRIANGLE + "f -4 1 2\n", r"test.obj:4: 'v' index -4 is out of range"),
    (TRIANGLE + "vt 0 0\nf 1/1 2/1 3/2\n", r"test.obj:5: 'vt' index 2 is out of range; the file has 1"),
    (TRIANGLE + "f 1//1 2//1 3//1\n", r"test.obj:4: 'vn' index 1 is out of range; the file has 0"),
    (TRIANGLE + "f 1 2 3\nf 1 b 3\n", r"test.obj:5: 'b' is not a face corner; use v, v/vt"),
    (TRIANGLE + "f 1/2/3/4 2 3\n", r"test.obj:4: '1/2/3/4' is not a face corner"),
    (TRIANGLE + "f 1 2 99999999999999999999\n", r"test.obj:4: '99999999999999999999' is not a face corner"),
    (TRIANGLE + "f 1/1 2/1 1.5/1\n", r"test.obj:4: '1.5/1' is not a face corner"),
    (TRIANGLE, r"test.obj: scene is empty: no faces"),
    ("", r"test.obj: scene is empty: no faces"),
    ("v 0 0 0\nf 1 1 1\n", r"test.obj: scene is empty: no instance has a usable triangle"),
    ("mtllib ../../x.mtl\n" + TRIANGLE + "f 1 2 3\n", r"test.obj: '../../x.mtl' leads out of the scene's folder"),
    ("mtllib /etc/passwd\n" + TRIANGLE + "f 1 2 3\n", r"test.obj: '/etc/passwd' leads out of the scene's folder"),
])
def test_errors_name_the_line(load, text, message):
    with pytest.raises(SceneError, match=message):
        load(text)


@pytest.mark.parametrize(("text", "message"), [
    ("Kd 1 1 1\n", r"a.mtl:1: 'Kd' before any newmtl"), ("newmtl a\nKd 1 x 1\n", r"a.mtl:2: .*'x'"),
    ("newmtl a\nKd 1 1\n", r"a.mtl:2: 'Kd' needs three finite"),
    ("newmtl a\nKd 1 1 nan\n", r"a.mtl:2: 'Kd' needs three"),
])
def test_errors_in_materials_name_the_line(load, text, message):
    with pytest.raises(SceneError, match=message):
        load("mtllib a.mtl\n" + TRIANGLE + "f 1 2 3\n", a_mtl=text)


@pytest.mark.parametrize(("name", "num_triangles", "num_objects"), [
    ("scene6_simple_room/simple_room.obj", 806, 10), ("office_laas_grande_salle/grande_salle.obj", 43296, 39),
    ("classic/stanford-bunny.obj", 69451, 1), ("trees/bush/bush.obj", 40292, 3),
    ("conference/conference.obj", 284884, 54)])
def test_real_files(scene_file, name, num_triangles, num_objects):
    path = scene_file(name)
    start = time.perf_counter()
    scene = load_scene(path)
    assert time.perf_counter() - start < 10
    assert (scene.num_triangles, len(scene.instances)) == (num_triangles, num_objects)


def test_real_file_agrees_with_a_plain_reader(scene_file):
    path = scene_file("office_laas_grande_salle/grande_salle.obj")
    vertices, faces = [], []
    for line in path.read_text().splitlines():
        words = line.split()
        if words[:1] == ["v"]:
            vertices.append([float(word) for word in words[1:]])
        elif words[:1] == ["f"]:
            faces.append([int(word.split("/")[0]) - 1 for word in words[1:]])
    expected = np.array(vertices)[np.array(faces)]
    actual = np.concatenate([mesh.vertices[mesh.triangles] for mesh in load_scene(path).meshes])
    assert (actual == expected).all()


def test_many_continued_lines_take_no_longer_than_others(load):
    begin = time.perf_counter()
    scene = load(TRIANGLE + "f 1 2 " + "\\\n" * 200_000 + " 3\nf 3 2 \\\n\t1\n")
    assert time.perf_counter() - begin < 5
    assert corners(scene.meshes[0]) == [[[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 0], [1, 0, 0], [0, 0, 0]]]


def test_an_illumination_model_of_many_digits_is_none(load):
    scene = load("mtllib a.mtl\nusemtl m\n" + TRIANGLE + "f 1 2 3\n", a_mtl=f"newmtl m\nKs 1 1 1\nillum {'9' * 5000}\n")
    assert scene.materials[1].specular == 1
