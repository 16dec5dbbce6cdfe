"""Picture files: PNGs, and animations of several pictures as PNG or GIF."""

import numpy as np
from PIL import Image

from .errors import BadInput

__all__ = ["frame_durations", "save_animation", "save_picture"]

# What a file's times are given in, and the least that viewers keep to, in milliseconds.
_GIF_TICK, _GIF_LEAST = 10, 20


def frame_durations(count, seconds, *, is_gif):
    """Milliseconds that each of ``count`` pictures is shown, which together take ``seconds`` to within half a tick.

    Raises
    ------
    BadInput
        If a GIF's would be so short that viewers take more time.
    """
    tick = _GIF_TICK if is_gif else 1
    ends = np.rint(1000 * seconds / tick * np.arange(count + 1) / count)
    durations = (tick * np.diff(ends)).astype(int).tolist()
    if is_gif and min(durations) < _GIF_LEAST:
        raise BadInput(f"--frames: {count} pictures in {seconds:g} s are more than the {1000 // _GIF_LEAST} a second "
                       "that viewers of GIFs show; ask for fewer, or for a .png")
    return durations


def save_picture(path, color):
    """Writes uint8[H, W, 3] as a PNG."""
    Image.fromarray(color).save(path, format="PNG")


def save_animation(path, colors, durations):
    """Writes pictures uint8[H, W, 3] as an animation that repeats for ever.

    Parameters
    ----------
    path : path
        A name that ends in .gif for a GIF, whose pictures have 256 colours each; else it is an animated PNG.
    colors : list of uint8[H, W, 3]
    durations : list of int
        See :func:`frame_durations`.
    """
    pictures = [Image.fromarray(color) for color in colors]
    if path.suffix.lower() == ".gif":
        pictures = [picture.quantize(256, dither=Image.Dither.FLOYDSTEINBERG) for picture in pictures]
        options = {"format": "GIF", "disposal": 1}
    else:
        options = {"format": "PNG"}
    pictures[0].save(path, save_all=True, append_images=pictures[1:], duration=durations, loop=0, **options)
