"""``dynrt render`` as a person types it: what it writes, and what it says when it cannot."""

import gzip
import json
import re
import signal
import subprocess
import sys
import time

import numpy as np
import pytest
from click.testing import CliRunner
from PIL import Image

from sim.golden import render_golden
from sim.scene import load_scene
from tests.sim.scene.quake_builder import bsp, pk3, small_map
from tools.animation import frame_durations
from tools.cli import main
from tools.errors import BadInput


def run(*arguments):
    return CliRunner().invoke(main, [str(argument) for argument in arguments])


def fails(tmp_path, *arguments, says, output=None):
    """The command ends with exit code 2 and this message, and leaves nothing behind."""
    output = output or tmp_path / "out" / "picture.png"
    output.parent.mkdir(exist_ok=True)
    before = sorted(tmp_path.rglob("*"))
    result = run("render", *arguments, "-o", output)
    assert result.exit_code == 2, result.output
    assert re.search(says, re.sub(r"\s+", " ", result.output)), result.output
    assert sorted(tmp_path.rglob("*")) == before


def test_golden_picture_hits_and_report(tmp_path):
    picture, hits, report = (tmp_path / name for name in ("room.png", "hits.npz", "report.json"))
    result = run("render", "room", "-o", picture, "--engine", "golden", "--size", "64x48", "--hits", hits, "--report",
                 report)
    assert result.exit_code == 0, result.output
    scene = load_scene("room")
    golden = render_golden(scene, scene.default_camera(), 64, 48)
    assert (np.asarray(Image.open(picture)) == golden.color).all()
    stored = np.load(hits)
    assert {name: (stored[name].dtype, stored[name].shape) for name in stored} == {
        "instance_id": (np.int32, (48, 64)), "prim_id": (np.int32, (48, 64)), "t": (np.float64, (48, 64)),
        "u": (np.float64, (48, 64)), "v": (np.float64, (48, 64))}
    assert (stored["prim_id"] == golden.prim_id).all()
    described = json.loads(report.read_text())
    assert described["engine"] == "golden"
    assert described["size"] == [64, 48]
    assert sorted(tmp_path.iterdir()) == sorted([picture, hits, report])


def test_model_reports_how_far_it_is_from_golden(tmp_path):
    report = tmp_path / "report.json"
    result = run("render", "room", "-o", tmp_path / "room.png", "--engine", "model", "--size", "64x48", "--format",
                 "8.23", "--report", report)
    assert result.exit_code == 0, result.output
    described = json.loads(report.read_text())
    assert described["wrong_pixels_vs_golden"] <= 3
    assert described["psnr_vs_golden"] > 45
    assert described["format"] == "8.23"


@pytest.mark.chip
@pytest.mark.xdist_group("chip")
def test_rtl_report_has_what_tools_rely_on(tmp_path):
    report = tmp_path / "report.json"
    result = run("render", "room", "-o", tmp_path / "room.png", "--size", "32x24", "--report", report)
    assert result.exit_code == 0, result.output
    described = json.loads(report.read_text())
    assert {"engine", "scene", "size", "format", "config", "cycles", "rays", "cycles_per_ray", "busy", "cache", "bytes",
            "wrong_pixels_vs_model", "wrong_pixels_vs_golden", "psnr_vs_golden", "simulated_hz"} <= described.keys()
    assert described["wrong_pixels_vs_model"] == 0
    assert "0 pixels differ from the model" in result.output


def test_full_shading(tmp_path):
    report = tmp_path / "report.json"
    result = run("render", "mirror-room", "-o", tmp_path / "room.png", "--engine", "golden", "--shading", "full",
                 "--size", "64x48", "--depth", "2", "--report", report)
    assert result.exit_code == 0, result.output
    scene = load_scene("mirror-room")
    golden = render_golden(scene, scene.default_camera(), 64, 48, shading="full", depth=2)
    assert (np.asarray(Image.open(tmp_path / "room.png")) == golden.color).all()
    described = json.loads(report.read_text())
    levels = described["levels"]
    assert described["rays"] == sum(level["rays"] + level["shadow"] for level in levels)
    assert len(levels) == 3
    assert levels[0]["rays"] == 64 * 48
    assert levels[1]["rays"] == sum(levels[0][kind] for kind in ("reflection", "refraction", "transparency")) > 0


