"""``dynrt cracks`` on a small mesh: its rows, its page, and that it goes on where it was stopped."""

import json

import pytest
from click.testing import CliRunner

import tools.cracks
from tools.cli import main
from tools.cracks import MESHES

SQUARE = "v 0 0 0\nv 1 0 0.1\nv 1 1 0\nv 0 1 0.1\nf 1 2 3\nf 1 3 4\n"
PAGE = "<!-- begin: cracks -->\n<!-- end: cracks -->\n"


@pytest.fixture
def folders(tmp_path):
    scenes, docs = tmp_path / "scenes", tmp_path / "docs"
    (scenes / "classic").mkdir(parents=True)
    docs.mkdir()
    (scenes / MESHES["bunny"]).write_text(SQUARE)
    (docs / "accuracy.md").write_text(PAGE)
    return scenes, docs


def run(scenes, docs, *options):
    return CliRunner().invoke(main, ["cracks", "--scenes", str(scenes), "--docs", str(docs), "--only", "bunny",
                                     *options])


def test_rows_and_page(folders, monkeypatch):
    scenes, docs = folders
    result = run(scenes, docs, "--rays", "18000")
    assert result.exit_code == 0, result.output
    rows = json.loads((docs / "results/cracks.json").read_text())["rows"]
    assert [(row["mesh"], row["kind"]) for row in rows] == [("bunny", kind) for kind in tools.cracks.KINDS]
    edges, vertices, _ = rows
    assert (edges["triangles"], edges["edges"]) == (2, 1)
    assert edges["rays"] >= 1000
    # Each of its vertices is at a loose edge.
    assert vertices["rays"] == 0
    assert f"| bunny | 2 | 1 | edges | {edges['rays']:,} | 0 |" in (docs / "accuracy.md").read_text()

    # The same again is known; other rays are not.
    monkeypatch.setattr(tools.cracks, "_count", lambda *_: pytest.fail("measured again"))
    assert run(scenes, docs, "--rays", "18000").exit_code == 0
    with pytest.raises(pytest.fail.Exception):
        CliRunner().invoke(main, ["cracks", "--scenes", str(scenes), "--docs", str(docs), "--only", "bunny", "--rays",
                                  "36000"], catch_exceptions=False)


def test_what_cannot_be_measured(folders):
    scenes, docs = folders
    assert run(scenes, docs, "--rays", "1800").exit_code == 0
    kept = (docs / "results/cracks.json").read_text()
    result = run(scenes, docs, "--rays", "1800", "--format", "7.18")
    assert result.exit_code == 2
    assert ("has results of format 7.16, which cannot stand beside those of 7.18; leave out --only, or name another "
            "folder with --docs") in " ".join(result.output.split())
    (scenes / MESHES["bunny"]).write_text("\n".join(SQUARE.splitlines()[:-1]) + "\n")
    result = run(scenes, docs, "--rays", "3600")
    assert result.exit_code == 2
    assert "no two triangles share an edge, so there is nothing to aim at" in " ".join(result.output.split())
    assert (docs / "results/cracks.json").read_text() == kept


def test_a_scene_that_is_not_there(folders):
    scenes, docs = folders
    (scenes / MESHES["bunny"]).unlink()
    result = run(scenes, docs)
    assert result.exit_code == 2
    assert "stanford-bunny.obj" in result.output
    assert not (docs / "results").exists()
