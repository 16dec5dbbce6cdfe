import json

import numpy as np
import pytest
from embreex import rtcore_scene
from embreex.mesh_construction import TriangleMesh

from sim.golden import render, trace
from sim.scene import Camera, Instance, Material, Mesh, Scene, load_scene

GREY = [Material("grey", (0.5, 0.5, 0.5))]
SCENES = {"scene6": "scene6_simple_room/simple_room.obj", "office": "office_laas_grande_salle/grande_salle.obj",
          "conference": "conference/conference.obj", "bunny": "classic/stanford-bunny.obj"}


def make_mesh(corners, name="soup"):
    corners = np.asarray(corners, np.float64)
    return Mesh(name, corners.reshape(-1, 3), np.arange(3 * len(corners), dtype=np.int32).reshape(-1, 3),
                np.zeros(len(corners), np.int32))


def one_mesh_scene(corners):
    return Scene([make_mesh(corners)], [Instance(0, np.eye(3, 4), "soup")], GREY)


def random_map(rng):
    return np.concatenate([rng.normal(size=(3, 3)), rng.uniform(-3, 3, (3, 1))], axis=1)


def instanced_scene(seed, *, num_meshes=3, num_instances=7):
    """Soups of triangles, each placed by affine maps that turn, shear, mirror and scale."""
    rng = np.random.default_rng(seed)
    meshes = [make_mesh(rng.uniform(-1, 1, (200, 1, 3)) + rng.uniform(-0.2, 0.2, (200, 3, 3)))
              for _ in range(num_meshes)]
    instances = [Instance(int(rng.integers(num_meshes)), random_map(rng), f"i{i}") for i in range(num_instances)]
    return Scene(meshes, instances, GREY)


def embree(scene, origins, directions):
    """(instance_id, prim_id, t) by Embree, every instance a geometry of its own."""
    device_scene = rtcore_scene.EmbreeScene()
    for instance in scene.instances:
        mesh = scene.meshes[instance.mesh]
        vertices = mesh.vertices @ instance.transform[:, :3].T + instance.transform[:, 3]
        TriangleMesh(device_scene, vertices.astype(np.float32), mesh.triangles)
    n = len(directions)
    origins = np.broadcast_to(origins, (n, 3)).astype(np.float32)
    result = device_scene.run(origins, directions.astype(np.float32), output=1)
    hit = result["primID"] >= 0
    return np.where(hit, result["geomID"], -1), result["primID"], np.where(hit, result["tfar"], np.inf)


def assert_agree(scene, origins, directions):
    """Golden and Embree (float32) see the same, but where golden's two nearest surfaces are one for a
    float32.

    A ray in ten thousand may differ otherwise: those that pass an outline by less than float32 resolves.
    """
    hits = trace(scene, origins, directions)
    assert hits.is_hit.mean() > 0.2
    instance_id, prim_id, t = embree(scene, origins, directions)
    differ = (hits.instance_id != instance_id) | (hits.prim_id != prim_id)
    second = trace(scene, origins, directions, exclude=(hits.instance_id, hits.prim_id))
    with np.errstate(invalid="ignore"):
        clear = differ & ~(np.abs(second.t - hits.t) <= 1e-5 * hits.t)
        far = (hits.t != t) & ~(np.abs(hits.t - t) <= 1e-4 * hits.t)
    assert clear.mean() <= 1e-4
    assert far.mean() <= 1e-4


@pytest.mark.parametrize("seed", range(3))
def test_instances_agree_with_embree_on_random_rays(seed):
    scene = instanced_scene(seed)
    rng = np.random.default_rng(seed + 100)
    origins = rng.uniform(-6, 6, (20000, 3))
    targets = rng.uniform(-3, 3, (20000, 3))
    assert_agree(scene, origins, targets - origins)


def test_room_agrees_with_embree():
    scene = load_scene("room")
    origin, directions = scene.default_camera().rays(256, 192)
    assert_agree(scene, origin, directions.reshape(-1, 3))


