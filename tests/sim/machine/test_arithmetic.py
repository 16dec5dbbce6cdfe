"""The chip in each arithmetic draws what the model draws in it."""

from dataclasses import replace

import pytest

from fpu import FloatFormat
from rtl.arithmetic import ARITHMETICS
from rtl.config import ChipConfig
from sim.machine import render_pysim
from sim.model import render_model
from sim.scene.compile import compile_scene

from .scenes import instances_scene, soup_scene

# Its kernels are compiled once.
pytestmark = [pytest.mark.chip, pytest.mark.xdist_group("arithmetic")]

FMT = FloatFormat(5, 8)
SIZE = 4, 4


@pytest.mark.parametrize("number", range(len(ARITHMETICS)), ids=[arithmetic.name for arithmetic in ARITHMETICS])
def test_chip_is_model(number):
    scene = soup_scene(1, count=12)
    config = ChipConfig(fmt=FMT, arithmetic=number, num_threads=2, stack_depth=8, node_lines=8, list_lines=8,
                        matrix_lines=8,
                        mailbox_entries=0, add_latency=1, mul_latency=1, div_latency=2, cmp_latency=1)
    image = compile_scene(scene, fmt=FMT, stack_depth=config.stack_depth)
    frame = render_pysim(image, scene.default_camera(), *SIZE, config=config)
    model = render_model(image, scene.default_camera(), *SIZE, config=config)
    assert not frame.differs(model).any()
    assert (frame.prim_id >= 0).any()


@pytest.mark.parametrize("number", [0, 3], ids=["separate", "truncated"])
def test_edges_that_give(number):
    scene = soup_scene(1, count=12)
    config = ChipConfig(fmt=FMT, arithmetic=number, edge_tolerance=8, num_threads=2, stack_depth=8, node_lines=8,
                        list_lines=8, matrix_lines=8, mailbox_entries=0, add_latency=1, mul_latency=1, div_latency=2,
                        cmp_latency=1)
    image, camera = compile_scene(scene, fmt=FMT, stack_depth=config.stack_depth), scene.default_camera()
    frame = render_pysim(image, camera, *SIZE, config=config)
    assert not frame.differs(render_model(image, camera, *SIZE, config=config)).any()
    # Edges give to each other alone: loose triangles stay what they are.
    wide, narrow = (render_model(image, camera, 64, 48, config=replace(config, edge_tolerance=tolerance))
                    for tolerance in (8, 0))
    assert ((wide.prim_id >= 0) == (narrow.prim_id >= 0)).all()


def test_they_differ():
    """In the last bits; but a quotient by table is the same."""
    scene = instances_scene(1)
    image = compile_scene(scene, fmt=FMT, flatten=False)
    pictures = {arithmetic.name: render_model(image, scene.default_camera(), 160, 120,
                                              config=ChipConfig(fmt=FMT, arithmetic=number))
                for number, arithmetic in enumerate(ARITHMETICS)}
    separate = pictures.pop("separate")
    assert not separate.differs(pictures.pop("table")).any()
    # Reciprocals are the traversal's alone: they seldom show.
    del pictures["reciprocal"]
    for picture in pictures.values():
        assert (picture.t != separate.t).mean() > 0.01
