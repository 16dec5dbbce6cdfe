"""A whole board at its pins and its own size: from power-up, a scene over the cable, to what a monitor decodes."""

from pathlib import Path

import click
import numpy as np
from PIL import Image

from boards.catalog import BOARDS
from sim.host import Driver
from sim.host.loader import Loader
from sim.machine.board_bench import SimulatedBoard
from tools.board_options import board_chip, prepared
from tools.engines import model_picture
from tools.errors import written_whole
from tools.options import CHIP
from tools.results import json_text, write_texts

__all__ = ["shown"]


def shown(board, config, scene, *, divisor, progress):
    """What a monitor shows of a scene, and what there is to say of it.

    Returns
    -------
    picture : uint8[H, W, 3]
    report : dict
    """
    loaded, compiled, order = prepared(scene, config, size=board.size, background=(0, 0, 0))
    camera = loaded.default_camera()
    image = compiled.image(loaded, eye=camera.eye, is_full=order.is_full)
    with SimulatedBoard(config, clock_mhz=board.clock_mhz, mode=board.mode, scale=board.scale, divisor=divisor,
                        progress=progress) as simulation:
        driver = Driver(simulation, clock=simulation.clock)
        loader = Loader(driver, config, size=board.size, sleep=lambda seconds: simulation.run(4000),
                        progress=lambda done, total: progress(f"{done:,} of {total:,} bytes"))
        begin = simulation.cycle
        loader.load(image)
        uploaded = simulation.cycle - begin
        progress("drawing")
        loader.start(image, camera)
        counters = loader.wait()
        progress("watching the screen")
        frame, = simulation.screen(1)
        frames, late = loader.screen_counts()
    model = model_picture(order, image, camera, order.chip_for(compiled)).color
    large = model.repeat(board.scale, axis=0).repeat(board.scale, axis=1)
    pixels = board.size[0] * board.size[1]
    return frame.picture, {
        "board": board.name, "scene": scene, "config": repr(config), "clock_mhz": board.clock_mhz, "divisor": divisor,
        "upload_bytes": image.num_bytes, "upload_cycles": uploaded, "frames_sent": driver.sent,
        "frames_repeated": driver.repeated, "size": list(board.size), "cycles": counters["cycles"],
        "cycles_per_ray": round(counters["cycles"] / pixels, 3), "screen": list(frame.picture.shape[1::-1]),
        "screen_times": frame.times, "screen_frames": frames, "late_lines": late,
        "wrong_pixels": int((frame.picture != large).any(axis=-1).sum()),
    }


@click.command()
@click.option("--board", type=click.Choice(list(BOARDS)), default="ulx3s_85f", show_default=True)
@click.option("--chip", "parameters", type=CHIP, multiple=True, help="Another chip than the board's.")
@click.option("--scene", default="room", show_default=True)
@click.option("--divisor", type=click.IntRange(4), default=4, show_default=True, help="Cycles of a bit of the cable.")
@click.option("--output", type=click.Path(file_okay=False, path_type=Path), default="build/board", show_default=True)
def main(board, parameters, scene, divisor, output):
    """Draw a scene on a simulated board, and compare its screen with the model."""
    chosen = BOARDS[board]
    picture, report = shown(chosen, board_chip(chosen, parameters), scene, divisor=divisor,
                            progress=lambda text: click.echo(text, err=True))
    with written_whole(output / "screen.png") as path:
        Image.fromarray(np.ascontiguousarray(picture)).save(path, format="PNG", optimize=True)
    write_texts({output / "board.json": json_text(report)})
    click.echo(json_text(report))
    if report["wrong_pixels"]:
        raise click.ClickException(f"{report['wrong_pixels']} pixels of the screen are not the model's")


if __name__ == "__main__":
    main()