@pytest.mark.parametrize("name", SCENES)
def test_scene_agrees_with_embree(name, scene_file):
    scene = load_scene(scene_file(SCENES[name]))
    for view in json.loads(scene_file("cameras.json").read_text())[name]:
        origin, directions = Camera(**view).rays(256, 192)
        assert_agree(scene, origin, directions.reshape(-1, 3))


def test_hit_point_is_as_defined():
    scene = instanced_scene(5)
    rng = np.random.default_rng(6)
    origins = rng.uniform(-6, 6, (4000, 3))
    directions = rng.uniform(-3, 3, (4000, 3)) - origins
    hits = trace(scene, origins, directions)
    assert hits.is_hit.sum() > 500
    for i in np.flatnonzero(hits.is_hit):
        instance = scene.instances[hits.instance_id[i]]
        v0, v1, v2 = scene.meshes[instance.mesh].vertices.reshape(-1, 3, 3)[hits.prim_id[i]]
        u, v = hits.u[i], hits.v[i]
        assert u >= 0
        assert v >= 0
        assert u + v <= 1 + 1e-15
        point = instance.transform @ [*((1 - u - v) * v0 + u * v1 + v * v2), 1.0]
        assert point == pytest.approx(origins[i] + hits.t[i] * directions[i], abs=1e-9)
        normal = np.cross(v1 - v0, v2 - v0)
        direction = np.linalg.solve(instance.transform[:, :3], directions[i])
        assert hits.dot[i] == pytest.approx(direction @ normal / np.linalg.norm(normal), rel=1e-9, abs=1e-9)


def test_misses_are_marked():
    scene = one_mesh_scene([[(0, 0, 1), (1, 0, 1), (0, 1, 1)]])
    hits = trace(scene, np.zeros(3), [(0.9, 0.9, 1.0), (0, 0, -1), (0, 0, 0)])
    assert hits.instance_id.tolist() == hits.prim_id.tolist() == [-1, -1, -1]
    assert hits.t.tolist() == [np.inf] * 3
    assert hits.u.tolist() == hits.v.tolist() == hits.dot.tolist() == [0, 0, 0]


def test_both_sides_are_hit_with_the_sign_in_dot():
    scene = one_mesh_scene([[(0, 0, 0), (1, 0, 0), (0, 1, 0)]])
    hits = trace(scene, [(0.25, 0.5, 2), (0.25, 0.5, -2)], [(0, 0, -4), (0, 0, 4)])
    assert hits.t.tolist() == [0.5, 0.5]
    assert hits.u.tolist() == [0.25, 0.25]
    assert hits.v.tolist() == [0.5, 0.5]
    assert hits.dot.tolist() == [-4, 4]


def test_ties_go_to_the_lowest_numbers():
    corners = [(0, 0, 1), (1, 0, 1), (0, 1, 1)]
    mesh = make_mesh([corners] * 6)
    scene = Scene([mesh], [Instance(0, np.eye(3, 4), f"i{i}") for i in range(5)], GREY)
    hits = trace(scene, np.zeros(3), [(0.2, 0.2, 1.0)])
    assert (hits.instance_id[0], hits.prim_id[0]) == (0, 0)


def test_t_min_is_exclusive():
    scene = one_mesh_scene([[(0, 0, z), (1, 0, z), (0, 1, z)] for z in (1, 2, 3)])
    assert [trace(scene, (0.2, 0.2, 0.0), [(0, 0, 1.0)], t_min).t[0] for t_min in (0, 1, 1.5, 3)] == [1, 2, 2, np.inf]


def test_excluded_triangles_are_ignored():
    scene = one_mesh_scene([[(0, 0, z), (1, 0, z), (0, 1, z)] for z in (1, 2, 3)])
    directions = np.tile((0, 0, 1.0), (3, 1))
    hits = trace(scene, (0.2, 0.2, 0.0), directions, exclude=(np.array([0, 0, -1]), np.array([0, 1, -1])))
    assert hits.prim_id.tolist() == [1, 0, 0]


def test_unusable_triangles_are_never_hit_and_keep_their_numbers():
    corners = np.array([[(0, 0, z), (1, 0, z), (0, 1, z)] for z in (1.0, 2, 3, 4)])
    corners[0, 2] = corners[0, 1]
    corners[1, 0, 0] = np.nan
    corners[2, 1, 1] = np.inf
    hits = trace(one_mesh_scene(corners), (0.2, 0.2, 0.0), [(0, 0, 1.0)])
    assert (hits.prim_id[0], hits.t[0]) == (3, 4)


