"""Light, highlights, normals, textures and bytes in pictures, against formulas worked out here."""

import math
from dataclasses import replace

import numpy as np
import pytest

from sim.golden import render_golden, shade_full
from sim.golden.surface import normals
from sim.golden.tables import surfaces
from sim.golden.tracer import scene_geometry, trace
from sim.scene import Camera, Light, Material, Mesh

from .rooms import BLACK, CHECKED, DOWN, FAR, WHITE, ball, ground, leaf, lit, quad, scene_of, see


@pytest.mark.parametrize("distance", [0.5, 1, 2, 7.5])
def test_point_light_falls_off_with_the_square(distance):
    light = Light("point", position=(0, 0, distance), intensity=3, color=(0.25, 0.5, 1.0))
    expected = 3 / distance**2 * np.round(255 * np.array((0.25, 0.5, 1))) / 255
    assert lit(light) == pytest.approx(expected, rel=1e-12)
    # Aslant by 3 on the ground: 1/(d² + 9), and the cosine d/√(d² + 9).
    assert lit(light, (3.0, 0))[2] == pytest.approx(3 * distance / (distance**2 + 9) ** 1.5, rel=1e-9)


def test_a_lights_radius_bounds_it_and_its_reach_ends_it():
    light = Light("point", position=(0, 0, 2), intensity=3)
    assert lit(replace(light, radius=4.0))[0] == pytest.approx(3 / 16)
    assert lit(replace(light, radius=1.9))[0] == pytest.approx(3 / 4)
    assert lit(replace(light, reach=2.5))[0] == pytest.approx(3 / 4 * (1 - (2 / 2.5) ** 4))
    assert lit(replace(light, reach=2.0))[0] == 0
    assert lit(replace(light, reach=1.0))[0] == 0


def test_directional_light_has_the_cosine_alone():
    light = Light("directional", direction=(3, 0, -4), intensity=0.75, color=(2.0, 1.0, 0.0))
    hue = np.round(255 * np.array((1, 0.5, 0))) / 255
    for point in ((0, 0), (30, -20)):
        assert lit(light, point) == pytest.approx(0.75 * 2 * hue * 0.8)
    assert lit(replace(light, direction=np.array((3.0, 0, 4)))).tolist() == [0, 0, 0]


def test_spot_lights():
    spot = Light.spot((0, 0, 2), DOWN, inner_angle=0.2, outer_angle=0.5, intensity=4)
    for angle in (0.0, 0.1, 0.19, 0.3, 0.45, 0.51, 1.2):
        x = 2 * math.tan(angle)
        inside = (math.cos(angle) - math.cos(0.5)) / (math.cos(0.2) - math.cos(0.5))
        expected = 4 / (4 + x * x) * math.cos(angle) * min(max(inside, 0), 1) ** 2
        assert lit(spot, (x, 0.0))[0] == pytest.approx(expected, rel=1e-9, abs=1e-12)
    patch = Light.patch((0, 0, 2), (0, 1, -1), intensity=4)
    towards = np.array((1.0, 3.0, -2.0))
    cosine = towards @ (0, 1, -1) / math.sqrt(2) / np.linalg.norm(towards)
    assert lit(patch, (1.0, 3.0))[0] == pytest.approx(4 / 14 * 2 / math.sqrt(14) * cosine, rel=1e-9)
    assert lit(patch, (0.0, -3.0))[0] == 0


def test_lights_add_up_and_touching_ones_light_nothing():
    lights = [Light("point", position=(x, 1, 2), intensity=1 + x * x) for x in range(-2, 3)]
    scene = scene_of(ground(), lights=[*lights, Light("point", position=(0, 0, 0))], ambient=(0.2, 0.2, 0.2))
    expected = sum(lit(light)[0] for light in lights) + 0.2
    assert see(scene, (0.3, 0.2, 1), (-0.3, -0.2, -1))[0] == pytest.approx(expected, rel=1e-6)