def test_full_shading_by_the_model(tmp_path):
    report = tmp_path / "report.json"
    result = run("render", "walk", "-o", tmp_path / "walk.png", "--engine", "model", "--shading", "full", "--size",
                 "64x48", "--depth", "2", "--frames", "2", "--report", report)
    assert result.exit_code == 0, result.output
    assert "PSNR" in result.output
    for frame in json.loads(report.read_text()):
        assert frame["psnr_vs_golden"] >= 45
        assert frame["wrong_pixels_vs_golden"] <= 0.002 * 64 * 48
        assert frame["ray_kinds"]["primary"] == 64 * 48
        assert frame["memory"]["records"] > 0


def test_a_panorama_as_the_sky(tmp_path):
    panorama = np.zeros((64, 128, 3), np.uint8)
    panorama[:] = (10, 90, 200)
    Image.fromarray(panorama).save(tmp_path / "sky.png")
    result = run("render", obj(tmp_path, TRIANGLE), "-o", tmp_path / "x.png", "--engine", "golden", "--shading", "full",
                 "--size", "8x8", "--sky", tmp_path / "sky.png", "--camera", "0,0,5,0,0,9,0,1,0,60")
    assert result.exit_code == 0, result.output
    assert (np.asarray(Image.open(tmp_path / "x.png")) == (10, 90, 200)).all()


def frames_of(path):
    """Pictures of an animation uint8[N, H, W, 3], and the milliseconds that each is shown."""
    with Image.open(path) as file:
        colors, durations = [], []
        for number in range(file.n_frames):
            file.seek(number)
            colors.append(np.asarray(file.convert("RGB")))
            durations.append(file.info["duration"])
        assert file.info["loop"] == 0
    return np.array(colors), durations


def test_frames_of_the_walk(tmp_path):
    result = run("render", "walk", "-o", tmp_path / "w.png", "--engine", "golden", "--shading", "full", "--depth", "1",
                 "--size", "32x24", "--frames", "3", "--report", tmp_path / "w.json")
    assert result.exit_code == 0, result.output
    assert sorted(path.name for path in tmp_path.iterdir()) == ["w-0000.png", "w-0001.png", "w-0002.png", "w.json",
                                                                "w.png"]
    pictures = [np.asarray(Image.open(tmp_path / f"w-000{k}.png")) for k in range(3)]
    assert (pictures[0] != pictures[1]).mean() > 0.5
    colors, durations = frames_of(tmp_path / "w.png")
    assert (colors == pictures).all()
    assert durations == [2667, 2666, 2667]
    assert [report["time"] for report in json.loads((tmp_path / "w.json").read_text())] == [0, 8 / 3, 16 / 3]


def test_frames_as_a_gif(tmp_path):
    result = run("render", "walk", "-o", tmp_path / "w.gif", "--engine", "model", "--size", "64x48", "--frames", "3",
                 "--no-check")
    assert result.exit_code == 0, result.output
    assert sorted(path.name for path in tmp_path.iterdir()) == ["w-0000.png", "w-0001.png", "w-0002.png", "w.gif"]
    with Image.open(tmp_path / "w.gif") as file:
        assert file.format == "GIF"
    colors, durations = frames_of(tmp_path / "w.gif")
    assert durations == [2670, 2660, 2670]
    for number, color in enumerate(colors):
        picture = np.asarray(Image.open(tmp_path / f"w-000{number}.png")).astype(int)
        # 256 colours a picture.
        assert np.abs(picture - color).mean() < 6


