"""The command that measures the paper's tables, with the model in the chip's place."""

import csv
import json
import shutil
from dataclasses import replace
from pathlib import Path

import distributed
import numpy as np
import pytest
from click.testing import CliRunner

from rtl.config import ChipConfig
from sim.model import render_full, render_model
from sim.scene.table3 import TABLE3
from tools import bench as bench_module
from tools import bench_measure, bench_sweeps
from tools.bench import bench
from tools.bench_measure import BenchJob, measure, plainly_lit

DOCS = Path(__file__).parents[2] / "docs"
CYCLES = {"paper": 7680, "ulx3s_85f": 3840}


@pytest.fixture
def docs(tmp_path):
    shutil.copy(DOCS / "benchmarks.md", tmp_path)
    (tmp_path / "results").mkdir()
    (tmp_path / "results" / "pipeline.json").write_text(json.dumps({"clock": [
        {"chip": "simple", "grade": 6, "seed": 1, "fmax_mhz": 48.0},
        {"chip": "simple", "grade": 8, "seed": 1, "fmax_mhz": 20.0}]}))
    return tmp_path


@pytest.fixture
def drawn(monkeypatch):
    """The pictures that the chip was asked for; the model draws them."""
    asked = []

    def render_rtl(image, camera, width, height, *, config, latency):
        asked.append((width, height, latency))
        frame = (render_model if config.shader is None else render_full)(image, camera, width, height, config=config)
        caches = {name: {"hits": 3, "misses": 1} for name in ("nodes", "lists", "matrices")}
        cycles = CYCLES["ulx3s_85f" if config.num_pipelines == 2 else "paper"]
        ports = {"nodes": 2, "lists": 1, "matrices": 3, "shading": 4}
        frame.report |= {
            "cycles": cycles, "cycles_per_ray": cycles / (width * height),
            "busy": dict.fromkeys(("traversal", "list", "transformation", "intersection"), 0.5), "cache": caches,
            "bytes": {name: number * width * height for name, number in ports.items()}, "simulated_hz": 1e5}
        return frame

    monkeypatch.setattr(bench_measure, "render_rtl", render_rtl)
    monkeypatch.setattr(bench_measure, "_compile_once", lambda config: None)
    return asked


def run(docs, *arguments):
    return CliRunner().invoke(bench, ["--docs", str(docs), "--jobs", "1", *arguments])


def results_of(docs):
    return json.loads((docs / "results" / "bench.json").read_text())


def test_a_scene(docs, drawn):
    result = run(docs, "--only", "Scene6", "--size", "32x24", "--part", "simple", "--part", "embree")
    assert result.exit_code == 0, result.output
    assert "Scene6, paper, 32x24, simple: 10.00 cycles a ray, 0 wrong pixels" in result.output
    assert drawn == [(32, 24, 4), (32, 24, 20)]
    results = results_of(docs)
    paper, board = results["rows"]
    assert (paper["chip"], paper["real"], paper["triangles"], paper["objects"]) == ("paper", False, 806, 1)
    assert (board["chip"], board["cycles_per_ray"], board["pipelines"]) == ("ulx3s_85f", 5.0, 2)
    # 48 MHz over 7,680 cycles; 90 MHz over the same.
    assert (paper["fps"], paper["fps_at_paper_clock"]) == (6250.0, 11718.75)
    assert (paper["clock_mhz"], paper["clock_source"]) == (48.0, "pipeline.json: chip simple, grade 6, seed 1")
    assert (paper["bytes_per_ray"], paper["hit"]["nodes"]) == (10.0, 0.75)
    # 2 bytes a ray at 4.8 million rays a second.
    assert paper["mb_per_s"]["nodes"] == pytest.approx(9.6)
    # Not a size of the paper's.
    assert paper["paper_fps"] is None
    assert paper["wrong_pixels_vs_model"] == 0
    assert paper["embree_mrays"] == results["embree"]["Scene6"]["embree_mrays"] > 0
    assert 0 < paper["tests_per_ray"] < paper["steps_per_ray"]
    with open(docs / "results" / "bench.csv", newline="") as file:
        table = list(csv.DictReader(file))
    assert [(row["scene"], row["chip"], row["size"], row["cycles"]) for row in table] == [
        ("Scene6", "paper", "32x24", "7680"), ("Scene6", "ulx3s_85f", "32x24", "3840")]
    assert "<h1>" in (docs / "benchmarks.html").read_text()