@pytest.mark.parametrize(("shininess", "exponent"), [(0, 1), (1, 1), (2.7, 2), (3, 4), (37, 32), (1e9, 1024)])
def test_highlights_are_phongs(shininess, exponent):
    light = Light("point", position=(0.5, 0.4, 2), intensity=2)
    material = Material("m", (0.0, 0.0, 0.0), specular=1.0, shininess=shininess)
    eye = np.array((0.3, 0.2, 1.0))
    for point in ((0.0, 0.0), (0.35, 0.25), (0.5, 0.5)):
        mirrored = (np.array((*point, 0)) - eye) * (1, 1, -1)
        to_light = light.position - (*point, 0)
        cosine = mirrored @ to_light / np.linalg.norm(mirrored) / np.linalg.norm(to_light)
        expected = 2 / (to_light @ to_light) * max(cosine, 0) ** exponent
        assert lit(light, point, material=material)[0] == pytest.approx(expected, rel=1e-9)


def test_metals_tint_their_highlights_and_mirrors():
    gold = Material("gold", (1.0, 0.75, 0.25), specular=1.0, reflection=1.0, tinted=True)
    stored = lit(Light("directional", direction=DOWN), material=replace(gold, specular=0.0, reflection=0.0))
    light = Light("directional", direction=DOWN)
    shine = lit(light, material=gold)
    assert shine / shine[0] == pytest.approx(stored / stored[0])
    scene = scene_of(ground(replace(gold, specular=0.0)), lights=[FAR])
    assert see(scene, (0, 0, 1), (1, 0, -1), background=(255, 255, 255)) == pytest.approx(stored)


def test_a_scene_without_lights_is_lit_from_the_eye():
    scene = scene_of(ground(), quad([(-1, -1, 0.5), (1, -1, 0.5), (1, 1, 0.5), (-1, 1, 0.5)], BLACK))
    eye = np.array((0.0, 0, 6))
    assert see(scene, eye, (3, 4, -6.0))[0] == pytest.approx(0.15 + 0.85 * 6 / math.sqrt(61))
    # From the eye itself nothing is in the shadow.
    assert see(scene, eye, (1.1, 0, -6.0))[0] == pytest.approx(0.15 + 0.85 * 6 / math.hypot(6, 1.1))
    assert see(replace(scene, ambient=(0.0, 0.5, 0.0)), eye, (0, 2, -6.0)) == pytest.approx(
        0.85 * 6 / math.hypot(6, 2) + np.array((0, 0.5, 0)))


def random_transform(rng):
    """An affine map that turns, shears, mirrors or not, and scales unevenly."""
    while True:
        linear = rng.normal(size=(3, 3)) @ np.diag(rng.uniform(0.2, 3, 3) * rng.choice([-1, 1], 3))
        if 0.2 < abs(np.linalg.det(linear)):
            return np.column_stack([linear, rng.uniform(-3, 3, 3)])


@pytest.mark.parametrize("smooth", [False, True])
def test_normals_go_to_the_world_by_the_inverse_transpose(smooth):
    rng = np.random.default_rng(7)
    num_wrong_by_the_matrix_itself = 0
    for _ in range(20):
        transform = random_transform(rng)
        scene = scene_of(ball((0, 0, 0), 1.0, WHITE, num_rings=8, smooth=smooth), transforms=[transform])
        geometry, carried = scene_geometry(scene), surfaces(scene)
        center = transform[:, 3]
        origin = center + 20 * rng.normal(size=3)
        directions = center - origin + rng.normal(size=(40, 3)) * 0.3
        hits = trace(scene, origin, directions)
        mesh = scene.meshes[0]
        for k in np.flatnonzero(hits.is_hit):
            prim, u, v = int(hits.prim_id[k]), float(hits.u[k]), float(hits.v[k])
            found = normals((float(hits.t[k]), u, v, 0, prim), tuple(directions[k]), geometry.corners[prim],
                            geometry.inverses[0], carried)
            world = mesh.vertices[mesh.triangles[prim]] @ transform[:, :3].T
            flat = np.cross(world[1] - world[0], world[2] - world[0])
            flat /= np.linalg.norm(flat)
            flat *= -np.sign(flat @ directions[k])
            assert np.array(found[1]) == pytest.approx(flat, abs=1e-9)
            # Convex and closed: from outside only fronts are seen, whatever the transform mirrors.
            assert found[0]
            if not smooth:
                assert found[2] == found[1]
                continue
            inside = (np.array((1 - u - v, u, v)) @ mesh.shading_normals[prim])
            expected = np.linalg.inv(transform[:, :3]).T @ inside
            expected /= np.linalg.norm(expected)
            assert np.array(found[2]) == pytest.approx(expected, abs=1e-9)
            by_matrix = transform[:, :3] @ inside
            num_wrong_by_the_matrix_itself += abs(by_matrix @ expected) < 0.9 * np.linalg.norm(by_matrix)
    assert not smooth or num_wrong_by_the_matrix_itself > 50


