"""The chip against the model: every pixel's instance, triangle, t, u, v and colour."""

from dataclasses import replace

import numpy as np
import pytest

from fpu import FloatFormat
from rtl.config import ChipConfig
from sim.golden import render_golden
from sim.machine import HangError, SimulationError, render_pysim, render_rtl
from sim.machine.bench import Bench
from sim.machine.machine import camera_words
from sim.model import render_model
from sim.scene import load_scene
from sim.scene.compile import compile_scene
from sim.stability.meshes import ball
from sim.stability.truth import scene_of

from .scenes import instances_scene, soup_scene

# Compiled chips are kept; one worker for all of these compiles each only once.
pytestmark = [pytest.mark.chip, pytest.mark.xdist_group("chip")]

#: The default chip, and one in which everything is short: caches, queues, mailbox, threads.
CHIPS = {
    "default": ChipConfig(),
    "small": replace(ChipConfig(), num_threads=7, node_lines=8, list_lines=4, matrix_lines=4, num_fetches=2,
                     mailbox_entries=1),
}

#: A chip that is quick to compile and to simulate.
SIMPLE = replace(ChipConfig(), fmt=FloatFormat(5, 8), num_threads=4, mailbox_entries=0, stack_depth=16, add_latency=1,
                 mul_latency=1, div_latency=2, cmp_latency=1, node_lines=8, list_lines=4, matrix_lines=4)


def assert_equal(scene, *, config, size, flatten=None, **memory):
    image = compile_scene(scene, fmt=config.fmt, stack_depth=config.stack_depth, flatten=flatten)
    camera = scene.default_camera()
    model = render_model(image, camera, *size, config=config, background=(1, 2, 3))
    frame = render_rtl(image, camera, *size, config=config, background=(1, 2, 3), **memory)
    assert not frame.differs(model).any()
    assert frame.report["packets"] == -(-size[0] // 2) * -(-size[1] // 2)
    assert frame.report["rays"] == size[0] * size[1]
    return frame, model


@pytest.mark.parametrize("chip", CHIPS)
@pytest.mark.parametrize("seed", [1, 2, 3])
def test_room_under_random_latencies(chip, seed):
    frame, model = assert_equal(load_scene("room"), config=CHIPS[chip], size=(80, 60), jitter=30, seed=seed)
    assert (frame.prim_id >= 0).all()
    assert len(np.unique(model.prim_id)) > 50


@pytest.mark.parametrize("chip", CHIPS)
@pytest.mark.parametrize("seed", range(4))
def test_instances(chip, seed):
    frame, _ = assert_equal(instances_scene(seed), config=CHIPS[chip], size=(64, 48), jitter=9 * seed, seed=seed + 1)
    assert len(np.unique(frame.instance_id)) > 6


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("flatten", [True, False])
def test_random_triangles(seed, flatten):
    frame, _ = assert_equal(soup_scene(seed), config=CHIPS["default"], size=(64, 48), flatten=flatten, seed=seed)
    assert 0.05 < (frame.prim_id < 0).mean() < 0.95


def test_cracks_are_closed():
    """In few bits a ball of many triangles shows its far side through its near one; edges that give close that."""
    scene = scene_of(ball(6, roughness=0.1, rng=np.random.default_rng(1)).corners)
    frame, _ = assert_equal(scene, config=SIMPLE, size=(64, 48), jitter=5)
    image, camera = compile_scene(scene, fmt=SIMPLE.fmt, stack_depth=SIMPLE.stack_depth), scene.default_camera()
    firm = render_model(image, camera, 64, 48, config=replace(SIMPLE, edge_tolerance=0))
    golden = render_golden(scene, camera, 64, 48)
    leaks, closed = ((golden.prim_id >= 0) & ~(drawn.t < 1.1 * golden.t) for drawn in (firm, frame))
    assert leaks.sum() > 5 > 2 * closed.sum()


@pytest.mark.parametrize("size", [(1, 1), (2, 1), (17, 3), (5, 33), (16, 16)])
def test_sizes(size):
    assert_equal(load_scene("room"), config=CHIPS["default"], size=size)


def test_two_levels_draw_what_one_level_draws():
    # Both compilations centre and scale the one mesh alike, so not even rounding differs.
    scene = load_scene("room")
    _, flat = assert_equal(scene, config=CHIPS["default"], size=(64, 48), flatten=True)
    _, nested = assert_equal(scene, config=CHIPS["default"], size=(64, 48), flatten=False)
    assert (flat.differs_in_surface(nested)).mean() < 0.01


def test_counters_agree_with_the_model():
    frame, model = assert_equal(load_scene("room"), config=CHIPS["default"], size=(64, 48))
    cycles, counts = frame.report["cycles"], model.report["counts"]
    busy = {unit: round(fraction * cycles) for unit, fraction in frame.report["busy"].items()}
    assert busy == {"traversal": counts["steps"], "list": counts["entries"],
                    "transformation": counts["transformed_vectors"], "intersection": counts["triangle_tests"]}
    looked_up = {name: sum(count.values()) for name, count in frame.report["cache"].items()}
    assert looked_up == {"nodes": counts["steps"] + counts["leaves"], "lists": counts["entries"],
                         "matrices": looked_up["matrices"]}
    assert frame.report["bytes"]["shading"] == 4 * np.count_nonzero(frame.prim_id >= 0)


def test_a_dead_memory_is_reported_as_a_hang_with_threads_and_units():
    config = CHIPS["default"]
    scene = load_scene("room")
    image = compile_scene(scene, fmt=config.fmt)
    with Bench(config, latency=1_000_000) as bench:
        for name in ("nodes", "lists", "matrices", "shading"):
            bench.load(name, getattr(image, name))
        with pytest.raises(HangError, match=r"stands still since cycle \d+: thread 48 in node cache since cycle \d+; "
                                            "thread 49 in node cache"):
            bench.draw(camera=camera_words(image, scene.default_camera(), 8), root=image.root, width=8, height=8,
                       background=0, hang_cycles=2_000)


def test_reading_beyond_a_memory_is_an_error():
    config = CHIPS["default"]
    scene = load_scene("room")
    image = compile_scene(scene, fmt=config.fmt)
    with Bench(config) as bench:
        for name in ("nodes", "lists", "shading"):
            bench.load(name, getattr(image, name))
        bench.load("matrices", image.matrices[:4])
        with pytest.raises(SimulationError, match="reads beyond a memory in cycle"):
            bench.draw(camera=camera_words(image, scene.default_camera(), 16), root=image.root, width=16, height=16,
                       background=0)


def test_waveform_of_a_pixel(tmp_path, monkeypatch):
    monkeypatch.setenv("DYNRT_OPTIMISE", "-O0")
    config = SIMPLE
    scene = load_scene("room")
    image = compile_scene(scene, fmt=config.fmt, stack_depth=config.stack_depth)
    path = tmp_path / "pixel.vcd"
    frame = render_rtl(image, scene.default_camera(), 16, 16, config=config, wave=path, pixels=[(9, 9)])
    times = [int(line[1:]) for line in path.read_text().splitlines() if line.startswith("#")]
    assert 0 < len(times) // 2 < frame.report["cycles"] / 2
    assert "traversal" in path.read_text()


def test_amaranths_own_simulator():
    config = SIMPLE
    scene = soup_scene(1, count=12)
    image = compile_scene(scene, fmt=config.fmt, stack_depth=config.stack_depth)
    frame = render_pysim(image, scene.default_camera(), 4, 4, config=config)
    model = render_model(image, scene.default_camera(), 4, 4, config=config)
    assert not frame.differs(model).any()
    assert (frame.prim_id >= 0).any()
