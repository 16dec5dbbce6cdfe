"""The command: what it writes, keeps and refuses."""

import json
import shutil
from pathlib import Path

import pytest
from click.testing import CliRunner
from PIL import Image

from sim.methods import METHODS
from sim.stability.cases import CASES
from tools.cli import main
from tools.stability_page import rates

DOCS = Path(__file__).parents[2] / "docs"


@pytest.fixture
def docs(tmp_path):
    (tmp_path / "results").mkdir()
    for name in ("accuracy.md", "results/fpu.json", "results/stability.json"):
        shutil.copy(DOCS / name, tmp_path / name)
    return tmp_path


def run(*arguments):
    return CliRunner().invoke(main, ["stability", *map(str, arguments)])


def test_one_case_is_measured_and_the_others_are_kept(docs):
    before = json.loads((docs / "results/stability.json").read_text())
    result = run("--docs", docs, "--only", "nested", "--rays", 64)
    assert result.exit_code == 0, result.output
    after = json.loads((docs / "results/stability.json").read_text())
    assert list(after["limits"]) == list(CASES)
    assert after["limits"]["edges"] == before["limits"]["edges"]
    new = [row for row in after["rows"] if row["case"] == "nested"]
    assert [row for row in after["rows"] if row["case"] != "nested"] == [
        row for row in before["rows"] if row["case"] != "nested"]
    assert len(new) == len(METHODS) * len(CASES["nested"].values)
    assert {row["rays"] for row in new} == {64}
    assert {row["parameter"] for row in new} == set(CASES["nested"].values)
    text = (docs / "accuracy.md").read_text()
    assert "| nested |" in text
    assert text.count("Not measured.") == 0
    for name in ("stability", "stability-sweeps"):
        with Image.open(docs / "pictures" / f"{name}.png") as picture:
            assert picture.width > 600
    assert not list(docs.rglob(".*"))


def test_committed_results_are_of_all_cases_and_methods():
    results = json.loads((DOCS / "results/stability.json").read_text())
    assert {row["case"] for row in results["rows"]} == set(CASES)
    assert {row["method"] for row in results["rows"]} == set(METHODS)
    for row in results["rows"]:
        kinds = [row[kind] for kind in ("cracks", "phantoms", "distances", "odd")]
        assert max(kinds) <= row["failures"] <= min(sum(kinds), row["rays"])
        assert row["decided"] <= row["rays"]
    found = rates(results)
    edges = found["edges"]
    assert edges["Woop 2013"] <= edges["default"] < edges["tolerant 2"] < edges["firm edges"]
    assert set(found["deep tree, chip"]) == {"default"}


def test_errors(docs):
    path = docs / "results/stability.json"
    kept = path.read_text()
    result = run("--docs", docs, "--only", "nested", "--format", "6.12")
    assert result.exit_code == 2
    assert (f"Error: {path}: has results of format 7.16, which cannot stand beside those of 6.12; leave out --only, or "
            "name another folder with --docs\n") in result.output
    result = run("--docs", docs, "--only", "slippery")
    assert result.exit_code == 2
    assert "'slippery' is not one of 'edges', 'vertices'" in result.output
    assert path.read_text() == kept
    path.write_text("{}")
    result = run("--docs", docs, "--only", "nested")
    assert result.exit_code == 2
    assert (f"Error: {path}: is not what this command writes; measure all cases anew, without --only\n"
            in result.output)
    (docs / "accuracy.md").write_text("# Accuracy\n")
    result = run("--docs", docs)
    assert result.exit_code == 2
    assert (f"Error: {docs / 'accuracy.md'}: must have the lines '<!-- begin: methods -->' and '<!-- end: methods -->' "
            "once, for the table between them\n") in result.output
    assert path.read_text() == "{}"