def test_a_run_goes_on(docs, drawn):
    first = ("--only", "Scene6", "--chip", "paper", "--part", "simple")
    assert run(docs, *first, "--size", "32x24").exit_code == 0
    assert run(docs, *first, "--size", "32x24", "--size", "16x12").exit_code == 0
    assert drawn == [(32, 24, 4), (16, 12, 4)]
    before = results_of(docs)
    result = run(docs, *first, "--size", "32x24", "--size", "16x12")
    assert "Scene6, paper, 32x24, simple: 10.00 cycles a ray, 0 wrong pixels, as before" in result.output
    assert results_of(docs) == before
    assert len(drawn) == 2


def test_another_memory_is_measured_anew(docs, drawn, monkeypatch):
    arguments = ("--only", "Scene6", "--chip", "paper", "--part", "simple", "--size", "32x24")
    assert run(docs, *arguments).exit_code == 0
    row = TABLE3["Scene6"]

    def moved():
        scene = row.stand_in()
        return replace(scene, cameras=[replace(scene.default_camera(), hfov_deg=50.0)])

    monkeypatch.setitem(TABLE3, "Scene6", replace(row, stand_in=moved))
    bench_measure._prepared.cache_clear()
    assert run(docs, *arguments).exit_code == 0
    assert len(drawn) == 2
    bench_measure._prepared.cache_clear()


def test_the_papers_size(docs, drawn):
    assert run(docs, "--only", "Scene6", "--chip", "paper", "--part", "simple", "--size", "512x384").exit_code == 0
    row, = results_of(docs)["rows"]
    assert row["paper_fps"] == 60.8
    assert row["paper_cycles_per_ray"] == pytest.approx(7.529, abs=1e-3)
    assert row["cycles_ratio"] == pytest.approx(7680 / 196608 / 7.529, abs=1e-5)
    page = (docs / "benchmarks.md").read_text()
    assert "| Scene6 * | 806 (806) | 1 (1) | 0.04 (7.5) | 0.01 | 6250.0 (60.8) | 11718.8 | 0 |" in page
    assert (docs / "pictures" / "bench-Scene6.png").exists()
    assert "data:image/jpeg" in (docs / "benchmarks.html").read_text()


def test_textures_and_sweeps(docs, drawn, monkeypatch):
    monkeypatch.setattr(bench_sweeps, "SWEEP_SIZE", (16, 12))
    result = run(docs, "--only", "Quake3", "--size", "32x24", "--part", "textured", "--part", "sweeps")
    assert result.exit_code == 0, result.output
    results = results_of(docs)
    row, = results["rows"]
    assert (row["shading"], row["wrong_pixels_vs_model"]) == ("textured", 0)
    assert row["psnr_vs_golden"] > 40
    sweeps = {other["chip"]: other for other in results["sweeps"]}
    assert sorted(sweeps) == sorted(f"caches ×{factor:g}, latency {latency}" for factor in (0.25, 1, 4, 16)
                                    for latency in (4, 20))
    assert all(other["sweep"] == "caches" for other in results["sweeps"])
    assert next(iter(sweeps)) == "caches ×0.25, latency 4"
    assert (docs / "pictures" / "bench-sweeps.png").exists()


def test_plainly_lit():
    """Golden draws a texture's own colours, and nothing that is black."""
    loaded = TABLE3["Quake3"].load()
    frame = bench_measure.render_golden(plainly_lit(loaded.scene), loaded.camera, 16, 12, shading="full", depth=0)
    assert frame.color.min() > 20
    assert len(np.unique(frame.color.reshape(-1, 3), axis=0)) > 20


@pytest.mark.parametrize(("name", "text", "message"), [
    ("bench.json", "[1", "bench.json: is not JSON"),
    ("bench.json", '{"rows": [{"scene": "Scene6", "chip": "paper"}]}',
     "bench.json: is not what this command writes; remove it to measure anew"),
    ("bench.json", '{"rows": 3}', "bench.json: is not what this command writes; remove it to measure anew"),
    ("pipeline.json", '{"clock": []}', "neither ulx3s_85f.json nor pipeline.json has a clock of speed grade 6; measure "
     "one with dynrt pipeline --only clock"),
    ("pipeline.json", "{", "pipeline.json: is not JSON"),
    ("../benchmarks.md", "", "must have the lines '<!-- begin: scenes -->' and '<!-- end: scenes -->' once"),
])
def test_what_cannot_be_used(docs, drawn, name, text, message):
    (docs / "results" / name).write_text(text)
    result = run(docs, "--only", "Scene6", "--part", "simple", "--size", "16x12")
    assert result.exit_code == 2
    assert message in result.output
    assert drawn == []


