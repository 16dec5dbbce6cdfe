"""Several frames on one chip, whose memories are written while it draws."""

import re
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from rtl.config import ChipConfig
from sim.machine import SimulationError, render_frames
from sim.machine.bench import Bench
from sim.model import render_full, render_model
from sim.scene import load_scene
from sim.scene.compile import CompiledScene

from .scenes import instances_scene
from .test_shading import CHIPS

pytestmark = pytest.mark.chip

# Compiled chips are kept; one worker for all of these compiles each only once.
of_the_chip = pytest.mark.xdist_group("chip")


def walk_poses(*times):
    scene = load_scene("walk")
    poses = [scene.at_time(t) for t in times]
    return scene, [(pose, pose.default_camera()) for pose in poses]


@of_the_chip
def test_frames_of_key_frames():
    scene, poses = walk_poses(0.0, 1.0, 2.6, 5.5)
    config, size = ChipConfig(), (48, 36)
    compiled = CompiledScene(scene, fmt=config.fmt)
    frames = list(render_frames(compiled, poses, *size, config=config, background=(1, 2, 3), jitter=5))
    assert len(frames) == 4
    for number, ((image, frame), (pose, camera)) in enumerate(zip(frames, poses, strict=True)):
        # Its own image is that of a slot; the picture is that of any image of the scene.
        alone = render_model(compiled.image(pose, eye=camera.eye), camera, *size, config=config, background=(1, 2, 3))
        assert not frame.differs(alone).any()
        assert image.root == compiled.slots.first_node(number & 1)
        upload, counters = frame.report["upload"], frame.report
        assert counters["packets"] == 24 * 18
        # Of this frame alone.
        assert 0 < counters["bytes"]["matrices"] <= 36 * counters["cache"]["matrices"]["misses"]
        if number:
            assert upload["bytes_per_cycle"] == pytest.approx(upload["bytes"] / frames[number - 1][1].report["cycles"])
            assert upload["between"] == {}
            assert upload["ahead"]["matrices"] == 36 * 10
            assert upload["bytes"] < image.num_bytes / 300
        else:
            assert upload["bytes"] == image.num_bytes
    assert all(before.differs_in_surface(after).mean() > 0.1
               for (_, before), (_, after) in pairwise(frames))


@of_the_chip
def test_frames_of_a_function():
    scene = instances_scene(2)
    config, size = ChipConfig(), (32, 24)
    compiled = CompiledScene(scene, fmt=config.fmt, flatten=False)

    def shake(number, instance, t):
        return instance.transform + t * np.sin(np.arange(12.0) + number).reshape(3, 4) * [0, 0, 0, 0.3]

    camera = scene.default_camera()
    poses = [(scene.at_time(t, move=shake), camera) for t in (0.0, 1.0, 2.0)]
    frames = [frame for _, frame in render_frames(compiled, iter(poses), *size, config=config)]
    for frame, (pose, _) in zip(frames, poses, strict=True):
        assert not frame.differs(render_model(compiled.image(pose, eye=camera.eye), camera, *size, config=config)).any()
    assert frames[0].differs(frames[1]).mean() > 0.05
    assert frames[0].differs(frames[2]).mean() > 0.05


@pytest.mark.xdist_group("shading_chip")
def test_frames_of_full_shading(monkeypatch):
    # Compiling a chip takes longer than three small pictures; this one is compiled already.
    monkeypatch.setenv("DYNRT_OPTIMISE", "-O0")
    scene, poses = walk_poses(0.0, 3.0, 6.0)
    compiled = CompiledScene(scene, fmt=ChipConfig().fmt)
    config, size = CHIPS["two shaders"], (8, 6)
    frames = [frame for _, frame in render_frames(compiled, poses, *size, config=config, background=(9, 8, 7))]
    for number, (frame, (pose, camera)) in enumerate(zip(frames, poses, strict=True)):
        image = compiled.image(pose, eye=camera.eye, is_full=True, background=(9, 8, 7))
        assert (frame.color == render_full(image, camera, *size, config=config).color).all()
        upload = frame.report["upload"]
        if number:
            assert upload["between"] == {"records": 36}
            assert upload["ahead"]["records"] == 36 * (10 + 15)
    assert (frames[0].color != frames[1].color).mean() > 0.5


@of_the_chip
def test_the_example_of_the_documentation(tmp_path, monkeypatch):
    page = Path(__file__).parents[3] / "docs" / "moving.md"
    monkeypatch.chdir(tmp_path)
    exec(re.search(r"```python\n(.*?)```", page.read_text(), re.DOTALL)[1], {})
    pictures = [np.asarray(Image.open(tmp_path / f"lift-{number}.png")).astype(int) for number in range(4)]
    # What moves is seen to move, and further each time.
    differ = [(picture != pictures[0]).any(axis=2).sum() for picture in pictures[1:]]
    assert 0 < differ[0] < differ[2]


@of_the_chip
def test_no_frames():
    scene = instances_scene(0)
    compiled = CompiledScene(scene, fmt=ChipConfig().fmt, flatten=False)
    assert list(render_frames(compiled, [], 4, 4, config=ChipConfig())) == []


@of_the_chip
def test_writing_beyond_a_memory():
    with Bench(ChipConfig()) as bench:
        bench.load("lists", np.zeros(8, np.uint32))
        bench.write("lists", 5, np.ones(3, np.uint32))
        with pytest.raises(SimulationError, match=r"words 6 to 8 are not all in the memory 'lists', which has 8"):
            bench.write("lists", 6, np.ones(3, np.uint32))
        with pytest.raises(SimulationError, match=r"words -1 to 0 are not all in the memory 'lists'"):
            bench.write("lists", -1, np.ones(2, np.uint32))
        with pytest.raises(SimulationError, match=r"not all in the memory 'nodes', which has 0"):
            bench.write("nodes", 0, np.ones(1, np.uint32))