def test_both_sides_are_lit_from_their_own():
    for height, seen_from in ((2, 1), (-2, -1)):
        light = Light("point", position=(0, 0, height), intensity=4)
        for eye_z in (1.0, -1.0):
            expected = 1.0 if eye_z == seen_from else 0.0
            assert lit(light, eye=(0.2, 0.1, eye_z))[0] == pytest.approx(expected)


def test_corner_normals_against_the_winding_are_turned():
    mesh, material = ball((0, 0, 0), 1.0, WHITE, smooth=True)
    turned = Mesh(mesh.name, mesh.vertices, mesh.triangles, mesh.material_ids, normals=-mesh.normals)
    zero = Mesh(mesh.name, mesh.vertices, mesh.triangles, mesh.material_ids, normals=mesh.normals * 0)
    light = Light("directional", direction=(1, 2, -1))
    camera = Camera((-2, -2, 2), (0, 0, 0), (0, 0, 1), 45.0)
    smooth, inverted, flat = (shade_full(scene_of((m, material), lights=[light]), *camera.rays(40, 30))[0]
                              for m in (mesh, turned, zero))
    assert smooth == pytest.approx(inverted)
    bare, _ = ball((0, 0, 0), 1.0, WHITE)
    assert flat == pytest.approx(shade_full(scene_of((bare, material), lights=[light]), *camera.rays(40, 30))[0])
    assert np.abs(smooth - flat).max() > 0.01


def test_textures_lie_where_their_coordinates_say():
    scene = scene_of(leaf(Material("m", (1.0, 1.0, 1.0), CHECKED), 0), lights=[Light("directional", direction=DOWN)])
    seen = [see(scene, (x, y, 1), DOWN).tolist() for x, y in ((0.5, 0.5), (1.5, 0.5), (0.5, 1.5), (1.5, 1.5))]
    assert seen == [[1, 0, 0], [0, 1, 0], [0, 0, 1], [1, 1, 1]]
    violet = Material("m", (1.0, 0.0, 1.0), CHECKED)
    assert see(scene_of(leaf(violet, 0), lights=scene.lights), (1.5, 1.5, 1), DOWN).tolist() == [1, 0, 1]


def test_pictures_have_srgb_bytes():
    scene = scene_of(ground(), lights=[Light("directional", direction=DOWN, intensity=0.2)])
    camera = Camera((0, 0, 5), (0, 0, 0), (0, 1, 0), 30.0)
    frame = render_golden(scene, camera, 4, 3, shading="full")
    assert (frame.color == round(255 * (1.055 * 0.2 ** (1 / 2.4) - 0.055))).all()
    assert frame.report["levels"][0]["rays"] == 12
    assert frame.report["rays"] == 24
    bright = replace(scene, lights=[Light("directional", direction=DOWN, intensity=20)])
    assert (render_golden(bright, camera, 4, 3, shading="full").color == 255).all()
    with pytest.raises(ValueError, match="shading is 'phong'; it must be simple or full"):
        render_golden(scene, camera, 4, 3, shading="phong")


def test_stored_colours_have_eight_bits():
    """0.5 linear is byte 188 in sRGB, which is 0.503 linear."""
    byte = round(255 * (1.055 * 0.5 ** (1 / 2.4) - 0.055))
    stored = ((byte / 255 + 0.055) / 1.055) ** 2.4
    assert lit(Light("directional", direction=DOWN), material=Material("m", (0.5,) * 3))[0] == pytest.approx(stored)
    assert stored != 0.5