def test_other_rays_are_the_pipelines(docs, drawn):
    path = docs / "results" / "pipeline.json"
    demo = {"demo": "vpl", "size": [32, 24], "rays": 900, "rays_by_kind": {"primary": 768, "shadow": 132},
            "cycles_per_ray": 31.5, "rtl_wrong_pixels": 0, "formats": []}
    path.write_text(json.dumps(json.loads(path.read_text()) | {"demos": [demo]}))
    assert run(docs, "--only", "Scene6", "--chip", "paper", "--part", "simple", "--size", "16x12").exit_code == 0
    assert "| vpl | 32×24 | 768 | 132 | 31.5 | 0 |" in (docs / "benchmarks.md").read_text()


def test_a_board_that_is_built_has_the_clock(docs, drawn):
    (docs / "results" / "ulx3s_85f.json").write_text(json.dumps({"grade": 6, "clocks": {
        "pixel": {"seeds": [{"seed": 1, "mhz": 90.0}]},
        "chip": {"seeds": [{"seed": 1, "mhz": 105.0}, {"seed": 2, "mhz": 101.5}]}}}))
    assert run(docs, "--only", "Scene6", "--chip", "paper", "--part", "simple", "--size", "16x12").exit_code == 0
    row, = results_of(docs)["rows"]
    assert (row["clock_mhz"], row["clock_source"]) == (101.5, "ulx3s_85f.json: grade 6, seed 2")


def test_a_pixel_that_differs_is_counted(monkeypatch, drawn):
    right = bench_measure.render_rtl

    def wrong(*args, **options):
        frame = right(*args, **options)
        frame.t[3, 5] *= 2
        return frame

    monkeypatch.setattr(bench_measure, "render_rtl", wrong)
    job = BenchJob(scene="Scene6", folder=None, chip="paper", config=ChipConfig(), latency=4, size=(16, 12))
    row, picture = measure(job)
    assert row["wrong_pixels_vs_model"] == 1
    assert picture.startswith(b"\x89PNG")


@pytest.mark.chip
@pytest.mark.xdist_group("chip")
def test_the_chip_itself_here_and_on_a_cluster(docs):
    """All but the simulator's speed is the same, whoever measures."""
    found = []
    options = dict(n_workers=1, threads_per_worker=2, processes=False, dashboard_address=None)
    with distributed.LocalCluster(**options) as cluster:
        for arguments in ((), ("--scheduler", cluster.scheduler_address)):
            (docs / "results" / "bench.json").unlink(missing_ok=True)
            result = run(docs, "--only", "Scene6", "--chip", "paper", "--part", "simple", "--size", "32x24",
                         "--size", "16x12", *arguments)
            assert result.exit_code == 0, result.output
            found.append(results_of(docs))
    for results in found:
        assert [row["wrong_pixels_vs_model"] for row in results["rows"]] == [0, 0]
        assert all(row.pop("simulated_hz") > 1e3 for row in results["rows"])
        # A packet of four rays takes a step a cycle.
        assert all(row["cycles_per_ray"] > row["steps_per_ray"] > 1 for row in results["rows"])
    assert found[0] == found[1]


def test_parts_and_sizes_of_the_whole():
    jobs = bench_module._table_jobs(None, parts=bench_module.PARTS, only=(), chips=(), sizes=(), earlier={})
    assert len(jobs) == 9 * 2 * 2 + 6
    assert len({job.key for job in jobs}) == len(jobs)


def test_views(docs):
    assert run(docs, "--only", "Scene6", "--part", "views").exit_code == 0
    assert run(docs, "--only", "Castle", "--part", "views").exit_code == 0
    rows = results_of(docs)["views"]
    assert [(row["scene"], row["view"], row["real"]) for row in rows] == [("Scene6", 0, False), ("Castle", 0, False)]
    assert all(row["steps_per_ray"] > 1 for row in rows)
    page = (docs / "benchmarks.md").read_text()
    assert f"| Castle *, 0 | {rows[1]['steps_per_ray']:.2f} |" in page
