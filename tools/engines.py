"""Pictures by whichever engine, one or a moving scene's."""

import contextlib
import sys
import time
from dataclasses import dataclass, replace

from rtl.config import ChipConfig
from sim.golden import render_golden
from sim.machine import render_frames, render_pysim, render_rtl
from sim.machine.sdram_bench import render_sdram
from sim.model import render_full, render_model
from sim.scene.slots import upload_report

from .errors import BadInput

__all__ = ["ENGINES", "MEMORIES", "Order", "draw", "model_picture", "progress_on"]

ENGINES = ("golden", "model", "rtl", "pysim")
#: What the Verilated chip reads from: a memory for each port that answers after a while, or one SDRAM.
MEMORIES = ("latency", "sdram")


@dataclass(frozen=True, kw_only=True)
class Order:
    """What is to be drawn, and by what.

    Parameters
    ----------
    engine : str
        One of :data:`ENGINES`.
    size : (int, int)
        Width and height in pixels.
    config : ChipConfig
        The chip; for full shading without a shader it gets the one that the scene needs.
    shading : str
        ``"simple"`` or ``"full"``.
    depth : int
        Of full shading.
    background : tuple of int
    memory : str
        One of :data:`MEMORIES`.
    latency, jitter, seed : int
        Of the simulated memories, if they are those of a fixed latency.
    wave : path, optional
    wave_cycles, wave_pixels
        As of :func:`~sim.machine.machine.render_rtl`.
    """

    engine: str
    size: tuple[int, int]
    config: ChipConfig
    shading: str = "simple"
    depth: int = 4
    background: tuple = (0, 0, 0)
    memory: str = "latency"
    latency: int = 4
    jitter: int = 0
    seed: int = 1
    wave: object = None
    wave_cycles: tuple | None = None
    wave_pixels: tuple = ()

    @property
    def is_full(self):
        """Whether it is full shading."""
        return self.shading == "full"

    def chip_for(self, compiled):
        """The chip that draws a CompiledScene: with full shading its own shader, or one that does what is needed.

        Raises
        ------
        BadInput
            If its own does not.
        """
        if not self.is_full:
            return self.config
        if self.config.shader is None:
            return replace(self.config, shader=replace(compiled.needs, depth=self.depth))
        if missing := self.config.shader.missing(compiled.needs):
            raise BadInput(f"--chip: the chip's shader lacks what the scene needs: {', '.join(missing)}; fit a chip to "
                           "the scene with dynrt fit")
        return self.config


@contextlib.contextmanager
def progress_on(console, what):
    """A function that shows on a terminal what is being done, at first ``what``."""
    if not sys.stderr.isatty():
        yield lambda text: None
        return
    with console.status(what) as status:
        yield lambda text: status.update(text)


def draw(order, compiled, poses, *, is_moving, console):
    """Draws a scene in each of its poses.

    A chip draws all of a moving scene's pictures without stopping, see :func:`~sim.machine.moving.render_frames`; the
    other engines read the same memory.

    Parameters
    ----------
    order : Order
    compiled : CompiledScene or None
        None for the golden engine.
    poses : list of (Scene, Camera)
    is_moving : bool
        Whether there are slots in memory for what moves.
    console : rich Console

    Yields
    ------
    frame : Frame
        Its report has ``seconds``, ``memory`` of engines that have one, and ``upload`` of moving scenes.
    image : SceneImage or None
        What the memory holds.
    """
    frames = _frames(order, compiled, poses, is_moving, console)
    with contextlib.closing(frames):
        while True:
            begin = time.perf_counter()
            drawn = next(frames, None)
            if drawn is None:
                return
            frame, image = drawn
            if image is not None:
                frame.report["memory"] = {**image.stats, "bytes": image.num_bytes, "crc32": f"{image.checksum:08x}"}
            frame.report["seconds"] = time.perf_counter() - begin
            yield frame, image


def _frames(order, compiled, poses, is_moving, console):
    what = f"drawing by {order.engine}"
    if order.engine == "golden":
        for scene, camera in poses:
            with progress_on(console, what):
                frame = render_golden(scene, camera, *order.size, background=order.background, shading=order.shading,
                                      depth=order.depth)
            yield frame, None
    elif order.engine == "rtl" and is_moving:
        with progress_on(console, what) as progress:
            for image, frame in render_frames(
                    compiled, poses, *order.size, config=order.chip_for(compiled), background=order.background,
                    latency=order.latency, jitter=order.jitter, seed=order.seed, progress=progress):
                yield frame, image
    else:
        image = None
        for number, (scene, camera) in enumerate(poses):
            with progress_on(console, what) as progress:
                view = {"eye": camera.eye, "is_full": order.is_full}
                update = seconds = None
                if image is None:
                    image = compiled.image(scene, **view, background=order.background, slot=0 if is_moving else None)
                else:
                    begin = time.perf_counter()
                    update = compiled.update(scene, slot=number & 1, **view)
                    seconds = time.perf_counter() - begin
                    image = image.updated(update)
                frame = _picture(order, image, camera, order.chip_for(compiled), progress)
                if is_moving:
                    frame.report["upload"] = upload_report(image, update, seconds=seconds)
            yield frame, image


def _picture(order, image, camera, config, progress):
    if order.engine == "model":
        return model_picture(order, image, camera, config)
    if order.memory == "sdram":
        return render_sdram(image, camera, *order.size, config=config, background=order.background, progress=progress)
    common = dict(config=config, background=order.background, latency=order.latency, wave=order.wave,
                  progress=progress)
    if order.engine == "pysim":
        return render_pysim(image, camera, *order.size, **common)
    return render_rtl(image, camera, *order.size, **common, jitter=order.jitter, seed=order.seed,
                      cycles=order.wave_cycles, pixels=order.wave_pixels)


def model_picture(order, image, camera, config):
    """The bit-exact model's picture of what an image holds."""
    if order.is_full:
        return render_full(image, camera, *order.size, config=config)
    return render_model(image, camera, *order.size, config=config, background=order.background)
