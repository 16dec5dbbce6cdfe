"""The chip at the limits of what it can draw: as many lights as there may be, mirrors that see each other."""

import numpy as np
import pytest

from sim.scene import Camera, Light, Material

from ..golden.rooms import quad, scene_of
from .test_shading import CHIPS, assert_equal, floor

pytestmark = [pytest.mark.chip, pytest.mark.xdist_group("shading_chip")]

CHIP = CHIPS["mirrors and shadows, two pipelines"]


@pytest.fixture(autouse=True)
def quickly_compiled(monkeypatch):
    """It draws very little."""
    monkeypatch.setenv("DYNRT_OPTIMISE", "-O0")


def test_a_hall_of_mirrors():
    """Two mirrors face each other: each ray goes to and fro until its depth ends it."""
    mirror = Material("mirror", (1.0, 1.0, 1.0), reflection=1.0, tinted=True)
    scene = scene_of(quad([(-40, 2, -40), (40, 2, -40), (40, 2, 40), (-40, 2, 40)], mirror),
                     quad([(-40, -2, 40), (40, -2, 40), (40, -2, -40), (-40, -2, -40)], mirror),
                     lights=[Light("point", position=(0.3, 0.0, 1.0), intensity=2.0, radius=0.2)])
    size = 12, 8
    frame, kinds = assert_equal(scene, config=CHIP, size=size, jitter=10, flatten=True,
                                camera=Camera((0, 0, 0), (0.02, 1, 0.01), (0, 0, 1), 20.0))
    assert kinds["primary"] == size[0] * size[1]
    assert kinds["reflection"] == CHIP.shader.depth * size[0] * size[1]
    assert not kinds["shadow"]
    # What is not started adds nothing.
    assert not frame.color.any()


def test_256_lights():
    rng = np.random.default_rng(3)
    places = np.column_stack([rng.uniform(-3, 3, (256, 2)), rng.uniform(1.5, 4, 256)])
    lights = [Light("point", position=place, color=rng.dirichlet((1, 1, 1)), intensity=0.15, radius=0.3)
              for place in places]
    screen = quad([(-1, 0.5, 0), (1, 0.5, 0), (1, 0.5, 1.5), (-1, 0.5, 1.5)], Material("screen", (0.5, 0.5, 0.5)))
    size = 6, 5
    frame, kinds = assert_equal(scene_of(floor(), screen, lights=lights), config=CHIP, size=size, jitter=10,
                                flatten=True, camera=Camera((3.0, -5.0, 3.0), (0, 0, 0.3), (0, 0, 1), 30.0))
    # Every light for every point, but for those behind the screen's back.
    assert kinds["shadow"] > 200 * size[0] * size[1]
    assert len(np.unique(frame.color.reshape(-1, 3), axis=0)) > 20
