"""What the chart says of a scene whose faults are known, and its page."""

import json
import shutil
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

from fpu import FloatFormat
from sim.frame import Frame
from sim.golden import render_golden
from sim.scene import Camera, Material
from tests.sim.golden.rooms import quad, scene_of
from tools import chart_truth
from tools.chart import VARIANTS, chart
from tools.chart_page import filled
from tools.chart_truth import Truth

DOCS = Path(__file__).parents[2] / "docs"
SIZE = 16, 12
FORMAT = FloatFormat(7, 16)


@pytest.fixture(scope="module")
def truth():
    """A square before a wall, its upright edge 0.01 pixels from the samples of column 8."""
    edge = 2 * (8.5 + 0.01) / SIZE[0] - 1
    scene = scene_of(quad([(edge, -2, 0), (2, -2, 0), (2, 2, 0), (edge, 2, 0)], Material("near", (1.0, 0.2, 0.2))),
                     quad([(-9, -9, -2), (9, -9, -2), (9, 9, -2), (-9, 9, -2)], Material("wall", (0.2, 0.2, 1.0))))
    return Truth(scene, Camera((0, 0, 1), (0, 0, 0), (0, 1, 0), 90.0), SIZE)


def changed(frame, column, *, instance, t):
    """A picture in which row 3 shows something else in one column."""
    same = {name: getattr(frame, name).copy() for name in ("instance_id", "prim_id", "t", "u", "v", "color")}
    other = Frame(**same, report={"counts": {"steps": 384, "triangle_tests": 192}})
    other.instance_id[3, column] = instance
    other.prim_id[3, column] = frame.prim_id[3, 12] if instance == 0 else min(instance, 0)
    other.t[3, column] = t
    return other


@pytest.mark.parametrize(("column", "instance", "t", "wrong", "cracks", "phantoms"), [
    (12, 0, 1.0, 0, 0, 0),
    # The wall is seen through the square, or nothing at all.
    (12, 1, 3.0, 1, 1, 0), (12, -1, np.inf, 1, 1, 0),
    # The square is seen where the wall is; one is seen in front of both.
    (4, 0, 1.0, 1, 0, 1), (12, 1, 0.5, 1, 0, 1),
    # Beside the edge, where golden has both within the reach; nothing is still nothing.
    (8, 0, 1.0, 1, 0, 0), (8, -1, np.inf, 1, 1, 0),
])
def test_faults(truth, monkeypatch, column, instance, t, wrong, cracks, phantoms):
    frame = changed(truth.golden, column, instance=instance, t=t)
    monkeypatch.setattr(chart_truth, "render_full", lambda *args, **options: frame)
    found = truth.measure(FORMAT, {"separate": {}})["separate"]
    assert found["wrong_percent"] == round(100 * wrong / 192, 4)
    assert (found["cracks"], found["phantoms"]) == (cracks, phantoms)
    assert (found["steps_per_pixel"], found["triangle_tests_per_pixel"]) == (2.0, 1.0)


def test_error_of_t(truth, monkeypatch):
    frame = changed(truth.golden, 12, instance=0, t=1.0)
    frame.t *= 1 + 2.0 ** -12
    frame.t[5, 12] = 1 + 2.0 ** -11
    monkeypatch.setattr(chart_truth, "render_full", lambda *args, **options: frame)
    found = truth.measure(FORMAT, {"separate": {}})["separate"]
    assert found["t_err_median"] == pytest.approx(2.0 ** -12, rel=1e-2)
    assert found["t_err_max"] == pytest.approx(2.0 ** -11, rel=1e-2)


def test_the_model_itself(truth):
    variants = {"separate": {"edge_tolerance": 0}, "fused": {"arithmetic": 1, "edge_tolerance": 0},
                "tolerant": {"edge_tolerance": 2}}
    found = truth.measure(FloatFormat(8, 23), variants)
    for figures in found.values():
        assert (figures["wrong_percent"], figures["cracks"], figures["phantoms"]) == (0, 0, 0)
        assert figures["psnr"] > 45
        assert figures["t_err_max"] < 1e-5


def test_a_scene_that_does_not_fit():
    tiny = quad([(0, 0, 0), (1e-7, 0, 0), (1e-7, 1, 0), (0, 1, 0)], Material("thin", (1.0, 1.0, 1.0)))
    scene = scene_of(tiny)
    found = Truth(scene, scene.default_camera(), (4, 3)).measure(FloatFormat(5, 10), {"separate": {}})
    message = ("nothing is left of the scene: no triangle has an area once its vertices are rounded to format 5.10; "
               "choose a format with more bits")
    assert found == {"separate": {"error": message}}


@pytest.fixture
def folder(tmp_path):
    docs, scenes = tmp_path / "docs", tmp_path / "scenes"
    docs.mkdir()
    scenes.mkdir()
    shutil.copy(DOCS / "accuracy.md", docs)
    (scenes / "cameras.json").write_text("{}")
    return docs, scenes


def test_the_command_goes_on_where_it_stopped(folder, monkeypatch):
    monkeypatch.setattr("tools.chart.SIZE", (12, 9))
    docs, scenes = folder
    command = ["--scenes", str(scenes), "--docs", str(docs), "--only", "room"]
    for fmt in ("7.12", "7.16"):
        result = CliRunner().invoke(chart, [*command, "--format", fmt])
        assert result.exit_code == 0, result.output
    path = docs / "results" / "accuracy.json"
    rows = json.loads(path.read_text())["rows"]
    assert [(row["format"], row["variant"]) for row in rows] == [
        (fmt, variant) for fmt in ("7.12", "7.16") for variant in VARIANTS]
    assert len(path.with_suffix(".csv").read_text().splitlines()) == 1 + 2 * len(VARIANTS)
    assert (docs / "pictures" / "chart-formats.png").stat().st_size > 10_000
    assert "| 7.16 |" in (docs / "accuracy.md").read_text()
    monkeypatch.setattr("tools.chart.Truth", lambda *args: pytest.fail("measured again"))
    assert CliRunner().invoke(chart, [*command, "--format", "7.12", "--format", "7.16"]).exit_code == 0
    assert json.loads(path.read_text())["rows"] == rows


def test_a_scene_that_is_missing(folder):
    docs, scenes = folder
    (scenes / "cameras.json").write_text(json.dumps({"bunny": [{}]}))
    result = CliRunner().invoke(chart, ["--scenes", str(scenes), "--docs", str(docs), "--only", "bunny"])
    assert result.exit_code == 2
    assert f"{scenes / 'classic' / 'stanford-bunny.obj'}: No such file or directory" in result.output


def test_cells_of_the_page():
    row = {"scene": "room", "variant": "separate"}
    rows = [{**row, "format": "5.8", "error": "too narrow"},
            {**row, "format": "7.16", "wrong_percent": 0.0123, "cracks": 4, "phantoms": 5, "psnr": 43.21}]
    text = filled(DOCS / "accuracy.md", rows)
    assert "| 5.8 | does not fit |\n| 7.16 | 0.012, 4, 5, 43.2 |" in text


def test_golden_and_itself(truth):
    picture = render_golden(*(getattr(truth, name) for name in ("_scene", "_camera")), *SIZE, shading="full")
    assert (picture.color == truth.golden.color).all()
