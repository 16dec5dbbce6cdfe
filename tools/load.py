"""``dynrt load``: a scene to a board, and its first picture on the screen."""

import time
from pathlib import Path

import click
from rich.console import Console

from .animation import save_picture
from .board_options import link_options, linked, prepared
from .engines import model_picture
from .errors import check_folders, clear_errors, written_whole
from .options import CAMERA, camera_of

__all__ = ["load"]


@click.command()
@click.argument("scene")
@link_options
@click.option("--camera", type=CAMERA, help="eye x,y,z, look-at x,y,z, up x,y,z, horizontal field of view in degrees")
@click.option("--view", type=click.IntRange(min=0), help="Number of a camera in the scene's file  [default: the first]")
@click.option("--background", type=click.IntRange(0, 255), nargs=3, default=(0, 0, 0), show_default=True,
              metavar="R G B")
@click.option("-o", "--output", type=click.Path(dir_okay=False, path_type=Path), help="PNG to write, of the picture in "
              "the board's memory, which is compared with the model's")
def load(scene, link, camera, view, background, output):
    """Send SCENE (as dynrt render takes it) to a board, real or simulated, and draw it there."""
    check_folders(output)
    console = Console(stderr=True, highlight=False)
    with clear_errors():
        loaded, compiled, order = prepared(scene, link.config, size=link.board.size, background=background)
        chosen = camera_of(loaded, camera, view)
        image = compiled.image(loaded, eye=chosen.eye, is_full=order.is_full, background=background)
        for warning in [*loaded.warnings, *compiled.warnings]:
            console.print(f"warning: {warning}", markup=False, soft_wrap=True)
        with console.status("opening the link") as status, linked(
                link, progress=lambda done, total: status.update(f"{done:,} of {total:,} bytes")) as board:
            begin = time.monotonic()
            board.load(image)
            seconds = time.monotonic() - begin
            status.update("drawing")
            board.start(image, chosen, background=background)
            counters = board.wait()
            picture = None if output is None else board.picture()
        size = link.board.size
        console.print(f"{image.num_bytes:,} bytes in {seconds:.1f} s; {size[0]}x{size[1]} in {counters['cycles']:,} "
                      f"cycles, {counters['cycles'] / (size[0] * size[1]):.2f} a pixel", markup=False, soft_wrap=True)
        if output is not None:
            model = model_picture(order, image, chosen, order.chip_for(compiled))
            wrong = int((picture != model.color).any(axis=-1).sum())
            with written_whole(output) as path:
                save_picture(path, picture)
            console.print(f"{output}: {wrong} pixels differ from the model", markup=False, soft_wrap=True)
