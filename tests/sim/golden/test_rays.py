"""Secondary rays in pictures: mirrors, glass, shadows at the places that geometry gives them."""

import itertools
import math
from dataclasses import replace

import numpy as np
import pytest

from sim.golden import shade_full, trace
from sim.scene import Camera, Light, Material

from .rooms import BLACK, FAR, WHITE, ball, quad, scene_of, see

MIRROR = Material("mirror", (1.0, 1.0, 1.0), reflection=1.0)
GLASS = Material("glass", (1.0, 1.0, 1.0), transmission=1.0, ior=1.5)
LAMP = Material("lamp", (0.0, 0.0, 0.0), emission=(1.0, 1.0, 1.0))


def floor(material, *, size=50.0, z=0.0, hole=0.0):
    """A horizontal square facing up, from x = ``hole`` on."""
    low = -size if not hole else hole
    return quad([(low, -size, z), (size, -size, z), (size, size, z), (low, size, z)], material)


def edge(is_beyond, low, high):
    """Where a condition that is false at ``low`` and true at ``high`` begins to hold, to float64's last bits."""
    assert not is_beyond(low)
    assert is_beyond(high)
    for _ in range(60):
        middle = (low + high) / 2
        low, high = (low, middle) if is_beyond(middle) else (middle, high)
    return (low + high) / 2


def things():
    """Objects of several looks above z = 0.1."""
    rng = np.random.default_rng(1)
    shiny = Material("shiny", (0.2, 0.5, 0.9), specular=0.6, shininess=16)
    parts = [ball((x, y, 0.9), 0.7, replace(shiny, base_color=tuple(rng.uniform(0.1, 1, 3))), smooth=smooth)
             for x, y, smooth in ((-1.5, 0, True), (0.3, 0.7, False), (1.6, -0.4, True))]
    return [*parts, quad([(-9, 4, 0.1), (9, 4, 0.1), (9, 4, 6), (-9, 4, 6)], Material("wall", (0.7, 0.6, 0.5)))]


LIGHTS = [Light("point", position=(2, -3, 5), intensity=15.0),
          Light("directional", direction=(1, 2, -3), intensity=0.5)]


def test_a_mirror_shows_what_the_mirrored_camera_sees():
    with_mirror = scene_of(*things(), floor(MIRROR), lights=LIGHTS, ambient=(0.1, 0.1, 0.1))
    without = scene_of(*things(), lights=LIGHTS, ambient=(0.1, 0.1, 0.1))
    camera = Camera((0.2, -6, 2), (0, 0, -1.0), (0, 0, 1), 50.0)
    flip = np.array((1, 1, -1))
    # Mirrored in z = 0, right and left change places.
    mirrored = Camera(camera.eye * flip, camera.at * flip, camera.up * flip, camera.hfov_deg)
    size = 96, 72
    direct, levels = shade_full(with_mirror, *camera.rays(*size), depth=1, background=(10, 20, 30))
    expected, _ = shade_full(without, *mirrored.rays(*size), depth=0, background=(10, 20, 30))
    expected = expected[:, ::-1]
    # Only what the mirror shows; above its horizon the camera sees the things themselves.
    shown = camera.rays(*size)[1][..., 2] < -0.4
    assert shown.mean() > 0.4
    assert np.unique(np.round(expected[shown], 3), axis=0).shape[0] > 200
    different = np.abs(direct - expected)[shown].max(axis=1) > 1e-6
    # Pixels at outlines and shadows' edges, where the last bit decides.
    assert different.mean() < 2e-3
    assert levels[0]["reflection"] == levels[1]["rays"] > 0


@pytest.mark.parametrize("angle_deg", [0, 20, 45, 70, 85])
@pytest.mark.parametrize("index", [1.2, 1.5, 2.4])
def test_a_slab_displaces_rays_by_the_textbooks_amount(angle_deg, index):
    """h·sin(θ − θ′)/cos θ′, measured at the edge of a white floor under the slab."""
    thickness, angle = 0.75, math.radians(angle_deg)
    glass = replace(GLASS, ior=index)
    slab = [quad([(-90, -90, 2), (90, -90, 2), (90, 90, 2), (-90, 90, 2)], glass),
            quad([(-90, 90, 2 - thickness), (90, 90, 2 - thickness), (90, -90, 2 - thickness),
                  (-90, -90, 2 - thickness)], glass)]
    scene = scene_of(*slab, floor(LAMP, hole=1e-9), lights=[FAR])
    direction = (math.sin(angle), 0.0, -math.cos(angle))

    def reaches_the_floor(x):
        """Does the ray that would reach (x, 0, 0) without the slab see the floor?"""
        origin = np.array((x, 0.1, 0)) - 4 / math.cos(angle) * np.array(direction)
        return see(scene, origin, direction)[0] > 0.5

    inside = math.asin(math.sin(angle) / index)
    displaced = thickness * math.sin(angle - inside) / math.cos(inside)
    # Sideways by that amount, so along the floor by it over cos θ.
    assert edge(reaches_the_floor, -1.0, 20.0) == pytest.approx(1e-9 + displaced / math.cos(angle), abs=1e-9)


