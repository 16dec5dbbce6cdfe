"""Maps of Quake III: what is in them comes out, and what is wrong with them is said."""

import re
import zipfile

import numpy as np
import pytest

from sim.scene import SceneError, load_scene
from sim.scene.normals import flat_normals
from sim.scene.patches import tessellate

from .quake_builder import ENTITIES, PATCH, SQUARE, UP, bsp, corners, face, picture, pk3, small_map

PICTURES = {"textures/a/floor.jpg": picture((10, 20, 30), "JPEG"), "textures/a/veil.tga": picture((1, 2, 3, 128))}


@pytest.fixture
def load(tmp_path):
    """Function from changes of the small map, and files, to the scene that its archive is."""
    def write_and_load(files=PICTURES, **changes):
        files = {"maps/small.bsp": bsp(**small_map(**changes))} | dict(files)
        (tmp_path / "a.pk3").write_bytes(pk3(files))
        return load_scene(tmp_path / "a.pk3")

    return write_and_load


def test_the_world(load):
    scene = load()
    world = scene.meshes[0]
    assert world.name == "small"
    # In the order of the faces: two of the square, one of the model, 2·4·4 of the patch; no billboard, sky, NODRAW.
    assert world.num_triangles == 2 + 1 + 32
    assert corners(world)[:3].tolist() == [[[8, 0, 0], [8, 8, 0], [0, 0, 0]], [[8, 8, 0], [0, 8, 0], [0, 0, 0]],
                                           [[8, 8, 0], [0, 8, 0], [0, 0, 0]]]
    assert world.uvs[0].tolist() == [[2, 0], [2, 2], [0, 0]]
    assert [scene.materials[i].name for i in world.material_ids] == [
        "textures/a/floor"] * 2 + ["textures/a/veil"] + ["textures/a/floor"] * 32
    assert scene.warnings == []


def test_fronts_are_where_stored_normals_point(load):
    world = load().meshes[0]
    assert (world.normals == UP).all()
    assert (flat_normals(corners(world))[:, 2] > 0).all()


def test_models_of_entities_are_objects_where_these_stand(load):
    scene = load()
    assert [(instance.name, instance.mesh) for instance in scene.instances] == [("world", 0), ("*1 func_door", 1)]
    assert scene.instances[1].transform[:, 3].tolist() == [0, 0, 16]
    assert scene.meshes[1].num_triangles == 2


def test_cameras_are_where_players_enter(load):
    camera, = load().cameras
    assert camera.name == "info_player_start 0"
    assert camera.eye.tolist() == [4, 4, 28]
    assert (camera.at - camera.eye).tolist() == pytest.approx([0, 1, 0])
    assert (camera.up.tolist(), camera.hfov_deg) == ([0, 0, 1], 90)
    assert load(entities="").cameras == []


def test_non_finite_and_degenerate_triangles_are_dropped(load):
    vertices = [*SQUARE, *PATCH]
    vertices[3] = ((np.nan, 0, 0), (np.inf, 0), UP)
    vertices[4:13] = [((0, 0, 0), (0, 0), UP)] * 9
    scene = load(vertices=vertices)
    assert scene.warnings == ["mesh 'small': 2 non-finite triangles dropped",
                              "mesh 'small': 32 degenerate triangles dropped",
                              "mesh 'small *1': 1 non-finite triangle dropped"]
    assert all(np.isfinite(mesh.uvs).all() for mesh in scene.meshes)


