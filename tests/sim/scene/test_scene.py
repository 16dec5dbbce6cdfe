import itertools

import numpy as np
import pytest

from sim.golden import trace
from sim.scene import Camera, Instance, Material, Mesh, Scene, SceneError, load_scene
from sim.scene.check import usable_triangles
from sim.scene.room import room_scene


def mesh_of(corners, name="m"):
    corners = np.asarray(corners, np.float64)
    return Mesh(name, corners.reshape(-1, 3), np.arange(3 * len(corners), dtype=np.int32).reshape(-1, 3),
                np.zeros(len(corners), np.int32))


TRIANGLE = mesh_of([[(0, 0, 0), (1, 0, 0), (0, 2, 0)]])


def scene_of(transform, mesh=TRIANGLE):
    return Scene([mesh], [Instance(0, np.asarray(transform, np.float64), "node")], [Material("grey", (0.5,) * 3)])


def test_rays_are_those_of_the_convention():
    """Eye at the origin, looking along +y, z up: 90° across, 4 × 2 pixels."""
    origin, directions = Camera((1, 2, 3), (1, 7, 3), (0, 0, 9), 90.0).rays(4, 2)
    assert origin.tolist() == [1, 2, 3]
    assert directions.shape == (2, 4, 3)
    for row, column in itertools.product(range(2), range(4)):
        expected = ((-0.75, -0.25, 0.25, 0.75)[column], 1.0, (0.25, -0.25)[row])
        assert directions[row, column] == pytest.approx(expected, abs=1e-15)


def test_basis_is_right_handed_and_unit():
    right, up, forward = Camera((1, 2, 3), (-4, 0.5, 9), (0.3, 0.2, 1), 60.0).basis()
    matrix = np.array((right, up, -forward))
    assert matrix @ matrix.T == pytest.approx(np.eye(3), abs=1e-15)
    assert np.linalg.det(matrix) == pytest.approx(1)
    assert np.array((-5, -1.5, 6)) @ forward == pytest.approx(np.linalg.norm((-5, -1.5, 6)))


def test_camera_is_parsed():
    camera = Camera.parse("1,2,3, 4,5,6.5, 0,0,1, 60")
    assert camera.eye.tolist() == [1, 2, 3]
    assert camera.at.tolist() == [4, 5, 6.5]
    assert camera.up.tolist() == [0, 0, 1]
    assert camera.hfov_deg == 60


@pytest.mark.parametrize(("text", "message"), [
    ("0,0,0,0,0,0,0,0,1,60", "zero direction"), ("0,0,0,0,0,5,0,0,1,60", "parallel"),
    ("0,0,0,0,0,5,0,0,-1e-9,60", "parallel"), ("0,0,0,1,0,0,0,0,0,60", "up vector is zero"),
    ("0,0,0,1,0,0,0,0,1,0", r"within \(0, 180\)"), ("0,0,0,1,0,0,0,0,1,180", r"within \(0, 180\)"),
    ("0,0,0,1,0,0,0,0,1,nan", r"within \(0, 180\)"), ("nan,0,0,1,0,0,0,0,1,60", "eye must be three finite"),
    ("0,0,0,inf,0,0,0,0,1,60", "at must be three finite"), ("1,2,3", "3 numbers instead of ten"),
    ("a,0,0,1,0,0,0,0,1,60", "'a'"), ("", "could not convert")])
def test_bad_cameras(text, message):
    with pytest.raises(SceneError, match=message):
        Camera.parse(text)


def test_bounds_are_those_of_the_placed_usable_triangles():
    mesh = mesh_of([[(0, 0, 0), (1, 0, 0), (0, 2, 0)], [(5, 5, 5), (5, 5, 5), (6, 6, 6)], [(np.nan, 9, 9)] * 3])
    lower, upper = scene_of([[0, -1, 0, 10], [1, 0, 0, 0], [0, 0, 2, 3]], mesh).bounds()
    assert lower.tolist() == [8, 0, 3]
    assert upper.tolist() == [10, 1, 3]


@pytest.mark.parametrize(("extent", "up"), [((4, 5, 2.5), (0, 0, 1)), ((1, 1, 0.9), (0, 1, 0)), ((1, 3, 1), (0, 1, 0))])
def test_default_camera_sees_the_whole_scene(extent, up):
    x, y, z = extent
    scene = scene_of(np.eye(3, 4), mesh_of([[(0, 0, 0), (x, 0, z), (0, y, 0)], [(x, y, z), (0, 0, z), (x, y, 0)]]))
    camera = scene.default_camera()
    assert camera.up.tolist() == list(up)
    right, up, forward = camera.basis()
    for corner in itertools.product((0, x), (0, y), (0, z)):
        offset = corner - camera.eye
        half_width = np.tan(np.radians(camera.hfov_deg) / 2) * (offset @ forward)
        assert abs(offset @ right) < half_width
        assert abs(offset @ up) < 0.75 * half_width


@pytest.mark.parametrize("transform", [
    np.zeros((3, 4)), np.diag((1.0, 1, 0, 0))[:3], [[1, 2, 3, 0], [2, 4, 6, 0], [0, 0, 1, 0]]])