@pytest.mark.parametrize("index", [1.33, 1.5, 2.4])
def test_nothing_leaves_beyond_the_critical_angle(index):
    """From under a surface of glass the lamp above is seen within the critical angle, beyond it only what is below."""
    red = Material("red", (0, 0, 0), emission=(1.0, 0.0, 0.0))
    scene = scene_of(floor(replace(GLASS, ior=index), size=1e3), floor(LAMP, z=1.0, size=1e7),
                     floor(red, z=-2, size=1e7), lights=[FAR])

    def color(angle):
        return see(scene, (0.1, 0.2, -1.0), (math.sin(angle), 0, math.cos(angle)))

    critical = edge(lambda angle: color(angle)[2] < 0.5, 0.0, 1.5)
    assert critical == pytest.approx(math.asin(1 / index), abs=1e-9)
    assert color(critical - 1e-3) == pytest.approx((1, 1, 1))
    assert color(critical + 1e-3) == pytest.approx((1, 0, 0))


def test_fresnels_mirror_is_whole_where_total_reflection_begins():
    glass = replace(GLASS, reflection=0.04, fresnel=True)
    red = Material("red", (0, 0, 0), emission=(1.0, 0.0, 0.0))
    scene = scene_of(floor(glass, size=1e3), floor(LAMP, z=1.0, size=1e7), floor(red, z=-2, size=1e7), lights=[FAR])
    critical = math.asin(1 / 1.5)
    for angle in (0.0, 0.3, 0.5, critical - 1e-7):
        outside = math.asin(1.5 * math.sin(angle))
        mirrored = round(0.04 * 255) / 255
        mirrored += (1 - mirrored) * (1 - math.cos(outside)) ** 5
        assert see(scene, (0.1, 0.2, -1), (math.sin(angle), 0, math.cos(angle))) == pytest.approx(
            (1, 1 - mirrored, 1 - mirrored), abs=1e-6)
    # From outside it is the angle of incidence.
    mirrored = round(0.04 * 255) / 255
    mirrored += (1 - mirrored) * (1 - math.cos(1.2)) ** 5
    scene = scene_of(floor(glass, size=1e3), floor(red, z=-2, size=1e7), lights=[FAR])
    assert see(scene, (0, 0, 1), (math.sin(1.2), 0.1, -math.cos(1.2)), background=(255, 255, 255))[1] == pytest.approx(
        mirrored, rel=0.02)


def test_a_thin_pane_lets_rays_straight_through_in_its_colour():
    pane = Material("pane", (1.0, 0.5, 0.25), transmission=1.0, ior=1.5, thin=True)
    scene = scene_of(quad([(-90, -90, 2), (90, -90, 2), (90, 90, 2), (-90, 90, 2)], pane), floor(LAMP, hole=1e-9),
                     lights=[FAR])
    direction = np.array((0.8, 0.1, -0.6))
    assert edge(lambda x: see(scene, np.array((x, 0, 0)) - 5 * direction, direction)[0] > 0.5, -1, 1) == pytest.approx(
        1e-9, abs=1e-12)
    color = see(scene, (5, 0, 5), direction)
    assert color == pytest.approx((1.0, 0.5, 0.25), abs=0.005)


def test_a_point_lights_shadow_ends_where_it_should():
    screen = quad([(-9, -9, 1), (0.25, -9, 1), (0.25, 9, 1), (-9, 9, 1)], BLACK)
    scene = scene_of(floor(WHITE), screen, lights=[Light("point", position=(-1, 0.3, 3), intensity=9)])

    def is_lit(x):
        # From the side, below the screen.
        origin = np.array((x - 0.2, 5.0, 0.5))
        return see(scene, origin, np.array((x, 0.1, 0)) - origin)[0] > 0

    # From the light through the screen's edge: 1.25 to the side over 2 down, 1.25·3/2 over 3 down.
    assert edge(is_lit, -0.5, 4) == pytest.approx(-1 + 1.25 * 1.5, abs=1e-9)


