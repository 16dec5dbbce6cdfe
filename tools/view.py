"""``dynrt view``: look around in a scene on a board, live."""

import time
from dataclasses import replace

import click
import numpy as np
from rich.console import Console

from .board_options import link_options, linked, prepared
from .errors import clear_errors
from .options import CAMERA, camera_of

__all__ = ["moved", "orbit", "view"]

#: What a key does: steps to the right, up and forward, and turns to the right and up in degrees.
_KEYS = {
    "w": ((0, 0, 1), (0, 0)), "s": ((0, 0, -1), (0, 0)), "a": ((-1, 0, 0), (0, 0)), "d": ((1, 0, 0), (0, 0)),
    "r": ((0, 1, 0), (0, 0)), "f": ((0, -1, 0), (0, 0)),
    "h": ((0, 0, 0), (-10, 0)), "l": ((0, 0, 0), (10, 0)), "k": ((0, 0, 0), (0, 10)), "j": ((0, 0, 0), (0, -10)),
}
#: A step, in parts of the scene's size
_STEP = 0.02
_HELP = "w s a d: move; r f: up, down; h l k j: turn; q: leave"


def _turned(vector, axis, degrees):
    """``vector`` about ``axis``, by Rodrigues' formula."""
    angle = np.radians(degrees)
    return (vector * np.cos(angle) + np.cross(axis, vector) * np.sin(angle)
            + axis * (axis @ vector) * (1 - np.cos(angle)))


def moved(camera, key, *, step):
    """The camera after a key, None for a key that does nothing; ``step`` is how far a move goes."""
    if key not in _KEYS:
        return None
    steps, (yaw, pitch) = _KEYS[key]
    eye, at, up = (np.asarray(each, float) for each in (camera.eye, camera.at, camera.up))
    forward = (at - eye) / np.linalg.norm(at - eye)
    upright = up / np.linalg.norm(up)
    right = np.cross(forward, upright)
    right /= np.linalg.norm(right)
    eye = eye + step * (np.array(steps) @ (right, upright, forward))
    forward = _turned(forward, upright, -yaw)
    turned = _turned(forward, right, pitch)
    # Not over the top, where there is no right any more.
    if np.linalg.norm(np.cross(turned, upright)) > 0.1:
        forward = turned
    return replace(camera, eye=eye, at=eye + forward * np.linalg.norm(at - camera.eye))


def orbit(camera, number, frames):
    """The camera on its way round what it looks at."""
    eye, at, up = (np.asarray(each, float) for each in (camera.eye, camera.at, camera.up))
    return replace(camera, eye=at + _turned(eye - at, up / np.linalg.norm(up), 360 * number / frames))


@click.command()
@click.argument("scene")
@link_options
@click.option("--camera", type=CAMERA, help="Where to begin: eye x,y,z, look-at x,y,z, up x,y,z, horizontal field of "
              "view in degrees")
@click.option("--background", type=click.IntRange(0, 255), nargs=3, default=(0, 0, 0), show_default=True,
              metavar="R G B")
@click.option("--frames", type=click.IntRange(min=1), help="Draw so many pictures without being asked, once round what "
              "the camera looks at, or once through the scene's animation, and leave")
def view(scene, link, camera, background, frames):
    """Look around in SCENE on a board, real or simulated, by keys: the picture is on the board's screen."""
    console = Console(stderr=True, highlight=False)
    with clear_errors():
        loaded, compiled, order = prepared(scene, link.config, size=link.board.size, background=background)
        first = camera_of(loaded, camera, None)
        poses = _poses(loaded, first, camera is not None, frames) if frames else _typed(loaded, first, console)
        with linked(link, progress=lambda done, total: None) as board:
            _show(board, compiled, order, poses, background, console)


def _poses(scene, first, is_given, frames):
    for number in range(frames):
        if scene.is_animated:
            posed = scene.at_time(scene.duration * number / frames)
            yield posed, first if is_given else posed.default_camera()
        else:
            yield scene, orbit(first, number, frames)


def _typed(scene, camera, console):
    lower, upper = scene.bounds()
    step = _STEP * float(np.linalg.norm(np.subtract(upper, lower)))
    console.print(_HELP)
    yield scene, camera
    while (key := click.getchar()) not in ("q", "\x03", "\x04"):
        following = moved(camera, key, step=step)
        if following is None:
            console.print(_HELP)
            continue
        camera = following
        yield scene, camera


def _show(board, compiled, order, poses, background, console):
    """Each picture; what the next one needs is written while the last one is drawn."""
    image, slot, number, begin = None, 0, 0, time.monotonic()
    for scene, camera in poses:
        seen = {"eye": camera.eye, "is_full": order.is_full}
        if image is None:
            image = compiled.image(scene, **seen, background=background, slot=0)
            board.load(image)
        else:
            slot ^= 1
            update = compiled.update(scene, slot=slot, **seen)
            board.update(update.ahead)
            board.wait()
            board.update(update.between)
            image = image.updated(update)
        board.start(image, camera, background=background)
        number += 1
    counters = board.wait()
    seconds = time.monotonic() - begin
    console.print(f"{number} pictures in {seconds:.1f} s; the last in {counters['cycles']:,} cycles",
                  markup=False, soft_wrap=True)
