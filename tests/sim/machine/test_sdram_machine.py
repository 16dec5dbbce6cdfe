"""The chip with its scene in an SDRAM draws what the model does."""

import numpy as np
import pytest

from sim.machine import SimulationError
from sim.machine.sdram_bench import SdramBench, render_sdram
from sim.model import render_model
from sim.scene import load_scene
from sim.scene.compile import compile_scene

from .scenes import instances_scene
from .test_chip import SIMPLE

# Compiled chips are kept; one worker for all of these compiles each only once.
pytestmark = [pytest.mark.chip, pytest.mark.xdist_group("sdram")]


@pytest.mark.parametrize("scene", ["room", "instances"])
def test_the_picture_is_the_models(scene):
    scene = load_scene("room") if scene == "room" else instances_scene(1)
    image = compile_scene(scene, fmt=SIMPLE.fmt, stack_depth=SIMPLE.stack_depth)
    camera, size = scene.default_camera(), (48, 32)
    model = render_model(image, camera, *size, config=SIMPLE, background=(1, 2, 3))
    frame = render_sdram(image, camera, *size, config=SIMPLE, background=(1, 2, 3))
    assert not frame.differs(model).any()
    sdram, report = frame.report["sdram"], frame.report
    # Each pixel is written, and all that the chip reads comes from there.
    assert sdram["bytes"] == sum(report["bytes"].values()) + 4 * size[0] * size[1]
    assert 0 < sdram["busy"] < 1
    assert sdram["busy"] == pytest.approx(sdram["bytes"] / 2 / report["cycles"], rel=0.01)
    assert abs(sdram["refreshes"] - report["cycles"] / 974) <= 2


def test_what_cannot_be():
    with SdramBench(SIMPLE) as bench:
        with pytest.raises(SimulationError, match=r"^the memory 'nodes' has 33,554,432 bytes, for which there is no "
                                                  r"room in the SDRAM's 32 MB behind the picture and the others$"):
            bench.load("nodes", np.zeros(1 << 23, np.uint32))
        with pytest.raises(SimulationError, match="cannot be changed"):
            bench.write("nodes", 0, np.zeros(1, np.uint32))
        with pytest.raises(SimulationError, match="waveforms are not written"):
            bench.trace("a.vcd")


def test_the_sdram_is_asked():
    """A chip that is slower than the controller believes refuses."""
    scene = load_scene("room")
    image = compile_scene(scene, fmt=SIMPLE.fmt, stack_depth=SIMPLE.stack_depth)
    with pytest.raises(SimulationError, match=r"^the SDRAM refuses: tCK: "):
        render_sdram(image, scene.default_camera(), 8, 8, config=SIMPLE, chip_mhz=142.0)