def test_patches_are_the_analytic_surface():
    """Against de Casteljau's construction: by halves of halves of the control points, no weights."""
    rng = np.random.default_rng(1)
    control = rng.normal(size=(1, 5, 3, 3))
    points = tessellate(control, 4)[0]
    assert points.shape == (9, 5, 3)

    def casteljau(a, b, c, t):
        ab, bc = a + t * (b - a), b + t * (c - b)
        return ab + t * (bc - ab)

    for row in range(9):
        block, s = min(row // 4, 1), (row - 4 * min(row // 4, 1)) / 4
        for column in range(5):
            across = [casteljau(*control[0, 2 * block + k], column / 4) for k in range(3)]
            assert points[row, column] == pytest.approx(casteljau(*across, s), abs=1e-12)
    # Joints are control points to the bit, so neighbours meet.
    assert (points[::4, ::4] == control[0, ::2, ::2]).all()


@pytest.mark.parametrize(("changes", "message"), [
    (dict(magic=b"PBSI"), "not a map of Quake III (IBSP, version 46)"),
    (dict(version=47), "not a map of Quake III (IBSP, version 46)"),
    (dict(models=[]), "has no models, not even the world"),
    (dict(models=[(0, 8)]), "model 0: its faces are not all among 7"),
    (dict(models=[(0, 7), (-1, 2)]), "model 1: its faces are not all among 7"),
    (dict(models=[(0, 7), (0, 1)]), "models share faces: they have 8 of 7"),
    (dict(faces=[face(5)] * 7), "face 0: its kind is none of 1 to 4"),
    (dict(faces=[face(1, texture=4)] * 7), "face 0: its texture is none of 4"),
    (dict(faces=[face(1, texture=-1)] * 7), "face 0: its texture is none of 4"),
    (dict(faces=[face(4)] * 6 + [face(1, vertices=(10, 4))]), "face 6: its vertices are not all among 13"),
    (dict(faces=[face(1, vertices=(-1, 4))] * 7), "face 0: its vertices are not all among 13"),
    (dict(faces=[face(3, meshverts=(3, 6))] * 7), "face 0: its mesh vertices are not all among 6"),
    (dict(faces=[face(1, meshverts=(0, 4))] * 7), "face 0: its mesh vertices are no whole number of triangles"),
    (dict(faces=[face(1, vertices=(0, 2), meshverts=(0, 3))] * 7), "face 0: mesh vertex 2 is none of its 2 vertices"),
    (dict(faces=[face(2, vertices=(4, 9), size=(9, 1))] * 7),
     "face 0: a patch needs an odd number of control points each way, 3 to 129"),
    (dict(faces=[face(2, vertices=(4, 8), size=(3, 3))] * 7),
     "face 0: a patch needs as many vertices as control points"),
    (dict(faces=[face(2, vertices=(4, 9), size=(3, 3))] * 40000, models=[(0, 40000)]),
     "has 1,280,000 triangles; at most 1,048,576 are read"),
    (dict(entities='{ "model" "*2" "classname" "x" }'),
     "entity 'x': there is no model '*2'; the map has *1 to *1"),
    (dict(entities='{ "model" "*x" }'), "entity '': there is no model '*x'; the map has *1 to *1"),
    (dict(models=[(0, 7)]), "entity 'func_door': there is no model '*1'; it has none"),
    (dict(entities=ENTITIES + "{"), "entity 4: has no '}'"),
    (dict(entities="} {"), "entity 0: '} {' is not understood"),
    (dict(entities='{ "a" "b" } c'), "entity 1: 'c' is not understood"),
    (dict(entities='{ "a" }'), "entity 0: key 'a' has no value"),
    (dict(entities='{ "classname" "info_player_start" "origin" "1 2" }'),
     "entity 'info_player_start': 'origin' must be 3 finite numbers, not '1 2'"),
    (dict(entities='{ "classname" "info_player_start" "angle" "nan" }'),
     "entity 'info_player_start': 'angle' must be 1 finite number, not 'nan'"),
    (dict(entities='{ "a" "' + "b" * (1 << 20) + '" }'), "entities: 1,048,587 bytes; at most 1,048,576 are read"),
])
def test_errors(load, tmp_path, changes, message):
    with pytest.raises(SceneError, match=f"^{re.escape(f'{tmp_path}/a.pk3: maps/small.bsp: {message}')}$"):
        load(**changes)


@pytest.mark.parametrize(("cut", "message"), [
    (8, "directory: 17 of 8 bytes at byte 8, in a file of 8; it is cut short or damaged"),
    (200, r"entities: 199 of 1 bytes at byte 144, in a file of 200; it is cut short or damaged"),
    (-1, r"faces: 7 of 104 bytes at byte \d+, in a file of \d+; it is cut short or damaged")])
def test_cut_short(tmp_path, cut, message):
    (tmp_path / "a.pk3").write_bytes(pk3({"maps/a.bsp": bsp(**small_map())[:cut]}))
    with pytest.raises(SceneError, match=rf"a\.pk3: maps/a\.bsp: {message}$"):
        load_scene(tmp_path / "a.pk3")


def test_a_part_of_odd_length(tmp_path):
    data = bytearray(bsp(**small_map()))
    data[8 + 8 * 13 + 4] += 1
    (tmp_path / "a.pk3").write_bytes(pk3({"maps/a.bsp": bytes(data)}))
    with pytest.raises(SceneError, match=r"a\.pk3: maps/a\.bsp: faces: 729 bytes are no whole number of 104$"):
        load_scene(tmp_path / "a.pk3")


def test_archives_of_several_maps(tmp_path):
    path, one = tmp_path / "a.pk3", bsp(**small_map())
    path.write_bytes(pk3({"maps/Two.bsp": one, "maps/one.bsp": one, "maps/in/three.bsp": one, **PICTURES}))
    for name, message in (("", f"has the maps one, two; name one, as in {path}:one"),
                          (":three", "has no map 'three'; there are one, two")):
        with pytest.raises(SceneError, match=f"^{re.escape(f'{path}: {message}')}$"):
            load_scene(f"{path}{name}")
    assert load_scene(f"{path}:TWO").meshes[0].name == "two"
    path.write_bytes(pk3({"x": b""}))
    with pytest.raises(SceneError, match=rf"^{re.escape(str(path))}: has no map \(maps/\*\.bsp\)$"):
        load_scene(path)


@pytest.mark.parametrize(("data", "message"), [
    (b"no archive", "not a .pk3 (zip) file: File is not a zip file"),
    (pk3({"maps/a.bsp": bytes(1 << 26) + b"0"}), "maps/a.bsp: would unpack to 67,108,865 bytes; at most 67,108,864 are "
     "read"),
    (pk3({"maps/a.bsp": bytes(99)}, method=zipfile.ZIP_LZMA), "maps/a.bsp: is encrypted, or not packed by 'deflate'; "
     "pack it anew"),
    (pk3({"maps/a.bsp": b"whole"}, method=zipfile.ZIP_STORED).replace(b"whole", b"wrong", 1),
     "maps/a.bsp: cannot be unpacked: Bad CRC-32 for file 'maps/a.bsp'"),
], ids=("none", "bomb", "method", "sum"))
def test_bad_archives(tmp_path, data, message):
    (tmp_path / "a.pk3").write_bytes(data)
    with pytest.raises(SceneError, match=f"^{re.escape(f'{tmp_path}/a.pk3: {message}')}$"):
        load_scene(tmp_path / "a.pk3")


def test_a_missing_archive(tmp_path):
    with pytest.raises(SceneError, match=rf"^{tmp_path}/none\.pk3: No such file or directory$"):
        load_scene(tmp_path / "none.pk3")


@pytest.mark.parametrize(("name", "num_usable", "num_objects"), [
    ("quake3-oa_dm5", 40159, 11), ("castle-oa_shouse", 21329, 6), ("ut-oacmpdm1", 43904, 1)])
def test_real_maps(scene_file, name, num_usable, num_objects):
    scene = load_scene(scene_file(f"openarena/{name}.pk3"))
    assert sum(int(scene.meshes[instance.mesh].usable.sum()) for instance in scene.instances) == num_usable
    assert len(scene.instances) == num_objects