@pytest.mark.chip
@pytest.mark.xdist_group("chip")
def test_frames_by_one_chip(tmp_path):
    result = run("render", "walk", "-o", tmp_path / "w.png", "--size", "32x24", "--frames", "3", "--report",
                 tmp_path / "w.json")
    assert result.exit_code == 0, result.output
    first, *others = json.loads((tmp_path / "w.json").read_text())
    assert first["upload"]["bytes"] == first["memory"]["bytes"]
    assert len(others) == 2
    for before, report in zip([first, *others], others, strict=False):
        assert report["wrong_pixels_vs_model"] == 0
        assert report["psnr_vs_golden"] > 40
        assert report["upload"]["bytes_per_cycle"] * before["cycles"] == pytest.approx(report["upload"]["bytes"])
        assert f"{report['upload']['bytes']:,} bytes uploaded, " in result.output
    # One after the other by the same chip as alone, and by the model.
    result = run("render", "walk", "-o", tmp_path / "m.png", "--engine", "model", "--size", "32x24", "--frames", "3",
                 "--no-check")
    assert result.exit_code == 0, result.output
    assert (frames_of(tmp_path / "w.png")[0] == frames_of(tmp_path / "m.png")[0]).all()


def test_an_animation_that_fails_leaves_nothing(tmp_path, monkeypatch):
    def interrupted(path, colors, durations):
        path.write_bytes(b"half")
        raise KeyboardInterrupt

    monkeypatch.setattr("tools.render.save_animation", interrupted)
    result = run("render", "walk", "-o", tmp_path / "w.png", "--engine", "golden", "--size", "8x6", "--frames", "2",
                 "--report", tmp_path / "w.json")
    assert result.exit_code not in (0, None)
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(("name", "arguments", "says"), [
    ("x.gif", [], r"-o: x\.gif would be an animation; give --frames, or a name that ends in \.png"),
    ("x.jpg", [], r"-o: x\.jpg must end in \.png(?!, or)"),
    ("x", ["--frames", "2"], r"-o: x must end in \.png, or \.gif"),
    ("x.gif", ["--frames", "500"], r"--frames: 500 pictures in 8 s are more than the 50 a second that viewers of GIFs "
     r"show; ask for fewer, or for a \.png"),
    ("x.png", ["--frames", "1", "--wave", "x.vcd", "--engine", "rtl"], r"--wave shows one picture; leave --frames out"),
    ("x.png", ["--frames", "2", "--flatten"], r"instance 'weapon' moves, but the scene is flat: all triangles lie in "
     r"one space; compile it with flatten=False \(dynrt: --instances\)"),
])
def test_bad_animations(tmp_path, name, arguments, says):
    fails(tmp_path, "walk", "--engine", "model", "--size", "8x8", *arguments, says=says,
          output=tmp_path / "out" / name)


def test_durations():
    assert frame_durations(3, 1.0, is_gif=False) == [333, 334, 333]
    assert frame_durations(3, 1.0, is_gif=True) == [330, 340, 330]
    assert sum(frame_durations(399, 8.0, is_gif=True)) == 8000
    with pytest.raises(BadInput, match="401 pictures in 8 s"):
        frame_durations(401, 8.0, is_gif=True)


def obj(tmp_path, text, name="scene.obj"):
    path = tmp_path / name
    path.write_text(text)
    return path


TRIANGLE = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n"


@pytest.mark.parametrize(("text", "says"), [
    ("v 0 0 0\nv 1 0 0\nf 1 2 9\n", r"scene\.obj:3: .*9"),
    ("v 0 0 zero\n", r"scene\.obj:1: 'zero' is not a number"),
    ("", r"scene\.obj: .*(empty|no )"),
    ("v 0 0 0\nv 1 0 0\nv 2 0 0\nf 1 2 3\n", r"scene is empty: no instance has a usable triangle"),
    ("v 0 0 0\nv nan 0 0\nv 0 1 0\nf 1 2 3\n", r"(not finite|non-finite|empty)"),
])
def test_bad_obj(tmp_path, text, says):
    fails(tmp_path, obj(tmp_path, text), says=says)


def test_missing_file(tmp_path):
    fails(tmp_path, tmp_path / "none.obj", says=r"none\.obj: No such file or directory")


