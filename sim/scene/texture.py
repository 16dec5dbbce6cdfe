"""Pictures on surfaces, and how they are read from files."""

import io
import warnings as python_warnings
from dataclasses import dataclass, replace

import numpy as np
from PIL import Image

from .error import SceneError
from .files import inside

__all__ = ["MAX_SIDE", "Texture", "TextureFiles", "decode_texture", "resampling_warning"]

#: Texels a side that the shader addresses.
MAX_SIDE = 4096
# What a file may claim before it is decoded: a few bytes must not take the machine's memory.
_MAX_PIXELS = 1 << 26
_FORMATS = ("PNG", "JPEG", "TGA", "BMP", "TIFF", "GIF", "WEBP", "DDS")


def _power_of_two(side):
    return 1 << max(side - 1, 0).bit_length()


@dataclass(frozen=True, eq=False)
class Texture:
    """A repeating picture (docs/shading.md, section 8).

    Parameters
    ----------
    name : str
    pixels : uint8[H, W, 4]
        Red, green, blue (sRGB-encoded) and opacity; the first row is at v = 0. Sides are powers of two.
    filtered : bool
        Bilinear, or the nearest texel.

    Raises
    ------
    SceneError
        If the sides are none that the shader addresses.
    """

    name: str
    pixels: np.ndarray
    filtered: bool = True

    def __post_init__(self):
        shape, dtype = self.pixels.shape, self.pixels.dtype
        if dtype != np.uint8 or len(shape) != 3 or shape[2] != 4 or any(
                side != _power_of_two(side) or side > MAX_SIDE for side in shape[:2]):
            raise SceneError(f"texture '{self.name}': must be uint8[height, width, 4] with sides that are powers of "
                             f"two up to {MAX_SIDE}, not {dtype}{list(shape)}")

    @property
    def has_holes(self):
        """True if some texel is not opaque."""
        return bool((self.pixels[..., 3] < 255).any())

    @property
    def is_cut_out(self):
        """True if nearly all texels are there or not there: opacity is an outline, not a veil."""
        alpha = self.pixels[..., 3]
        return bool(np.mean((alpha < 32) | (alpha > 223)) > 0.8)

    def without_opacity(self):
        """The same picture, opaque all over."""
        pixels = self.pixels.copy()
        pixels[..., 3] = 255
        return replace(self, pixels=pixels)

    def whitened(self):
        """A white picture of the same size and opacity."""
        pixels = self.pixels.copy()
        pixels[..., :3] = 255
        return replace(self, pixels=pixels)

    def with_opacity(self, other):
        """The same picture with another's opacity: its own fourth channel, else its brightness."""
        size = max(self.pixels.shape[1], other.pixels.shape[1]), max(self.pixels.shape[0], other.pixels.shape[0])
        color, veil = (np.asarray(Image.fromarray(texture.pixels).resize(size, Image.Resampling.BILINEAR))
                       if texture.pixels.shape[1::-1] != size else texture.pixels for texture in (self, other))
        alpha = veil[..., 3] if other.has_holes else veil[..., :3].mean(axis=-1).round().astype(np.uint8)
        return replace(self, pixels=np.concatenate([color[..., :3], alpha[..., None]], axis=-1))


def resampling_warning(resampled):
    """List of the one sentence about all pictures that were resampled, from their descriptions; empty if none was."""
    if not resampled:
        return []
    shown = ", ".join(resampled[:4]) + (f" and {len(resampled) - 4} more" if len(resampled) > 4 else "")
    return [f"textures resampled, as sides are powers of two up to {MAX_SIDE}: {shown}"]


def decode_texture(data, name, resampled, *, flip=False, filtered=True):
    """Texture from the bytes of an image file.

    Parameters
    ----------
    data : bytes
    name : str
        What messages call it.
    resampled : list of str
        Receives a description if the picture is resampled to sides that are powers of two.
    flip : bool
        Make the last row the one at v = 0, for formats whose v runs upwards.
    filtered : bool
        See :class:`Texture`.

    Raises
    ------
    SceneError
        If it is no image that can be read, or too large.
    """
    try:
        with python_warnings.catch_warnings():
            python_warnings.simplefilter("ignore")
            image = Image.open(io.BytesIO(data), formats=_FORMATS)
            width, height = image.size
            if width * height > _MAX_PIXELS:
                raise Image.DecompressionBombError
            if image.mode.startswith("I"):
                image = Image.fromarray((np.asarray(image).astype(np.int64).clip(0, 65535) >> 8).astype(np.uint8))
            image = image.convert("RGBA")
    except Image.DecompressionBombError:
        raise SceneError(f"texture '{name}': too many pixels; at most {_MAX_PIXELS:,} are read") from None
    # Decoders of damaged files raise whatever they stumble over.
    except Exception as error:
        text = "not a picture of a known format" if isinstance(error, Image.UnidentifiedImageError) else error
        raise SceneError(f"texture '{name}': cannot be read: {text}") from None
    size = tuple(min(_power_of_two(side), MAX_SIDE) for side in image.size)
    if size != image.size:
        resampled.append(f"{name} from {width}x{height} to {size[0]}x{size[1]}")
        image = image.resize(size, Image.Resampling.LANCZOS)
    if flip:
        image = image.transpose(Image.Transpose.FLIP_TOP_BOTTOM)
    return Texture(name, np.asarray(image).copy(), filtered)


class TextureFiles:
    """Reads the image files beside a scene, each once.

    Parameters
    ----------
    folder : Path
        The scene's folder; images may not lie outside.
    warnings : list of str
        Receives a sentence for each file that is missing.
    flip : bool
        See :func:`decode_texture`.
    """

    def __init__(self, folder, warnings, *, flip):
        self._folder, self._warnings, self._flip = folder, warnings, flip
        self._textures, self._resampled = {}, []

    def warnings(self):
        """What is to be said when all are read."""
        return resampling_warning(self._resampled)

    def load(self, name):
        """The texture in a file, or None (and a warning) if there is no such file.

        Raises
        ------
        SceneError
            If the name leads out of the folder, or the file is no picture.
        """
        if name not in self._textures:
            path = inside(self._folder, name)
            try:
                data = path.read_bytes()
            except OSError as error:
                self._warnings.append(f"texture '{name}': {error.strerror or error}; drawn without it")
                self._textures[name] = None
                return None
            self._textures[name] = decode_texture(data, name, self._resampled, flip=self._flip)
        return self._textures[name]
