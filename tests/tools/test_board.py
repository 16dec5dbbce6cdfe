"""Commands that build for a board and talk to one: what they say and write, and how they end."""

import json
import threading
from dataclasses import replace

import numpy as np
import pytest
from click.testing import CliRunner
from PIL import Image

from boards.bitstream import Routed, board_design
from boards.catalog import BOARDS
from boards.critical_path import CriticalPath
from boards.packing import Area
from rtl.host.protocol import Command
from sim.host.tty import PseudoTerminal
from sim.model import render_model
from sim.scene import Camera, load_scene
from sim.scene.compile import CompiledScene
from tests.sim.host.test_loader import DrawingBoard
from tools import build as build_module
from tools.build_report import built, missed, unit_of
from tools.built_in import built_in_scene
from tools.cli import main
from tools.view import moved

BOARD = BOARDS["icepi_zero"]
CLOCKS = {"sync": 50.0, "pixel": 65.0, "shift": 325.0, "sdram": 50.0}


@pytest.fixture
def served():
    """A board of Python at a port that programs open."""
    board, terminal, done = DrawingBoard(BOARD.config, num_words=1 << 23), PseudoTerminal(), threading.Event()

    def serve():
        while not done.is_set():
            terminal.serve(board, seconds=0.02)

    thread = threading.Thread(target=serve)
    thread.start()
    yield board, terminal.path
    done.set()
    thread.join()
    terminal.close()


def run(*arguments):
    return CliRunner().invoke(main, list(map(str, arguments)))


def options(port, *others):
    return ["--port", port, "--board", BOARD.name, "--baud", "115200", *others]


def model_picture():
    scene, config = load_scene("room"), BOARD.config
    compiled = CompiledScene(scene, fmt=config.fmt, stack_depth=config.stack_depth, index_width=config.index_width)
    camera = scene.default_camera()
    return render_model(compiled.image(scene, eye=camera.eye), camera, *BOARD.size, config=config).color


def test_load_compares_what_the_board_drew(served, tmp_path):
    """This one draws colours of its own: all pixels differ but those that are so in the model by chance."""
    board, port = served
    result = run("load", "room", *options(port, "-o", tmp_path / "a.png"))
    assert result.exit_code == 0, result.output
    assert board.starts == 1
    picture = np.asarray(Image.open(tmp_path / "a.png"))
    assert picture.shape == (BOARD.size[1], BOARD.size[0], 3)
    wrong = int((picture != model_picture()).any(axis=-1).sum())
    assert wrong > 1000
    assert result.stderr.endswith(f"\n{tmp_path / 'a.png'}: {wrong} pixels differ from the model\n")


def test_view_goes_round(served):
    board, port = served
    cameras = set()

    def execute(kind, words, again, inner=board._execute):
        if kind == Command.START:
            cameras.add(tuple(board.registers[:9]))
        return inner(kind, words, again)

    board._execute = execute
    result = run("view", "room", *options(port, "--frames", 4))
    assert result.exit_code == 0, result.output
    assert board.starts == 4
    assert len(cameras) == 4
    assert "4 pictures in " in result.stderr


def test_errors_of_the_link(served, tmp_path):
    board, port = served
    board.identity = 1
    result = run("load", "room", *options(port))
    assert result.exit_code == 1
    assert result.stderr.endswith("Error: the board has another chip than this; give --chip the file that was written "
                                  "beside its bitstream\n")
    result = run("load", "room", *options(tmp_path / "none"))
    assert result.exit_code == 1
    assert result.stderr.endswith(f"Error: {tmp_path / 'none'}: cannot be opened: No such file or directory\n")
    result = run("load", "mirror-room", *options(port, "-o", tmp_path / "no" / "a.png"))
    assert result.exit_code == 2
    assert f"Error: {tmp_path / 'no' / 'a.png'}: there is no folder {tmp_path / 'no'}\n" in result.stderr


def test_keys_move_the_camera():
    camera = Camera([0, 0, 0], [0, 2, 0], [0, 0, 1], 60.0)

    def pressed(key):
        return moved(camera, key, step=0.5)

    assert np.allclose((pressed("w").eye, pressed("w").at), [(0, 0.5, 0), (0, 2.5, 0)])
    assert np.allclose((pressed("d").eye, pressed("d").at), [(0.5, 0, 0), (0.5, 2, 0)])
    assert np.allclose((pressed("r").eye, pressed("r").at), [(0, 0, 0.5), (0, 2, 0.5)])
    turned = pressed("l")
    assert np.allclose(turned.eye, 0)
    assert np.allclose(turned.at, [2 * np.sin(np.radians(10)), 2 * np.cos(np.radians(10)), 0])
    assert np.allclose(pressed("k").at, [0, 2 * np.cos(np.radians(10)), 2 * np.sin(np.radians(10))])
    assert pressed("x") is None
    # Looking up ends before there is no right any more.
    for _ in range(20):
        camera = moved(camera, "k", step=1)
    assert np.linalg.norm(np.cross(camera.at - np.asarray(camera.eye), camera.up)) > 0.1


def routed(seed, **mhz):
    path = CriticalPath(start="a", end="b", tables=3, logic_ns=2.0, routing_ns=3.0, through=["a", "c"])
    areas = {"": Area(lut=1, ff=2, dsp=0, ebr=0),
             "system.chip.pipeline0.ray_stack.memory": Area(lut=10, ff=5, dsp=0, ebr=3),
             "system.memory.controller": Area(lut=100, ff=50, dsp=0, ebr=1),
             "system.chip.pipeline0.ray_stack": Area(lut=20, ff=1, dsp=2, ebr=0)}
    return Routed(seed=seed, mhz={"sync": 60.0, "pixel": 80.0, "shift": 400.0} | mhz, path=path, areas=areas)


