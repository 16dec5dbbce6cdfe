"""A scene for a bitstream that has it in block RAM."""

import numpy as np

from boards.pins import BUILT_IN_SCALE_LOG2, BuiltInScene
from rtl.memory_ports import memory_ports
from sim.machine.machine import camera_words, memory_words
from sim.scene import load_scene
from sim.scene.compile import CompiledScene

from .errors import BadInput
from .view import orbit

__all__ = ["built_in_scene"]

#: Cameras on the way round
_VIEWS = 32


def built_in_scene(name, config, *, mode):
    """A scene, flat, and cameras round what its own looks at.

    Parameters
    ----------
    name : str
        As ``dynrt render`` takes it.
    config : ChipConfig
        The chip.
    mode : VideoMode
        Of the screen.

    Raises
    ------
    BadInput
        If the chip has a shader, whose records are of one view.
    """
    if config.shader is not None:
        raise BadInput("--scene: a chip with its scene in block RAM draws simple shading; use a --chip without a "
                       "shader")
    scene = load_scene(name)
    compiled = CompiledScene(scene, fmt=config.fmt, stack_depth=config.stack_depth, index_width=config.index_width,
                             flatten=True)
    camera = scene.default_camera()
    image = compiled.image(scene, eye=camera.eye)
    views = [camera_words(image, orbit(camera, number, _VIEWS), mode.width >> BUILT_IN_SCALE_LOG2)
             for number in range(_VIEWS)]
    return BuiltInScene(
        memories={port: np.ravel(memory_words(image, port, config)).tolist() for port in memory_ports(config)},
        cameras=[sum(int(word) << 32 * place for place, word in enumerate(words)) for words in views],
        root=image.root, background=0)
