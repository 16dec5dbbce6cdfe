"""The test picture as a monitor sees it, decoded from the bits at the pins of the Verilated screen."""

import ctypes
import hashlib
import json
from pathlib import Path

import click
import numpy as np
from PIL import Image

from rtl.video.display import BarScreen
from rtl.video.mode import MODES
from sim.machine.component_build import component_library
from sim.machine.dvi_receiver import DviReceiver, unpacked
from tests.rtl.video.screen import expected_bars
from tools.errors import written_whole
from tools.results import earlier_results, json_text, write_texts

__all__ = ["monitor"]

_MEMBERS = ("width", "h_front", "h_sync", "h_back", "height", "v_front", "v_sync", "v_back")


def monitor(mode, *, frames=1, progress=lambda text: None):
    """A :class:`DviReceiver` behind a screen of a mode, for so many whole frames."""
    library = ctypes.CDLL(str(component_library(
        BarScreen(mode), bench=Path(__file__).with_name("screen.cpp"), domains=("pixel", "shift"),
        optimise="-O1", progress=progress)))
    # It begins behind the last visible line, and a frame from the next vertical sync on.
    clocks = mode.h_total * (frames * mode.v_total + mode.v_front + 2)
    pairs = np.empty(5 * clocks, np.uint8)
    progress(f"{clocks:,} pixel clocks")
    library.screen_run(ctypes.c_uint64(clocks), pairs.ctypes.data_as(ctypes.c_void_p))
    return DviReceiver(unpacked(pairs))


@click.command()
@click.option("--picture", type=click.Path(path_type=Path), default="docs/pictures/dvi-test.png", show_default=True)
@click.option("--output", type=click.Path(path_type=Path), default="docs/results/dvi.json", show_default=True)
@click.option("--mode", "shown", type=click.Choice(list(MODES)), default="640x480", show_default=True,
              help="Which one is kept as a picture.")
def main(picture, output, shown):
    """Decode a frame of each mode, compare it, and keep one."""
    results = earlier_results(output)
    for name, mode in MODES.items():
        receiver = monitor(mode, progress=lambda text: click.echo(text, err=True))
        frame = receiver.frames()[0]
        wrong = int((frame.picture != expected_bars(mode.width, mode.height)).any(axis=-1).sum())
        results[name] = {
            **frame.times, "h_positive": frame.h_positive, "v_positive": frame.v_positive, "pixel_mhz": mode.pixel_mhz,
            "refresh_hz": round(mode.refresh_hz(), 3), "wrong_pixels": wrong,
            "wrong_times": [each for each in _MEMBERS if frame.times[each] != getattr(mode, each)],
            "max_disparity": receiver.max_disparity,
            "sha256": hashlib.sha256(frame.picture.tobytes()).hexdigest(),
        }
        click.echo(f"{name}: {json.dumps(results[name])}")
        if name == shown:
            with written_whole(picture) as whole:
                Image.fromarray(frame.picture).save(whole, format="PNG", optimize=True)
    write_texts({output: json_text(results)})


if __name__ == "__main__":
    main()
