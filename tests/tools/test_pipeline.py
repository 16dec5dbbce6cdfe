"""The command that measures full shading, and its page."""

import json
import shutil
from pathlib import Path

import pytest
from click.testing import CliRunner

from tools.pipeline import pipeline
from tools.pipeline_page import filled

DOCS = Path(__file__).parents[2] / "docs"


@pytest.fixture
def docs(tmp_path):
    shutil.copy(DOCS / "pipeline.md", tmp_path)
    (tmp_path / "results").mkdir()
    shutil.copy(DOCS / "results" / "fpu.json", tmp_path / "results")
    return tmp_path


def test_one_part_keeps_the_others(docs):
    known = {"demos": [], "scaling": [], "other": 7}
    (docs / "results" / "pipeline.json").write_text(json.dumps(known))
    before = (docs / "pipeline.md").read_text()
    result = CliRunner().invoke(pipeline, ["--docs", str(docs), "--only", "operators"])
    assert result.exit_code == 0, result.output
    results = json.loads((docs / "results" / "pipeline.json").read_text())
    assert {name: results[name] for name in known} == known
    total = next(row for row in results["operators"]["table2"] if row["unit"] == "total")
    assert [total[column] for column in ("add", "mul", "div", "cmp")] == [16, 11, 5, 13]
    after = (docs / "pipeline.md").read_text()
    assert "| total | 16/11/5/13 | 16/11/5/13 |" in after
    # Prose stays.
    assert [line for line in before.splitlines() if line.startswith("#")] == [
        line for line in after.splitlines() if line.startswith("#")]


def test_a_page_without_a_place(docs):
    page = docs / "pipeline.md"
    page.write_text(page.read_text().replace("<!-- begin: caches -->", ""))
    result = CliRunner().invoke(pipeline, ["--docs", str(docs)])
    assert result.exit_code == 2
    assert (f"{page}: must have the lines '<!-- begin: caches -->' and '<!-- end: caches -->' once, for the table "
            "between them") in result.output
    assert not (docs / "results" / "pipeline.json").exists()
    assert not (docs / "pictures").exists()


def scaled(*, shaders, shadows, cycles):
    return {"threads": 64, "pipelines": 1, "shaders": shaders, "shadows": shadows, "cycles": cycles,
            "rays": 1500 if shadows else 1000, "shadow_rays": 500 if shadows else 0, "rtl_wrong_pixels": 0,
            "busy": {"traversal": 0.5, "transformation": 0.25, "shader": 1.0},
            "port_busy": {"nodes": 0.1, "matrices": 0.2}}


def test_what_a_shadow_ray_costs():
    rows = [scaled(shaders=1, shadows=True, cycles=32_000), scaled(shaders=1, shadows=False, cycles=20_000),
            scaled(shaders=2, shadows=True, cycles=32_000)]
    text = filled(DOCS / "pipeline.md", {"scaling": rows})
    # 20 cycles a ray without shadows, 12,000 more for 500 shadow rays.
    assert "| 1 | 20.00 | 24.00 | +20% |" in text
    assert ("| 64 | 1 | 1 | 1,500, 500 of them shadow rays | 32,000 | 21.33 | 0 | 50% | 25% | 100% | matrices: 20% |"
            in text)
