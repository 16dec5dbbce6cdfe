"""Light, normals, opacity and weights in pictures, against formulas worked out here."""

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sim.golden import render_golden, shade_full
from sim.golden.surface import normals
from sim.golden.tables import surfaces
from sim.golden.tracer import scene_geometry, trace
from sim.scene import Camera, Light, Material, Mesh, Texture

from .rooms import BLACK, FAR, WHITE, ball, quad, scene_of, see

DOWN = (0.0, 0.0, -1.0)


def ground(material=WHITE, **others):
    return quad([(-50, -50, 0), (50, -50, 0), (50, 50, 0), (-50, 50, 0)], material, **others)


def lit(light, point=(0.0, 0.0), *, material=WHITE, eye=(0.3, 0.2, 1.0), **others):
    """Colour of a point of the ground."""
    scene = scene_of(ground(material), lights=[light], **others)
    return see(scene, eye, np.array((*point, 0.0)) - eye)


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


CHECKED = Texture("checked", np.array([[(255, 0, 0, 255), (0, 255, 0, 0)], [(0, 0, 255, 64), (255, 255, 255, 255)]],
                                      np.uint8), filtered=False)
CORNERS = [(0, 0), (1, 0), (1, 1), (0, 1)]


def leaf(material, z):
    return quad([(0, 0, z), (2, 0, z), (2, 2, z), (0, 2, z)], material, uvs=CORNERS)


def test_textures_lie_where_their_coordinates_say():
    scene = scene_of(leaf(Material("m", (1.0, 1.0, 1.0), CHECKED), 0), lights=[Light("directional", direction=DOWN)])
    seen = [see(scene, (x, y, 1), DOWN).tolist() for x, y in ((0.5, 0.5), (1.5, 0.5), (0.5, 1.5), (1.5, 1.5))]
    assert seen == [[1, 0, 0], [0, 1, 0], [0, 0, 1], [1, 1, 1]]
    violet = Material("m", (1.0, 0.0, 1.0), CHECKED)
    assert see(scene_of(leaf(violet, 0), lights=scene.lights), (1.5, 1.5, 1), DOWN).tolist() == [1, 0, 1]


def test_alpha_modes():
    light = [Light("directional", direction=DOWN)]
    glow = Material("glow", (0, 0, 0), emission=(1.0, 1.0, 1.0))

    def seen(x, y, **others):
        material = Material("m", (1.0, 1.0, 1.0), CHECKED, **others)
        return see(scene_of(leaf(material, 1), ground(glow), lights=light), (x, y, 2), DOWN)

    assert seen(1.5, 0.5, alpha_mode="opaque").tolist() == [0, 1, 0]
    assert seen(1.5, 0.5, alpha_mode="mask").tolist() == [1, 1, 1]
    assert seen(0.5, 1.5, alpha_mode="mask", alpha_cutoff=64 / 255).tolist() == [0, 0, 1]
    assert seen(0.5, 1.5, alpha_mode="mask", alpha_cutoff=65 / 255).tolist() == [1, 1, 1]
    a = 64 / 255
    assert seen(0.5, 1.5, alpha_mode="blend") == pytest.approx((1 - a, 1 - a, 1))
    a *= 102 / 255
    assert seen(0.5, 1.5, alpha_mode="blend", opacity=0.4) == pytest.approx((1 - a, 1 - a, 1))
    assert seen(1.5, 0.5, alpha_mode="blend").tolist() == [1, 1, 1]


def test_shadows_of_leaves_veils_and_coloured_glass():
    light = [Light("point", position=(1, 1, 400), intensity=400.0**2)]

    def lit_through(x, y, material):
        # Straight down under the leaf, looked at from below it.
        scene = scene_of(leaf(material, 1), ground(), lights=light)
        return see(scene, (x, y, 0.5), DOWN)

    white = Material("m", (1.0, 1.0, 1.0), CHECKED)
    assert lit_through(0.5, 0.5, white).tolist() == [0, 0, 0]
    assert lit_through(1.5, 0.5, white).tolist() == [0, 0, 0]
    masked = replace(white, alpha_mode="mask")
    assert lit_through(0.5, 0.5, masked).tolist() == [0, 0, 0]
    assert lit_through(1.5, 0.5, masked) == pytest.approx((1, 1, 1), rel=1e-4)
    assert lit_through(0.5, 1.5, replace(white, alpha_mode="blend")) == pytest.approx([1 - 64 / 255] * 3, rel=1e-4)
    pane = Material("pane", (1.0, 0.0, 0.2), transmission=0.8, reflection=0.2)
    tint = lit(Light("directional", direction=DOWN), material=Material("m", pane.base_color))
    expected = tint * (1 - 51 / 255) * 204 / 255
    assert lit_through(0.5, 0.5, pane) == pytest.approx(expected, rel=1e-4)
    scene = scene_of(leaf(pane, 1), leaf(pane, 1.5), ground(), lights=light)
    assert see(scene, (0.5, 0.5, 0.5), DOWN) == pytest.approx(expected * expected, rel=1e-4)


