"""Frames a second of a board: what is wanted of it, what is kept, and what is said when there is no clock."""

import json

import pytest
from click.testing import CliRunner

from boards.catalog import BOARDS
from tools import board_frames as module
from tools.board_frames import SCENES, textured, with_clock
from tools.cli import main

PAGE = "# Board\n\n<!-- begin: frames -->\n\nNot measured.\n\n<!-- end: frames -->\n"
ROW = {"real": True, "size": [512, 384], "cycles": 5_000_000, "cycles_per_ray": 25.4,
       "busy": {"traversal": 0.5, "transformation": 0.25, "intersection": 0.1},
       "hit": {"nodes": 0.9, "lists": 0.8, "matrices": 0.7}, "sdram_bytes_per_ray": 30.2, "sdram_busy": 0.4,
       "wrong_pixels_vs_model": 0}


@pytest.fixture
def docs(tmp_path):
    (tmp_path / "results").mkdir()
    (tmp_path / "board.md").write_text(PAGE)
    (tmp_path / "results" / "ulx3s_85f.json").write_text(
        json.dumps({"clocks": {"chip": {"worst_mhz": 60.0, "needed_mhz": 50.0}}}))
    return tmp_path


def test_what_is_wanted():
    """Quake3 of the paper: 33.6 frames a second at 90 MHz (Table 3)."""
    row = with_clock({"scene": "Quake3", "cycles": 5_000_000}, 60.0)
    assert row["fps"] == pytest.approx(12.0)
    assert row["wanted_fps"] == pytest.approx(0.8 * 33.6 * 60 / 90)


def test_only_textures_and_the_boards_own_caches():
    full = BOARDS["ulx3s_85f"].config
    config = textured(full)
    assert (config.num_threads, config.node_lines, config.num_shaders) == (full.num_threads, full.node_lines, 1)
    assert config.shader.textures
    assert not config.shader.shadows
    assert config.shader.depth == 0


def test_what_was_measured_of_this_chip_stays(monkeypatch, docs):
    asked = []

    def row(name, folder, config, clock_mhz, digest, progress):
        assert clock_mhz == 50.0
        asked.append(name)
        return {"scene": name, "digest": digest, **ROW}

    monkeypatch.setattr(module, "_row", row)
    for only in (["--only", "Quake3"], []):
        result = CliRunner().invoke(main, ["board-frames", "ulx3s_85f", "--docs", str(docs), *only])
        assert result.exit_code == 0, result.output
    assert asked == ["Quake3", "Scene6", "Conference"]
    results = json.loads((docs / "results" / "ulx3s_85f-frames.json").read_text())
    assert [each["scene"] for each in results["rows"]] == list(SCENES)
    assert "| Quake3 | 25.4 | 12.0 | 17.9 | 90 / 80 / 70 | 50 / 25 / 10 | 30 | 40 % | 0 |" in \
        (docs / "board.md").read_text()


def test_without_a_clock(docs):
    (docs / "results" / "ulx3s_85f.json").unlink()
    result = CliRunner().invoke(main, ["board-frames", "ulx3s_85f", "--docs", str(docs)])
    assert result.exit_code == 2
    path = docs / "results" / "ulx3s_85f.json"
    assert result.output == f"Error: {path}: is not there; run dynrt build ulx3s_85f --docs {docs} first\n"