def test_a_directional_lights_shadow_ends_where_it_should():
    screen = quad([(-9, -9, 1), (0.25, -9, 1), (0.25, 9, 1), (-9, 9, 1)], BLACK)
    scene = scene_of(floor(WHITE), screen, lights=[Light("directional", direction=(0.5, 0.2, -1))])
    origin = np.array((3.0, 5.0, 0.9))
    assert edge(lambda x: see(scene, origin, np.array((x, 0.1, 0)) - origin)[0] > 0, -0.5, 4) == pytest.approx(
        0.75, abs=1e-9)


@pytest.mark.parametrize("gap", [1e-3, 1e-9, 1e-13])
def test_what_lies_just_before_a_surface_shadows_it(gap):
    screen = quad([(-9, -9, gap), (0, -9, gap), (0, 9, gap), (-9, 9, gap)], BLACK)
    lights = [Light("point", position=(0.0, 0.3, 3), intensity=9)]
    # The eye is between the two.
    eye, direction = (-5.0, 0.2, gap / 2), (4.9, 0.0, -gap / 2)
    assert see(scene_of(floor(WHITE), lights=lights), eye, direction)[0] > 0.9
    assert see(scene_of(floor(WHITE), screen, lights=lights), eye, direction)[0] == 0


@pytest.mark.parametrize("smooth", [False, True])
@pytest.mark.parametrize("center", [(0, 0, 0), (1e4, -2e4, 5e3)])
def test_convex_bodies_neither_mirror_nor_shadow_themselves(smooth, center):
    """Every mirrored ray of a ball of flat mirrors escapes, and no lit triangle lies in its own body's shadow."""
    center = np.array(center, np.float64)
    camera = Camera(center + (0, -3, 0.5), center, (0, 0, 1), 40.0)
    scene = scene_of(ball(center, 1.0, MIRROR, smooth=False), lights=[FAR])
    colors, levels = shade_full(scene, *camera.rays(128, 96), background=(255, 255, 255))
    assert levels[0]["hits"] > 3000
    assert levels[1]["misses"] == levels[0]["reflection"] == levels[0]["hits"]
    assert (colors == 1).all()
    light = Light("point", position=center + (2, -4, 3), intensity=10)
    matte = scene_of(ball(center, 1.0, WHITE, smooth=smooth), lights=[light])
    colors, _ = shade_full(matte, *camera.rays(128, 96))
    hits = trace(matte, *camera.rays(128, 96))
    points = camera.eye + np.where(hits.is_hit, hits.t, 0)[..., None] * camera.rays(128, 96)[1]
    to_light = light.position - points
    corners = matte.meshes[0].vertices[matte.meshes[0].triangles[np.maximum(hits.prim_id, 0)]]
    flat = np.cross(corners[..., 1, :] - corners[..., 0, :], corners[..., 2, :] - corners[..., 0, :])
    flat /= np.linalg.norm(flat, axis=-1, keepdims=True)
    distance = np.linalg.norm(to_light, axis=-1)
    cosine = (flat * to_light).sum(axis=-1) / distance
    clearly = hits.is_hit & (cosine > 0.25)
    if smooth:
        assert (colors[clearly] > 0).all()
    else:
        assert colors[clearly][:, 0] == pytest.approx((10 * cosine / distance**2)[clearly], rel=1e-6)


def edge_points(mesh, count):
    """Points on edges of a mesh, clearly on the side of (2, −4, 3) and (0, −4, 1)."""
    rng = np.random.default_rng(1)
    picked = mesh.vertices[mesh.triangles[rng.integers(mesh.num_triangles, size=count)]]
    s = rng.uniform(0, 1, (count, 1))
    points = (1 - s) * picked[:, 0] + s * picked[:, 1]
    return points[(points @ (2, -4, 3) > 2.5) & (points @ (0, -4, 1) > 2.0)]