def test_rays_end_in_the_65th_hole():
    holes = Material("m", (1.0, 1.0, 1.0), CHECKED, alpha_mode="mask")
    for count, color, spent in ((64, 1.0, 0), (65, 0.0, 1)):
        leaves = [leaf(holes, 1 + k) for k in range(count)]
        scene = scene_of(*leaves, ground(), lights=[Light("point", position=(1.5, 0.5, 0.7), intensity=0.49)])
        colors, levels = shade_full(scene, (1.5, 0.5, 99), np.array([[DOWN]]))
        assert colors[0, 0, 0] == pytest.approx(color)
        assert levels[0]["spent"] == spent
        lamp = Light("point", position=(1.5, 0.5, 100), intensity=1e4)
        assert see(replace(scene, lights=[lamp]), (1.5, 0.5, 0.5), DOWN)[0] == pytest.approx(color)


share = st.integers(0, 255).map(lambda n: n / 255)
color = st.tuples(share, share, share)


@st.composite
def any_material(draw):
    return Material("any", draw(color), reflection=draw(share), transmission=draw(share), ior=draw(st.floats(0.5, 3)),
                    fresnel=draw(st.booleans()), tinted=draw(st.booleans()), thin=draw(st.booleans()),
                    opacity=draw(share), alpha_mode=draw(st.sampled_from(("opaque", "blend"))))


CAMERA = Camera((0, -2.5, 0.4), (0, 0, 0), (0, 0, 1), 40.0)


@settings(max_examples=40, deadline=None)
@given(any_material(), any_material())
def test_nothing_is_brighter_than_what_lights_it(outer, inner):
    """In white surroundings and white ambient light, no colour exceeds 1, and more generations only add."""
    scene = scene_of(ball((0, 0, 0), 1.0, outer, num_rings=8), ball((0, 0, 0), 0.5, inner, num_rings=6),
                     lights=[FAR], ambient=(1.0, 1.0, 1.0))
    previous = np.zeros((12, 16, 3))
    for depth in (0, 1, 3):
        colors, _ = shade_full(scene, *CAMERA.rays(16, 12), depth=depth, background=(255, 255, 255))
        assert (colors <= 1 + 1e-9).all()
        assert (colors >= previous - 1e-12).all()
        previous = colors


@settings(max_examples=40, deadline=None)
@given(any_material())
def test_white_in_white_surroundings_stays_white(material):
    """Weights of local light, reflection, refraction and what is behind sum to 1, so a white plate vanishes."""
    plate = quad([(-9, -9, 0), (9, -9, 0), (9, 9, 0), (-9, 9, 0)], replace(material, base_color=(1.0, 1.0, 1.0)))
    scene = scene_of(plate, lights=[FAR], ambient=(1.0, 1.0, 1.0))
    for origin in ((0.3, 0.1, 1.0), (0.3, 0.1, -1.0)):
        colors = see(scene, origin, np.array([(0.1, 0.2, -0.5), (0.9, 0.1, -0.2)]) * (1, 1, origin[2]), depth=1,
                     background=(255, 255, 255))
        assert colors == pytest.approx(1.0, abs=2**-11)


def test_pictures_have_srgb_bytes():
    scene = scene_of(ground(), lights=[Light("directional", direction=DOWN, intensity=0.2)])
    camera = Camera((0, 0, 5), (0, 0, 0), (0, 1, 0), 30.0)
    frame = render_golden(scene, camera, 4, 3, shading="full")
    assert (frame.color == round(255 * (1.055 * 0.2 ** (1 / 2.4) - 0.055))).all()
    assert frame.report["rays"][0]["rays"] == 12
    bright = replace(scene, lights=[Light("directional", direction=DOWN, intensity=20)])
    assert (render_golden(bright, camera, 4, 3, shading="full").color == 255).all()
    with pytest.raises(ValueError, match="shading is 'phong'; it must be simple or full"):
        render_golden(scene, CAMERA, 4, 3, shading="phong")


def test_stored_colours_have_eight_bits():
    """0.5 linear is byte 188 in sRGB, which is 0.503 linear."""
    byte = round(255 * (1.055 * 0.5 ** (1 / 2.4) - 0.055))
    stored = ((byte / 255 + 0.055) / 1.055) ** 2.4
    assert lit(Light("directional", direction=DOWN), material=Material("m", (0.5,) * 3))[0] == pytest.approx(stored)
    assert stored != 0.5