def rough_sphere(seed, *, num_rings=12, num_segments=16):
    """Corners of a closed mesh about the origin, every vertex moved in and out at random."""
    rng = np.random.default_rng(seed)
    theta, phi = np.pi * np.arange(1, num_rings) / num_rings, 2 * np.pi * np.arange(num_segments) / num_segments
    ring = np.stack([np.outer(np.sin(theta), np.cos(phi)), np.outer(np.sin(theta), np.sin(phi)),
                     np.outer(np.cos(theta), np.ones(num_segments))], axis=2)
    vertices = np.concatenate([ring.reshape(-1, 3), [(0, 0, 1), (0, 0, -1)]])
    vertices *= rng.uniform(0.6, 1.4, (len(vertices), 1))
    triangles = []
    for j in range(num_segments):
        k = (j + 1) % num_segments
        triangles += [(len(vertices) - 2, j, k)]
        for row in range(0, (num_rings - 2) * num_segments, num_segments):
            below = row + num_segments
            triangles += [(row + j, below + j, below + k), (row + j, below + k, row + k)]
        triangles += [(len(vertices) - 1, below + k, below + j)]
    return vertices, np.array(triangles)


@pytest.mark.parametrize("aim", ["edge", "vertex"])
def test_closed_mesh_has_no_cracks(aim):
    vertices, triangles = rough_sphere(1)
    rng = np.random.default_rng(2)
    picked = vertices[triangles[rng.integers(len(triangles), size=100_000)]]
    s = rng.uniform(0, 1, (len(picked), 1)) if aim == "edge" else 0.0
    targets = (1 - s) * picked[:, 0] + s * picked[:, 1]
    origins = rng.uniform(-0.2, 0.2, targets.shape)
    hits = trace(one_mesh_scene(vertices[triangles]), origins, targets - origins)
    assert hits.is_hit.all()


def test_rays_along_axes_through_shared_edges_hit():
    """Directions with zeros, in planes where boxes and triangles end."""
    squares = [[(x, y, 1), (x + 1, y, 1), (x + 1, y + 1, 1)] for x in range(4) for y in range(4)]
    squares += [[(x, y, 1), (x + 1, y + 1, 1), (x, y + 1, 1)] for x in range(4) for y in range(4)]
    origins = np.stack(np.broadcast_arrays(*np.mgrid[0:4.25:0.25, 0:4.25:0.25], 0.0), axis=-1)
    hits = trace(one_mesh_scene(squares), origins, (0.0, 0.0, 1.0))
    assert hits.is_hit.all()
    assert (hits.t == 1).all()


def test_animation_moves_only_the_instances():
    scene = instanced_scene(9)
    moved = Scene(scene.meshes, [Instance(i.mesh, i.transform + np.eye(3, 4, 3) * 5, i.name) for i in scene.instances],
                  GREY)
    rng = np.random.default_rng(1)
    origins, directions = rng.uniform(-6, 6, (500, 3)), rng.normal(size=(500, 3))
    here, there = trace(scene, origins, directions), trace(moved, origins + np.array((5.0, 0, 0)), directions)
    assert (here.prim_id == there.prim_id).all()
    assert here.is_hit.any()
    assert there.t == pytest.approx(here.t, rel=1e-9)


def test_picture_has_the_shape_and_orientation_of_the_convention():
    """A triangle high up on the right of the view is seen at the top right."""
    scene = one_mesh_scene([[(0.5, 5, 0.3), (1.0, 5, 0.3), (0.75, 5, 0.8)]])
    hits = render(scene, Camera((0, 0, 0), (0, 1, 0), (0, 0, 1), 60.0), 64, 48)
    assert hits.t.shape == (48, 64)
    rows, columns = np.nonzero(hits.is_hit)
    assert rows.max() < 24
    assert columns.min() >= 32
    assert hits.t[rows[0], columns[0]] == pytest.approx(5.0)
