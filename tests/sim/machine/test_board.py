"""A board at its pins: from a driver's commands to the picture on a monitor."""

import random

import numpy as np
import pytest

from rtl.host.protocol import Reason
from rtl.video.mode import VideoMode
from sim.host import BoardReset, Driver, NoAnswer, Refused
from sim.host.loader import Loader
from sim.machine.board_bench import SimulatedBoard
from sim.model import render_model
from sim.scene.compile import compile_scene

from ...rtl.video.screen import expected_bars
from .scenes import instances_scene, soup_scene
from .test_chip import SIMPLE

# One worker compiles the board for all of these.
pytestmark = [pytest.mark.chip, pytest.mark.xdist_group("board")]

MODE = VideoMode(name="small", pixel_mhz=40.0, width=64, h_front=8, h_sync=12, h_back=12, height=48, v_front=2,
                 v_sync=2, v_back=3)
SIZE = MODE.width // 2, MODE.height // 2
BACKGROUND = 10, 20, 30


@pytest.fixture
def board():
    with SimulatedBoard(SIMPLE, mode=MODE) as board:
        yield board


def linked(board):
    return Loader(Driver(board, clock=board.clock, timeout=0.005), SIMPLE, size=SIZE,
                  sleep=lambda seconds: board.run(500))


def image_of(scene):
    return compile_scene(scene, fmt=SIMPLE.fmt, stack_depth=SIMPLE.stack_depth)


def drawn(link, image, camera):
    link.start(image, camera, background=BACKGROUND)
    return link.wait()


def model_of(image, camera):
    return render_model(image, camera, *SIZE, config=SIMPLE, background=BACKGROUND).color


def on_screen(board, picture):
    frames = board.screen(2)
    assert len(frames) == 2
    return all(np.array_equal(frame.picture, picture) for frame in frames)


def doubled(picture):
    return picture.repeat(2, axis=0).repeat(2, axis=1)


def test_from_power_up_to_the_screen(board):
    link = linked(board)
    shown = []
    for scene in (instances_scene(1), soup_scene(2)):
        image, camera = image_of(scene), scene.default_camera()
        model = model_of(image, camera)
        link.load(image)
        counters = drawn(link, image, camera)
        assert counters["packets"] == SIZE[0] * SIZE[1] // 4
        assert counters["cycles"] > counters["busy_traversal"] > 0
        assert np.array_equal(link.picture(), model)
        assert on_screen(board, doubled(model))
        shown.append(model)
    assert not np.array_equal(*shown)
    frames, late = link.screen_counts()
    assert frames > 4
    assert late == 0
    link.test_picture(True)
    board.run(20_000)
    assert on_screen(board, expected_bars(MODE.width, MODE.height))


def test_nothing_is_started_or_moved_while_it_draws(board):
    scene = instances_scene(1)
    image, camera = image_of(scene), scene.default_camera()
    driver = Driver(board, clock=board.clock, timeout=0.005)
    link = Loader(driver, SIMPLE, size=SIZE, sleep=lambda seconds: board.run(500))
    link.load(image)
    link.start(image, camera, background=BACKGROUND)
    for forbidden in (driver.start, lambda: driver.set_register(0, 1)):
        with pytest.raises(Refused) as caught:
            forbidden()
        assert caught.value.reason == Reason.BUSY
    link.wait()
    assert on_screen(board, doubled(model_of(image, camera)))


@pytest.mark.parametrize("seed", range(3))
def test_a_reset_at_any_moment_is_noticed_and_mended(board, seed):
    rng = random.Random(seed)
    scene = soup_scene(seed)
    image, camera = image_of(scene), scene.default_camera()

    class Resetting:
        """The port, through which the board is reset after so many commands."""

        left = rng.randrange(25, 45)

        def write(self, sent):
            board.write(sent)
            self.left -= 1
            if self.left == 0:
                board.run(rng.randrange(20_000))
                board.reset()

        read = staticmethod(board.read)

    link = Loader(Driver(Resetting(), clock=board.clock, timeout=0.005), SIMPLE, size=SIZE,
                  sleep=lambda seconds: board.run(500))

    def until_reset():
        while True:
            link.load(image)
            drawn(link, image, camera)

    with pytest.raises((BoardReset, NoAnswer)):
        until_reset()
    link = linked(board)
    link.load(image)
    drawn(link, image, camera)
    assert on_screen(board, doubled(model_of(image, camera)))
