"""Frames of a moving scene by one simulated chip, whose memories are written while it draws."""

import time

import numpy as np

from ..scene.slots import upload_report
from .bench import Bench
from .machine import draw_frame, load_image

__all__ = ["port_writes", "render_frames"]

# The chip's memories of full shading, by the image's names.
_PORTS = {"records": "shading", "texels": "textures"}


def port_writes(pieces):
    """Of each piece of an update the chip's memory, the number of its first word, and its words."""
    for piece in pieces:
        words = 1 if piece.items.ndim == 1 else piece.items.shape[1]
        yield _PORTS.get(piece.memory, piece.memory), piece.first * words, np.ravel(piece.items)


def _write(bench, pieces):
    for name, first, words in port_writes(pieces):
        bench.write(name, first, words)


def render_frames(compiled, poses, width, height, *, config, background=(0, 0, 0), latency=4, jitter=0, seed=1,
                  progress=lambda text: None):
    """Draws a scene pose by pose, without stopping the chip's clock or loading its memories anew.

    What a frame needs is written to its slot before the chip begins with the frame before it, which is as early as an
    upload can be, so a chip that reads from the wrong slot draws a wrong picture. The few words that both slots share
    are written between the frames.

    Parameters
    ----------
    compiled : CompiledScene
    poses : iterable of (Scene, Camera)
        The scene at each time, and the view; asked for one ahead of the frame that is drawn.
    width, height, config, background, latency, jitter, seed, progress
        As for :func:`~sim.machine.machine.render_rtl`.

    Yields
    ------
    image : SceneImage
        What the memories hold for the frame.
    frame : Frame
        As of :func:`~sim.machine.machine.render_rtl`; its report has ``upload`` too, see
        :func:`~sim.scene.slots.upload_report`.

    Raises
    ------
    SceneError
        If a pose does not fit, see :meth:`~sim.scene.compile.CompiledScene.image`.
    BuildError, SimulationError
        See :mod:`~sim.machine.build` and :mod:`~sim.machine.bench`.
    """
    poses = iter(poses)
    pose = next(poses, None)
    if pose is None:
        return

    scene, camera = pose
    is_full = config.shader is not None
    image = compiled.image(scene, eye=camera.eye, is_full=is_full, background=background, slot=0)
    update, seconds, cycles, slot = None, None, None, 0
    with Bench(config, latency=latency, jitter=jitter, seed=seed, progress=progress) as bench:
        load_image(bench, image, config)
        progress("drawing")
        while True:
            following = next(poses, None)
            if following is not None:
                slot ^= 1
                begin = time.perf_counter()
                coming = compiled.update(following[0], slot=slot, eye=following[1].eye, is_full=is_full)
                coming_seconds = time.perf_counter() - begin
                _write(bench, coming.ahead)
            frame, _, _ = draw_frame(bench, image, camera, width, height, config=config, background=background)
            frame.report["upload"] = upload_report(image, update, cycles=cycles, seconds=seconds)
            yield image, frame
            if following is None:
                return
            _write(bench, coming.between)
            update, seconds, camera, cycles = coming, coming_seconds, following[1], frame.report["cycles"]
            image = image.updated(update)
