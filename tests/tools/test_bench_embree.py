"""Embree as the benchmarks drive it."""

import sys

import numpy as np
import pytest

from sim.scene import Camera, Instance, Material, Scene
from tests.sim.golden.rooms import quad, scene_of
from tools.bench_embree import core_clock, embree_row, embree_scene, peak_flops_per_cycle
from tools.errors import BadInput

CAMERA = Camera((0, 0, 1), (0, 0, 0), (0, 1, 0), 90.0)


def left_half():
    return scene_of(quad([(-3, -3, 0), (0, -3, 0), (0, 3, 0), (-3, 3, 0)], Material("grey", (0.5, 0.5, 0.5))))


def test_half_of_the_rays_hit():
    row = embree_row(left_half(), CAMERA, (64, 48))
    assert row["embree_hits"] == 0.5
    assert row["embree_triangles"] == 2
    assert row["embree_mrays"] > 0.1


def test_the_nearest_instances_come_first():
    one = left_half()
    places = [np.column_stack([np.eye(3), (x, 0.0, 0.0)]) for x in (50.0, 0.0, 20.0)]
    scene = Scene(one.meshes, [Instance(0, place, f"{number}") for number, place in enumerate(places)], one.materials,
                  [])
    embree, number = embree_scene(scene, eye=CAMERA.eye, max_triangles=5)
    assert number == 4
    origins = np.array([(x - 1.0, 0.0, 1.0) for x in (50, 0, 20)], np.float32)
    found = embree.run(origins, np.tile(np.array((0, 0, -1), np.float32), (3, 1)), output=1)
    assert (found["primID"] >= 0).tolist() == [False, True, True]


def test_without_embree(monkeypatch):
    monkeypatch.setitem(sys.modules, "embreex", None)
    monkeypatch.setitem(sys.modules, "embreex.mesh_construction", None)
    with pytest.raises(BadInput) as error:
        embree_scene(left_half())
    assert error.value.message == (
        "embreex, the software that is compared with, is not installed; run make setup, or pip install 'dynrt[bench]', "
        "or leave it out: dynrt bench --part simple --part textured --part sweeps --part area")


def test_the_core():
    assert 300 < core_clock() < 10_000


@pytest.mark.parametrize(("flags", "operations"), [("fpu sse4_1", 8), ("avx avx2 fma", 32), ("fma avx512f", 64)])
def test_operations_a_cycle(tmp_path, flags, operations):
    (tmp_path / "cpuinfo").write_text(f"model name\t: X\nflags\t\t: {flags}\n")
    assert peak_flops_per_cycle(tmp_path / "cpuinfo")[0] == operations
