"""What a chip is fitted to: pictures of a scene, and how well the model draws them."""

import numpy as np

from rtl.config import ChipConfig
from sim.golden import render_golden
from sim.scene import SceneError
from sim.scene.compile import CompiledScene

from .chart_truth import Truth
from .engines import Order, model_picture
from .quality import Faults

__all__ = ["Pictures"]

#: Levels of 255 by which a pixel may differ before it counts for another one.
_FAR = 8


class Pictures:
    """Pictures of a scene by golden, and the model's against them.

    Parameters
    ----------
    scene : Scene
    poses : list of (Scene, Camera)
        What is drawn: the scene at some times.
    size : (int, int)
    shading : str
        ``"simple"`` or ``"full"``.
    depth : int
        Generations of secondary rays that are wanted.
    flatten, from_eye
        Of :class:`~sim.scene.compile.CompiledScene`.
    progress : callable
        Is told what is being done.
    """

    def __init__(self, scene, poses, size, *, shading="full", depth=4, flatten=None, from_eye=True,
                 progress=lambda text: None):
        self.scene, self.poses, self.size, self.shading, self.depth = scene, poses, size, shading, depth
        self._options = dict(flatten=flatten, from_eye=from_eye)
        self._progress = progress
        self._truths = []
        for number, (posed, camera) in enumerate(poses, 1):
            progress(f"drawing by golden, {number} of {len(poses)}")
            self._truths.append(Truth(posed, camera, size, shading=shading, depth=depth))
        self._known = {}

    @property
    def is_full(self):
        """Whether it is full shading."""
        return self.shading == "full"

    def compiled(self, fmt, *, stack_depth=ChipConfig().stack_depth):
        """The CompiledScene for a format, and the image of each pose; those of the last two are kept.

        Raises
        ------
        SceneError
            If the scene does not fit the format.
        """
        if (fmt, stack_depth) not in self._known:
            while len(self._known) > 1:
                del self._known[next(iter(self._known))]
            compiled = self.compile(fmt, stack_depth=stack_depth)
            # What moves needs room for two frames, as when it is drawn.
            slot = 0 if self.scene.is_animated else None
            self._known[fmt, stack_depth] = compiled, [
                compiled.image(posed, eye=camera.eye, is_full=self.is_full, slot=slot) for posed, camera in self.poses]
        return self._known[fmt, stack_depth]

    def compile(self, fmt, *, stack_depth=ChipConfig().stack_depth):
        """The CompiledScene for a format."""
        return CompiledScene(self.scene, fmt=fmt, stack_depth=stack_depth, **self._options)

    def drawn(self, config):
        """The model's frames by a chip.

        Raises
        ------
        SceneError, OverflowError
            If the scene does not fit the format or the stacks.
        """
        compiled, images = self.compiled(config.fmt, stack_depth=config.stack_depth)
        order = Order(engine="model", size=self.size, config=config, shading=self.shading, depth=self.depth)
        return [model_picture(order, image, camera, order.chip_for(compiled))
                for image, (_, camera) in zip(images, self.poses, strict=True)]

    def faults(self, config):
        """The :class:`Faults` of what a chip draws, or a text that says why it does not."""
        try:
            frames = self.drawn(config)
        except (SceneError, OverflowError) as error:
            return str(error)
        worst = None
        for frame, truth in zip(frames, self._truths, strict=True):
            found = truth.faults(frame)
            found = Faults(wrong=found["wrong_percent"], cracks=found["cracks"], phantoms=found["phantoms"],
                           psnr=truth.psnr(frame))
            worst = found if worst is None else worst.worst(found)
        return worst

    def other_pixels(self, depth):
        """Per cent of golden's pixels that differ by more than 8 levels of 255 at a ``depth`` of rays."""
        most = 0.0
        for truth, (posed, camera) in zip(self._truths, self.poses, strict=True):
            shallow = render_golden(posed, camera, *self.size, shading=self.shading, depth=depth).color
            differs = np.abs(shallow.astype(int) - truth.golden.color).max(axis=-1) > _FAR
            most = max(most, 100 * float(differs.mean()))
        return most