def test_report_sums_units_and_keeps_all_seeds():
    report = built(BOARD, BOARD.config, CLOCKS, [routed(1, sync=61.0), routed(2, sync=55.5)], {"yosys": "1"})
    assert report["clocks"]["chip"] == {"needed_mhz": 50.0, "worst_mhz": 55.5, "best_mhz": 61.0,
                                        "seeds": [{"seed": 1, "mhz": 61.0}, {"seed": 2, "mhz": 55.5}]}
    assert (report["lut"], report["ff"], report["dsp"], report["ebr"]) == (131, 58, 2, 4)
    assert report["units"] == {"SDRAM": 100, "ray stack": 30, "rest": 1}
    assert report["units_ebr"] == {"ray stack": 3, "SDRAM": 1}
    assert report["lut_fraction"] == round(131 / 24288, 4)
    assert report["paths"][1] == {"seed": 2, "words": "a to b: 3 cells between, 2.0 ns in cells, 3.0 ns between them",
                                  "through": ["a", "c"]}


@pytest.mark.parametrize(("path", "unit"), [
    ("", "rest"), ("display.dvi.encoder0", "display"), ("link.port.receiver", "host link"),
    ("system", "rest"), ("system.memory", "SDRAM"), ("system.chip.ray_generation", "ray generation"),
    ("system.chip.pipeline1", "pipeline"), ("system.chip.pipeline1.traversal.step", "traversal")])
def test_units(path, unit):
    assert unit_of(path) == unit


def test_timing_is_met_by_one_placement_or_not():
    assert missed([routed(1, sync=49.0), routed(2)], CLOCKS) == ""
    # One is too slow in one clock, the other in another.
    assert missed([routed(1, sync=49.0), routed(2, pixel=60.0)], CLOCKS) == \
        "timing is not met by 2 placements: chip reaches 49.0 of 50 MHz"


@pytest.mark.parametrize("mhz", [40.0, 52.0])
def test_build_writes_a_bitstream_only_if_it_is_fast_enough(mhz, tmp_path, monkeypatch):
    placed = []

    def route(board, design, *, seed, clocks):
        placed.append(seed)
        return routed(seed, sync=mhz - seed)

    monkeypatch.setattr(build_module, "synthesise", lambda design: None)
    monkeypatch.setattr(build_module, "route", route)
    monkeypatch.setattr(build_module, "pack_bitstream", lambda board, design, *, seed, **others: bytes([seed]))
    output = tmp_path / "out"
    result = run("build", BOARD.name, "--chip", "num_threads=2", "--seeds", 3, "-o", output)
    assert placed == [1, 2, 3]
    report = json.loads((output / "report.json").read_text())
    assert report["clocks"]["chip"]["worst_mhz"] == mhz - 3
    assert json.loads((output / "chip.json").read_text())["num_threads"] == 2
    bitstream = output / f"{BOARD.name}.bit"
    if mhz > 50:
        assert result.exit_code == 0, result.output
        assert bitstream.read_bytes() == b"\x01"
    else:
        assert result.exit_code == 1
        assert not bitstream.exists()
        assert result.stderr.endswith(
            "Error: icepi_zero: timing is not met by 3 placements: chip reaches 39.0 of 50 MHz; report.json has its "
            "slowest path. Ask for a slower --clock, or for more --seeds\n")


def test_a_clock_that_cannot_be(tmp_path):
    result = run("build", BOARD.name, "--clock", 160, "-o", tmp_path)
    assert result.exit_code == 2
    assert result.stderr.endswith("Error: --clock: the clock is 160 MHz; the SDRAM takes up to 133.3\n")


def test_a_scene_in_a_bitstream(tmp_path, monkeypatch):
    """Its memories are the image's, and its cameras go round."""
    config = replace(BOARD.config, num_threads=2)
    scene = built_in_scene("room", config, mode=BOARD.mode)
    compiled = CompiledScene(load_scene("room"), fmt=config.fmt, stack_depth=config.stack_depth,
                             index_width=config.index_width, flatten=True)
    image = compiled.image(load_scene("room"), eye=load_scene("room").default_camera().eye)
    assert {name: len(words) for name, words in scene.memories.items()} == {
        name: getattr(image, name).size for name in ("nodes", "lists", "matrices", "shading")}
    assert scene.memories["nodes"] == np.ravel(image.nodes).tolist()
    assert scene.root == image.root
    assert len(set(scene.cameras)) == len(scene.cameras) == 32
    design, clocks = board_design(BOARD, config=config, clock_mhz=50, scene=scene)
    assert "sdram" not in design.files["top.lpf"]
    assert "uart" not in design.files["top.lpf"]
    assert set(clocks) == {"sync", "pixel", "shift"}


@pytest.mark.parametrize(("arguments", "message"), [
    (("ulx3s_85f", "--scene", "room"), "Error: --scene: a chip with its scene in block RAM draws simple shading; use a "
                                       "--chip without a shader\n"),
    (("ulx3s_25f", "--scene", "room", "--docs", "docs"), "Error: --docs: the tables are of boards with host and SDRAM; "
                                                         "leave --scene or --docs out\n"),
])
def test_scenes_that_cannot_be_built_in(arguments, message, tmp_path):
    result = run("build", *arguments, "-o", tmp_path)
    assert result.exit_code == 2
    assert result.stderr.endswith(message)