@pytest.mark.parametrize("transform", [np.eye(3, 4), [[3, 1, 0, 70], [0, 0.7, 0.4, -80], [0.2, 0, 1.5, 90]]])
def test_rays_that_meet_edges_get_away_from_them(transform):
    """The triangle on the edge's other side must neither hide the light (5.7's ε) nor catch the mirrored ray (3.7)."""
    transform = np.asarray(transform, np.float64)
    mesh, material = ball((0, 0, 0), 1.0, replace(MIRROR, reflection=0.5), num_rings=12)
    light = Light("point", position=transform @ (2, -4, 3, 1), intensity=100)
    scene = scene_of((mesh, material), transforms=[transform], lights=[light])
    targets = edge_points(mesh, 40_000)
    assert len(targets) > 3000
    eye = transform @ (0, -4, 1, 1)
    colors, levels = shade_full(scene, eye, (targets @ transform[:, :3].T + transform[:, 3] - eye)[None], depth=1)
    assert (colors > 0).all()
    assert levels[1]["misses"] == levels[0]["hits"] == len(targets)


def test_the_inside_of_a_body_is_found_again_by_its_own_rays():
    """A glass ball bends all rays in and out: two generations, each of as many rays as hit it."""
    scene = scene_of(ball((0, 0, 0), 1.0, GLASS, num_rings=64, smooth=True), lights=[FAR])
    _, levels = shade_full(scene, *Camera((0, -3, 0.1), (0, 0, 0), (0, 0, 1), 20.0).rays(64, 48), depth=2)
    assert levels[0]["hits"] == levels[0]["refraction"] == levels[1]["rays"] == levels[1]["hits"] == 64 * 48
    assert levels[2]["misses"] == levels[2]["rays"] == 64 * 48


@pytest.mark.parametrize("depth", [0, 1, 2, 5])
def test_rays_are_conserved(depth):
    veil = Material("veil", (0.9, 0.8, 0.7), opacity=0.4, alpha_mode="blend", reflection=0.3)
    glass = replace(GLASS, reflection=0.04, fresnel=True)
    scene = scene_of(*things(), floor(replace(MIRROR, reflection=0.5)), ball((0, -2, 1.2), 0.8, glass, smooth=True),
                     ball((2, -2, 1), 0.7, veil), lights=LIGHTS)
    camera = Camera((0.2, -7, 2), (0, 0, 0.7), (0, 0, 1), 50.0)
    _, levels = shade_full(scene, *camera.rays(64, 48), depth=depth)
    assert len(levels) == depth + 1
    assert levels[0]["rays"] == 64 * 48
    for level in levels:
        assert level["rays"] == level["hits"] + level["misses"] + level["spent"]
        assert level["shadow"] <= level["hits"] * len(LIGHTS)
    for level, following in itertools.pairwise(levels):
        assert level["reflection"] + level["refraction"] + level["transparency"] == following["rays"] > 0
    assert [levels[-1][kind] for kind in ("reflection", "refraction", "transparency")] == [0, 0, 0]


def test_depth_zero_is_primary_and_shadow_rays():
    scene = scene_of(floor(MIRROR), *things(), lights=LIGHTS)
    color, levels = shade_full(scene, (0, -1, 2.0), np.array([[(0, 0.1, -1.0)]]), depth=0, background=(255, 255, 255))
    assert color.tolist() == [[[0, 0, 0]]]
    assert len(levels) == 1
    with pytest.raises(ValueError, match="depth is 17; it must be from 0 to 16"):
        shade_full(scene, (0, 0, 2.0), np.array([[(0, 0.1, -1.0)]]), depth=17)


def test_two_mirrors_show_as_many_pictures_as_the_depth():
    """Between facing mirrors each generation sees the lamp's edge once more, dimmed by both mirrors."""
    dim = replace(MIRROR, base_color=(1.0, 1.0, 1.0), reflection=128 / 255, tinted=True)
    glow = replace(dim, emission=(0.5, 0.5, 0.5))
    scene = scene_of(floor(glow), floor(glow, z=1.0), lights=[FAR])
    emitted, r = see(scene, (0, 0, 0.5), (0.01, 0, -1), depth=0)[0], 128 / 255
    for depth in (1, 2, 3, 8):
        expected = emitted * sum(r**k for k in range(depth + 1))
        assert see(scene, (0, 0, 0.5), (0.01, 0, -1), depth=depth)[0] == pytest.approx(expected, rel=1e-9)
    # The 13th generation's weight of 2⁻¹³ is below what is started.
    _, levels = shade_full(scene, (0, 0, 0.5), np.array([[(0.01, 0, -1.0)]]), depth=16)
    assert [level["rays"] for level in levels] == [1] * 13 + [0] * 4