def test_archives_of_a_game(tmp_path):
    path = tmp_path / "a.pk3"
    path.write_bytes(b"no zip")
    fails(tmp_path, path, says=r"a\.pk3: not a \.pk3 \(zip\) file: File is not a zip file")
    path.write_bytes(pk3({"maps/one.bsp": bsp(**small_map()), "maps/two.bsp": b""}))
    fails(tmp_path, path, says=r"a\.pk3: has the maps one, two; name one, as in \S+a\.pk3:one")
    fails(tmp_path, f"{path}:two", says=r"a\.pk3: maps/two\.bsp: not a map of Quake III \(IBSP, version 46\)")
    result = run("render", f"{path}:one", "--engine", "golden", "--size", "16x12", "-o", tmp_path / "one.png")
    assert result.exit_code == 0, result.output


def test_unknown_format(tmp_path):
    fails(tmp_path, obj(tmp_path, "", "scene.stl"),
          says=r"scene\.stl: unknown scene format; supported are \.obj, \.ply, \.ply\.gz, \.gltf, \.glb, \.md3, "
              r"\.pk3 and the built-in scenes room, mirror-room, vpl, walk, sunflowers")


def gltf(tmp_path, *, uri="data.bin", matrix=None, byte_length=36, data=None):
    corners = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0]], "<f4").tobytes() if data is None else data
    (tmp_path / "data.bin").write_bytes(corners)
    node = {"mesh": 0, "name": "flat", **({"matrix": matrix} if matrix else {})}
    path = tmp_path / "scene.gltf"
    path.write_text(json.dumps({
        "asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0]}], "nodes": [node],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}}]}],
        "accessors": [{"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3"}],
        "bufferViews": [{"buffer": 0, "byteLength": 36}], "buffers": [{"uri": uri, "byteLength": byte_length}]}))
    return path


@pytest.mark.parametrize("uri", ["../secret.bin", "/etc/passwd", "a/../../secret.bin", "file:///etc/passwd"])
def test_uri_that_leads_out_of_the_folder(tmp_path, uri):
    folder = tmp_path / "scene"
    folder.mkdir()
    (tmp_path / "secret.bin").write_bytes(bytes(36))
    fails(tmp_path, gltf(folder, uri=uri), says=re.escape(uri))


def test_buffer_shorter_than_it_claims(tmp_path):
    fails(tmp_path, gltf(tmp_path, data=bytes(20)), says=r"scene\.gltf: .*buffer.*20.*36|scene\.gltf: .*36.*20")


def test_singular_instance(tmp_path):
    matrix = [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 0, 0, 0, 0, 0, 1]
    fails(tmp_path, gltf(tmp_path, matrix=matrix),
          says=r"node 'flat' \(instance 0\): transform is singular \(flattens the mesh\); give it a non-zero scale on "
               "every axis")


