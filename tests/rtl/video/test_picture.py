"""The committed picture is what a monitor has decoded."""

import json
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from rtl.video.mode import MODES
from tests.rtl.video.picture import monitor
from tests.rtl.video.screen import expected_bars

DOCS = Path(__file__).parents[3] / "docs"


def test_the_picture_of_the_documentation():
    with Image.open(DOCS / "pictures" / "dvi-test.png") as image:
        assert np.array_equal(np.asarray(image), expected_bars(640, 480))
    results = json.loads((DOCS / "results" / "dvi.json").read_text())
    assert set(results) == set(MODES)
    assert all(result["wrong_pixels"] == 0 and not result["wrong_times"] for result in results.values())


@pytest.mark.parametrize("name", MODES)
def test_whole_screens(name):
    mode = MODES[name]
    frame, = monitor(mode).frames()
    assert np.array_equal(frame.picture, expected_bars(mode.width, mode.height))
    assert all(frame.times[each] == getattr(mode, each) for each in frame.times)
    assert (frame.h_positive, frame.v_positive) == (mode.h_positive, mode.v_positive)