def test_singular_instance(transform):
    with pytest.raises(SceneError, match=r"node 'node' \(instance 0\): transform is singular"):
        scene_of(transform)


def test_tiny_and_mirrored_instances_are_fine():
    assert scene_of(np.eye(3, 4) * 1e-9).num_triangles == 1
    assert scene_of(np.diag((-1.0, 1, 1, 0))[:3]).num_triangles == 1


def test_infinite_instance():
    transform = np.eye(3, 4)
    transform[1, 3] = np.inf
    with pytest.raises(SceneError, match="not finite"):
        scene_of(transform)


@pytest.mark.parametrize("corners", [np.zeros((0, 3, 3)), np.zeros((1, 3, 3)), np.full((1, 3, 3), np.nan)])
def test_nothing_to_hit(corners):
    with pytest.raises(SceneError, match="scene is empty"):
        scene_of(np.eye(3, 4), mesh_of(corners))


def test_still_scene_is_the_same_at_any_time():
    scene = scene_of(np.eye(3, 4))
    assert not scene.is_animated
    assert scene.duration == 0
    assert scene.at_time(3.0) is scene


@pytest.mark.parametrize(("corners", "usable"), [
    ([(0, 0, 0), (1, 0, 0), (0, 1, 0)], True), ([(0, 0, 0), (1, 0, 0), (2, 0, 0)], False),
    ([(0.1, 0.2, 0.3), (0.2, 0.4, 0.6), (0.4, 0.8, 1.2)], False), ([(1, 2, 3)] * 3, False),
    ([(1, 2, 3), (1, 2, 3), (4, 5, 6)], False), ([(0, 0, 0), (1e-200, 0, 0), (0, 1e-200, 0)], True),
    ([(0, 0, 0), (1e300, 0, 0), (0, 1e300, 0)], True), ([(1.7e308, 0, 0), (-1.7e308, 0, 0), (0, 1e308, 0)], True),
    ([(0, 0, 0), (1, 0, 0), (1, 1e-12, 0)], True), ([(np.nan, 0, 0), (1, 0, 0), (0, 1, 0)], False),
    ([(0, 0, 0), (np.inf, 0, 0), (0, 1, 0)], False)])
def test_usable_triangles(corners, usable):
    assert usable_triangles(mesh_of([corners])).tolist() == [usable]


def test_room_is_as_large_as_the_papers_scene():
    scene = room_scene()
    (mesh,) = scene.meshes
    assert scene.num_triangles == 806
    assert len(scene.instances) == 1
    assert mesh.usable.all()
    assert set(mesh.material_ids) == set(range(len(scene.materials)))
    assert len(scene.materials) >= 8
    lower, upper = scene.bounds()
    eye = scene.default_camera().eye
    assert (lower < eye).all()
    assert (eye < upper).all()
    assert load_scene("room").num_triangles == 806


def test_furniture_of_the_room_is_closed():
    """But for the picture, which hangs on its frame, every edge joins two triangles that wind the same way round."""
    (mesh,) = room_scene().meshes
    names = np.array([material.name for material in room_scene().materials])[mesh.material_ids]
    for name in ("oak", "blue lacquer", "brass", "glaze", "rug", "orange"):
        triangles = mesh.triangles[names == name]
        edges = np.concatenate([triangles[:, [i, (i + 1) % 3]] for i in range(3)])
        keys, counts = np.unique(edges, axis=0, return_counts=True)
        assert (counts == 1).all()
        assert {tuple(key) for key in keys.tolist()} == {tuple(key) for key in keys[:, ::-1].tolist()}


def test_shell_of_the_room_is_closed():
    """Every ray from the middle hits something: nothing is seen through walls, window or corners."""
    rng = np.random.default_rng(1)
    assert trace(room_scene(), (2.0, 1.0, 1.6), rng.normal(size=(100_000, 3))).is_hit.all()


def test_no_two_surfaces_of_the_room_coincide():
    """Where the two nearest surfaces are at one distance, they are triangles that meet in an edge."""
    scene = room_scene()
    origin, directions = scene.default_camera().rays(512, 384)
    first = trace(scene, origin, directions)
    second = trace(scene, origin, directions, exclude=(first.instance_id, first.prim_id))
    same = np.abs(second.t - first.t) <= 1e-9 * first.t
    corners = scene.meshes[0].triangles[np.stack([first.prim_id[same], second.prim_id[same]])]
    shared = (corners[0][:, :, None] == corners[1][:, None, :]).sum(axis=(1, 2))
    assert (shared >= 2).all()


@pytest.mark.parametrize("name", ["scene.fbx", "scene", "room2"])
def test_unknown_format(name):
    with pytest.raises(SceneError, match=rf"{name}: unknown scene format; supported are \.obj, \.ply, \.ply\.gz"):
        load_scene(name)


@pytest.mark.parametrize("suffix", [".obj", ".ply", ".ply.gz", ".gltf", ".glb"])
def test_missing_file_and_folder(tmp_path, suffix):
    with pytest.raises(SceneError, match="No such file"):
        load_scene(tmp_path / f"none{suffix}")
    (tmp_path / f"folder{suffix}").mkdir()
    with pytest.raises(SceneError, match="Is a directory"):
        load_scene(tmp_path / f"folder{suffix}")