@pytest.mark.parametrize(("arguments", "says"), [
    (["--camera", "0,0,0,0,0,0,0,0,1,60"], r"camera: zero direction: look-at point equals eye \(0\.0, 0\.0, 0\.0\)"),
    (["--camera", "0,0,0,1,0,0"], r"6 numbers instead of ten"),
    (["--camera", "0,0,0,1,0,0,0,0,1,180"], r"horizontal field of view must be within \(0, 180\) degrees, not 180"),
    (["--camera", "0,0,0,1,0,0,2,0,0,60"], r"up vector \(2\.0, 0\.0, 0\.0\) is parallel to the view direction"),
    (["--camera", "0,0,nan,1,0,0,0,0,1,60"], r"eye must be three finite numbers"),
    (["--size", "512"], r"'512' is not WIDTHxHEIGHT with both from 1 to 4095, like 512x384"),
    (["--size", "0x384"], r"'0x384' is not WIDTHxHEIGHT"),
    (["--size", "300x200", "--chip", "coord_width=8"], r"--size: 300x200 is too large for a chip with coord_width = 8, "
     r"which draws up to 255 pixels a side"),
    (["--memory", "sdram", "--engine", "model"], r"--memory sdram works with --engine rtl only, not model"),
    (["--memory", "sdram", "--jitter", "3"], r"--memory sdram: leave --frames, --wave and --jitter out"),
    (["--memory", "sdram", "--size", "1025x8"], r"--size: 1025x8 is too large for --memory sdram, which keeps pictures "
     r"of up to 1024 pixels a side"),
    (["--format", "7-16"], r"Float format must be written EXPONENT\.FRACTION in bits, like 7\.16, not '7-16'"),
    (["--format", "9.16"], r"Exponent width must be between 2 and 8 bits, not 9"),
    (["--chip", "threads=3"], r"'threads' is not a parameter of the chip; there are .*num_threads"),
    (["--chip", "num_threads=65"], r"--chip: num_threads is 65; it must be from 1 to 64"),
    (["--chip", "node_lines=100"], r"--chip: node_lines is 100; it must be a power of two"),
    (["--engine", "model", "--wave", "x.vcd"], r"--wave: the engine model has no clock; use --engine rtl or pysim"),
    (["--wave", "x.png"], r"--wave: x\.png must end in \.vcd or \.fst with --engine rtl"),
    (["--wave-pixel", "3,3"], r"--wave-cycles and --wave-pixel need --wave FILE"),
    (["--wave", "x.vcd", "--wave-pixel", "600,3"], r"--wave-pixel: 600,3 is outside of the picture of 512x384"),
    (["--view", "3"], r"--view: there is no camera 3, the scene has"),
    (["--frames", "4"], r"nothing moves in this scene; leave --frames out"),
    (["--shading", "full", "--hits", "h.npz"], r"--hits: a chip with full shading keeps no hits; use --engine model, "
     r"or --shading simple with --engine rtl"),
    (["--shading", "full", "--engine", "pysim", "--hits", "h.npz"], r"--shading simple with --engine pysim"),
    (["--shading", "phong"], r"'phong' is not one of 'simple', 'full'"),
    (["--depth", "2"], r"--depth is of full shading; use --shading full"),
    (["--depth", "17", "--shading", "full", "--engine", "golden"], r"17 is not in the range 0<=x<=16"),
    (["--sky", "none.png"], r"--sky is of full shading; use --shading full"),
    (["--sky", "none.png", "--shading", "full", "--engine", "golden"], r"--sky: none\.png: No such file or directory"),
    (["--sky", __file__, "--shading", "full", "--engine", "golden"], r"texture '.*': cannot be read: not a picture of "
     "a known format"),
    (["--hits", "no/such/folder/h.npz"], r"no/such/folder/h\.npz: there is no folder no/such/folder"),
    (["--chip", "index_width=8"], r"scene needs [\d,]+ kd-tree nodes, more than the 256 that the chip's memory "
     "addresses; leave objects out or build a chip with a wider index_width"),
])
def test_bad_options(tmp_path, arguments, says):
    fails(tmp_path, "room", *arguments, says=says)


def test_a_format_too_narrow_for_the_scene(tmp_path):
    thin = "v 0 0 0\nv 1 0 0\nv 0 0.001 0\nv 1 1 1\nf 1 2 3\nf 1 2 4\n"
    fails(tmp_path, obj(tmp_path, thin), "--format", "4.10",
          says=r"mesh '.*', triangle 0: its transform has values up to [\d.e+]+, beyond 256, the largest of format "
               r"4\.10; choose a format with more exponent bits \(1 such triangles\)")


def test_a_folder_that_is_not_there(tmp_path):
    result = run("render", "room", "-o", tmp_path / "none" / "x.png")
    assert result.exit_code == 2
    assert "there is no folder" in result.output


def test_warnings_name_dropped_triangles(tmp_path):
    scene = obj(tmp_path, TRIANGLE + "f 1 1 2\nf 2 2 2\n")
    result = run("render", scene, "-o", tmp_path / "x.png", "--engine", "golden", "--size", "8x8")
    assert result.exit_code == 0
    assert "2 degenerate triangles dropped" in result.output


def test_what_is_beyond_the_arithmetic_is_named_once(tmp_path):
    blade = ("o blade\nv 0 0 0\nv 1 0 0\nv 0 0.00006 0\nf -3 -2 -1\n"
             "o floor\nv -1 -1 -1\nv 1 -1 -1\nv 1 1 -1\nf -3 -2 -1\n")
    for shading in ("simple", "full"):
        result = run("render", obj(tmp_path, blade), "-o", tmp_path / "x.png", "--engine", "model", "--size", "8x8",
                     "--shading", shading)
        assert result.exit_code == 0
        said = re.sub(r"\s+", " ", result.output)
        assert said.count("warning: mesh 'blade': triangles up to 16,667 times as long as wide, beyond the 10,000 that "
                          "format 7.16 is good for; use --format 7.17, or split them into shorter ones") == 1
    result = run("render", obj(tmp_path, blade), "-o", tmp_path / "x.png", "--engine", "model", "--size", "8x8",
                 "--format", "7.17")
    assert "warning" not in result.output


