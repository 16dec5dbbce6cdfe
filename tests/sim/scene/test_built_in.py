"""The scenes made in code."""

import numpy as np
import pytest

from sim.golden import shade_full, trace
from sim.scene import load_scene
from sim.scene.arena import CELL, MAP
from sim.scene.loader import BUILT_IN
from sim.scene.mirror_room import SUN, furnished_room
from sim.scene.sunflowers import sunflower
from sim.scene.vpl import NUM_LIGHTS, _meets


@pytest.mark.parametrize("name", BUILT_IN)
def test_every_triangle_is_usable_and_the_first_view_is_full(name):
    scene = load_scene(name)
    assert scene.warnings == []
    assert all(mesh.usable.all() for mesh in scene.meshes)
    assert {number for mesh in scene.meshes for number in mesh.material_ids} <= set(range(len(scene.materials)))
    hits = trace(scene, *scene.default_camera().rays(64, 48))
    assert hits.is_hit.mean() > 0.35


def test_the_field_is_the_papers():
    scene = load_scene("sunflowers")
    assert (scene.num_triangles, len(scene.instances), scene.num_stored_triangles) == (187_145_136, 5_622, 33_288)
    places = np.array([instance.transform[:, 3] for instance in scene.instances])
    apart = np.linalg.norm(places[:, None, :2] - places[None, :, :2], axis=2)
    np.fill_diagonal(apart, np.inf)
    assert apart.min() > 0.25
    # Heads face +x in the mesh; in the field the sun, from which the light travels to +x.
    facing = np.array([instance.transform[:, 0] for instance in scene.instances]).mean(axis=0)
    (sun,) = scene.lights
    assert facing[:2] / np.linalg.norm(facing[:2]) @ sun.direction[:2] / np.linalg.norm(sun.direction[:2]) < -0.7


def test_a_sunflower_is_made_of_what_it_says():
    mesh = sunflower()
    assert np.bincount(mesh.material_ids).tolist() == [576 + 34 * 24 + 360, 12 * 192, 55 * 72, 360 + 24 * 828, 24 * 210]
    lower, upper = mesh.bounds()
    assert lower[2] == pytest.approx(0, abs=0.01)
    assert 1.6 < upper[2] < 2.0


def test_mirror_room_has_mirror_and_glass_in_view():
    scene = load_scene("mirror-room")
    assert len(scene.lights) == 2
    _, levels = shade_full(scene, *scene.default_camera().rays(64, 48), depth=4)
    assert levels[0]["reflection"] > 100
    assert levels[0]["refraction"] > 5
    assert levels[1]["refraction"] > 5
    assert all(level["rays"] > 0 for level in levels)


def test_the_sun_shines_through_the_window():
    scene = load_scene("mirror-room")
    # From the middle of the pane that is left of the cross, inwards.
    hits = trace(scene, (2.0, 6.5, 1.9), SUN)
    assert hits.t * np.linalg.norm(SUN) > 2


def test_virtual_lights():
    scene = load_scene("vpl")
    assert NUM_LIGHTS == 200
    assert len(scene.lights) == 201
    lamps = scene.lights[1:]
    lower, upper = scene.bounds()
    for lamp in lamps:
        assert (lamp.position > lower).all()
        assert (lamp.position < upper).all()
        # It hangs just before a surface (or in the window), and shines away from it.
        behind = trace(scene, lamp.position, -lamp.direction)
        assert behind.t == pytest.approx(0.02, rel=1e-6) or lamp.position[1] == 6.19
    from_the_window = sum(np.array(lamp.color) for lamp in lamps if lamp.position[1] == 6.19)
    first, second = (sum(np.array(lamp.color) for lamp in part) for part in (lamps[32:144], lamps[144:]))
    # A second bounce has less light than the first in every colour.
    assert (second < first).all()
    assert (second > 0.1 * first).all()
    assert (from_the_window > 0).all()


def test_light_paths_meet_what_golden_meets():
    mesh, _ = furnished_room()
    scene = load_scene("vpl")
    rng = np.random.default_rng(1)
    origins, directions = rng.uniform((0.5, 0.5, 0.5), (4.5, 5.5, 2.2), (200, 3)), rng.normal(size=(200, 3))
    triangle, t = _meets(mesh.vertices[mesh.triangles], origins, directions)
    hits = trace(scene, origins, directions)
    assert (triangle == hits.prim_id).mean() > 0.99
    assert np.isclose(t, hits.t, rtol=1e-9).mean() > 0.99


def cell(x, y):
    return MAP[len(MAP) - 1 - int(y // CELL)][int(x // CELL)]


def test_the_walk_goes_through_open_halls():
    scene = load_scene("walk")
    assert scene.duration == 8
    previous = None
    for time in np.linspace(0, 8, 41):
        posed = scene.at_time(time)
        camera = posed.cameras[0]
        assert cell(*camera.eye[:2]) == "."
        assert 1.5 < camera.eye[2] < 1.75
        halls = np.array([instance.name == "halls" for instance in posed.instances])
        for angle in np.linspace(0, 2 * np.pi, 8, endpoint=False):
            hits = trace(posed, camera.eye, (np.cos(angle), np.sin(angle), 0.0))
            assert hits.t > 0.3 or not halls[hits.instance_id]
        forward = camera.at - camera.eye
        if previous is not None and np.linalg.norm(camera.eye - previous) > 0.1:
            assert forward @ (camera.eye - previous) > 0
        previous = camera.eye
    assert np.linalg.norm(posed.cameras[0].eye - scene.cameras[0].eye) > 8


def test_the_walk_moves_all_that_can_move():
    scene = load_scene("walk")
    start, later = scene.at_time(0.0), scene.at_time(5.5)
    moved = {a.name for a, b in zip(start.instances, later.instances, strict=True)
             if not np.allclose(a.transform, b.transform)}
    assert moved == {"weapon", "gate", *(f"drone {k}" for k in range(4)), *(f"shot {k}" for k in range(3))}
    assert len(start.lights) == len(later.lights) == 15
    lights = {a.name for a, b in zip(start.lights, later.lights, strict=True)
              if not np.allclose(a.position, b.position)}
    assert lights == moved - {"weapon", "gate"} | {"torch"}


def test_the_gate_is_open_when_the_walker_is_there():
    scene = load_scene("walk")
    gate = next(k for k, instance in enumerate(scene.instances) if instance.name == "gate")
    eyes = {time: scene.at_time(time).cameras[0].eye for time in np.linspace(0, 8, 161)}
    time = min(eyes, key=lambda t: abs(eyes[t][1] - 7.0) + abs(eyes[t][0] - 5.0))
    assert abs(eyes[time][1] - 7) < 0.3
    posed = scene.at_time(time)
    assert posed.instances[gate].transform[0, 3] > 6.5
    assert scene.at_time(0.0).instances[gate].transform[0, 3] == 5.0


def test_the_weapon_stays_in_the_hand():
    scene = load_scene("walk")
    number = next(k for k, instance in enumerate(scene.instances) if instance.name == "weapon")
    offsets = []
    for time in (0.0, 1.3, 2.9, 5.5, 8.0):
        posed = scene.at_time(time)
        right, up, forward = posed.cameras[0].basis()
        place = posed.instances[number].transform[:, 3]
        offsets.append(np.array((right, up, forward)) @ (place - posed.cameras[0].eye))
    assert np.array(offsets) == pytest.approx(np.tile((0.17, -0.16, 0.36), (5, 1)), abs=1e-6)
