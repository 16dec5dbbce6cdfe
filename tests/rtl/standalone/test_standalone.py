"""A chip without an external memory: its scene in block RAM, its picture straight to a screen."""

import ctypes
import random
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from rtl.memory_ports import memory_ports
from rtl.standalone.frame_store import FrameStore
from rtl.standalone.scene_memory import SceneMemory
from rtl.standalone.standalone_top import StandaloneTop
from rtl.video.mode import VideoMode
from sim.machine.component_build import component_library
from sim.machine.dvi_receiver import DviReceiver, unpacked
from sim.machine.machine import camera_words, memory_words
from sim.model import render_model
from sim.scene.compile import compile_scene
from tests.bench import simulate
from tests.sim.machine.scenes import soup_scene
from tests.sim.machine.test_chip import SIMPLE

MODE = VideoMode(name="small", pixel_mhz=25.0, width=64, h_front=8, h_sync=12, h_back=12, height=48, v_front=2,
                 v_sync=2, v_back=3)
SIZE = MODE.width // 2, MODE.height // 2


@pytest.mark.parametrize(("count", "line_words"), [(1, 1), (40, 4), (41, 4), (63, 9), (16, 16)])
def test_lines_come_whole_and_in_order(count, line_words):
    rng = random.Random(count)
    words = [rng.getrandbits(32) for _ in range(count)]
    lines = [rng.randrange(-(-count // line_words)) for _ in range(60)]
    dut = SceneMemory(words, line_words=line_words, line_width=8)
    received, times = [], {}

    async def asks(ctx):
        cycle = 0
        for number, line in enumerate(lines):
            while rng.random() < (0.5 if number < 30 else 0):
                await ctx.tick()
                cycle += 1
            ctx.set(dut.request.valid, 1)
            ctx.set(dut.request.payload, line)
            ready = False
            while not ready:
                _, _, ready = await ctx.tick().sample(dut.request.ready)
                cycle += 1
            times[number] = cycle
            ctx.set(dut.request.valid, 0)
        await ctx.tick().repeat(line_words + 4)

    async def takes(ctx):
        async for _, _, valid, word in ctx.tick().sample(dut.data.valid, dut.data.payload):
            if valid:
                received.append(word)

    simulate(dut, asks, background=[takes])
    padded = words + [0] * line_words
    assert received == [word for line in lines for word in padded[line * line_words:(line + 1) * line_words]]
    # The second half is asked for without a gap, and so comes.
    assert times[59] - times[30] == 29 * line_words


def test_what_cannot_be():
    with pytest.raises(ValueError, match=r"^a line has 0 words; it must have one at least$"):
        SceneMemory([1], line_words=0, line_width=4)
    with pytest.raises(ValueError, match=r"^small: is no multiple of pixels of 32 a side$"):
        FrameStore(MODE, scale_log2=5)


@pytest.fixture(scope="module")
def bench():
    """Two pictures in turn, by a chip of 5.8 at another clock than the screen's."""
    scene = soup_scene(3)
    image = compile_scene(scene, fmt=SIMPLE.fmt, stack_depth=SIMPLE.stack_depth)
    first = scene.default_camera()
    cameras = first, replace(first, eye=[1.9, -1.8, 0.4])
    rows = [camera_words(image, camera, SIZE[0]) for camera in cameras]
    top = StandaloneTop(
        SIMPLE, memories={name: np.ravel(memory_words(image, name, SIMPLE)).tolist() for name in memory_ports(SIMPLE)},
        cameras=[sum(int(word) << 32 * place for place, word in enumerate(words)) for words in rows],
        root=image.root, background=0x204060, mode=MODE, scale_log2=1)
    library = ctypes.CDLL(str(component_library(top, bench=Path(__file__).with_name("standalone.cpp"), optimise="-O1",
                                                domains=("sync", "pixel", "shift"))))
    library.bench_new.restype = ctypes.c_void_p
    models = [render_model(image, camera, *SIZE, config=SIMPLE, background=(0x20, 0x40, 0x60)).color
              for camera in cameras]
    return library, models


@pytest.mark.chip
@pytest.mark.xdist_group("standalone")
def test_pictures_in_turn_on_the_screen(bench):
    library, models = bench
    # Fast enough for a picture between two frames of the screen.
    run = ctypes.c_void_p(library.bench_new(ctypes.c_uint64(1000), ctypes.c_uint64(8000)))
    assert library.bench_draw(run, 1, ctypes.c_uint64(1 << 22))
    frame = 5 * MODE.h_total * MODE.v_total
    pairs = np.zeros(6 * frame, np.uint8)
    assert library.bench_watch(run, pairs.ctypes.data_as(ctypes.c_void_p), ctypes.c_uint64(pairs.size))
    library.bench_delete(run)
    frames = DviReceiver(unpacked(pairs)).frames()
    assert len(frames) >= 4
    # Four bits of a channel
    wanted = [(17 * (model >> 4)).repeat(2, axis=0).repeat(2, axis=1) for model in models]
    assert not np.array_equal(*wanted)
    seen = set()
    for each in frames:
        assert each.picture.shape == wanted[0].shape
        right = np.stack([(each.picture == want).all(axis=-1) for want in wanted])
        assert right.any(axis=0).all(), "a pixel is of neither picture"
        seen |= {number for number in range(2) if right[number].all()}
    assert seen == {0, 1}