def test_compressed_ply(tmp_path):
    text = ("ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n"
            "element face 1\nproperty list uchar int vertex_indices\nend_header\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n")
    scene = tmp_path / "t.ply.gz"
    scene.write_bytes(gzip.compress(text.encode()))
    hits = tmp_path / "h.npz"
    result = run("render", scene, "-o", tmp_path / "t.png", "--engine", "model", "--size", "8x8", "--camera",
                 "0.2,0.2,3,0.2,0.2,0,0,1,0,20", "--hits", hits)
    assert result.exit_code == 0, result.output
    assert (np.load(hits)["prim_id"] == 0).any()


@pytest.mark.chip
@pytest.mark.xdist_group("chip")
def test_ctrl_c_leaves_nothing(tmp_path):
    # More than a minute's work, compiling the chip not counted.
    process = subprocess.Popen(
        [sys.executable, "-m", "tools", "render", "room", "-o", str(tmp_path / "x.png"), "--size", "1600x1200",
         "--report", str(tmp_path / "x.json"), "--no-check"], stderr=subprocess.PIPE, stdin=subprocess.DEVNULL)
    time.sleep(8)
    process.send_signal(signal.SIGINT)
    process.communicate(timeout=60)
    assert process.returncode not in (0, None)
    assert list(tmp_path.iterdir()) == []


def test_image_prints_the_memories():
    result = run("image", "room", "--limit", "3")
    assert result.exit_code == 0
    assert re.search(r"^nodes: \d+$", result.output, re.MULTILINE)
    assert re.search(r"^ +0  [xyz] \S+ +children 2, 3", result.output, re.MULTILINE)
    assert re.search(r"^matrices: 806$", result.output, re.MULTILINE)


def test_frames_of_a_moving_scene(tmp_path):
    corners = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0]], "<f4").tobytes()
    keys = np.array([0, 2], "<f4").tobytes() + np.array([[0, 0, 0], [4, 0, 0]], "<f4").tobytes()
    (tmp_path / "data.bin").write_bytes(corners + keys)
    scene = tmp_path / "moving.gltf"
    scene.write_text(json.dumps({
        "asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0]}], "nodes": [{"mesh": 0, "name": "mover"}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}}]}],
        "accessors": [
            {"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3"},
            {"bufferView": 1, "componentType": 5126, "count": 2, "type": "SCALAR", "min": [0], "max": [2]},
            {"bufferView": 2, "componentType": 5126, "count": 2, "type": "VEC3"}],
        "bufferViews": [{"buffer": 0, "byteLength": 36}, {"buffer": 0, "byteOffset": 36, "byteLength": 8},
                        {"buffer": 0, "byteOffset": 44, "byteLength": 24}],
        "buffers": [{"uri": "data.bin", "byteLength": 68}],
        "animations": [{"channels": [{"sampler": 0, "target": {"node": 0, "path": "translation"}}],
                        "samplers": [{"input": 1, "output": 2, "interpolation": "LINEAR"}]}]}))
    result = run("render", scene, "-o", tmp_path / "m.png", "--engine", "model", "--size", "40x30", "--frames", "2",
                 "--camera", "2,0.5,6,2,0.5,0,0,1,0,60", "--report", tmp_path / "m.json")
    assert result.exit_code == 0, result.output
    reports = json.loads((tmp_path / "m.json").read_text())
    assert [report["wrong_pixels_vs_golden"] for report in reports] == [0, 0]
    # The triangle is at x = 0…1 first and at x = 2…3 after half of the two seconds; the camera looks at x = 2.
    columns = [np.flatnonzero(np.asarray(Image.open(tmp_path / f"m-{number:04d}.png")).any(axis=(0, 2)))
               for number in (0, 1)]
    assert columns[0].max() < 20 <= columns[1].min() + 1
