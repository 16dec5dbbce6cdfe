"""What rays see that meet nothing: a picture all around, on an octahedron (docs/shading.md, section 9)."""

from dataclasses import dataclass

import numpy as np

from .error import SceneError
from .srgb import decode, encode

__all__ = ["Sky", "octahedral_directions"]


def octahedral_directions(size):
    """Directions float64[size, size, 3] of the texels' centres, |x| + |y| + |z| = 1."""
    p = (2 * np.arange(size) + 1) / size - 1
    x, y = np.broadcast_arrays(p[None, :], p[:, None])
    z = 1 - np.abs(x) - np.abs(y)
    below = z < 0
    folded_x, folded_y = (1 - np.abs(y)) * np.where(x < 0, -1, 1), (1 - np.abs(x)) * np.where(y < 0, -1, 1)
    return np.stack([np.where(below, folded_x, x), np.where(below, folded_y, y), z], axis=-1)


@dataclass(frozen=True, eq=False)
class Sky:
    """Colours by direction.

    Parameters
    ----------
    pixels : uint8[N, N, 3]
        sRGB-encoded; N is a power of two. Texel (row, column) is seen in ``octahedral_directions(N)[row, column]``.

    Raises
    ------
    SceneError
        For another shape.
    """

    pixels: np.ndarray

    def __post_init__(self):
        shape = self.pixels.shape
        if len(shape) != 3 or shape[0] != shape[1] or shape[2] != 3 or shape[0] & (shape[0] - 1) or not shape[0] \
                or self.pixels.dtype != np.uint8:
            raise SceneError(f"sky must be uint8[N, N, 3] with N a power of two, not {self.pixels.dtype}{list(shape)}")

    @classmethod
    def of(cls, color, *, size=256):
        """Sky from a function of unit directions float64[…, 3] that gives linear RGB."""
        directions = octahedral_directions(size)
        linear = color(directions / np.linalg.norm(directions, axis=-1, keepdims=True))
        return cls(np.rint(255 * encode(linear)).astype(np.uint8))

    @classmethod
    def from_panorama(cls, pixels, *, up=(0.0, 0.0, 1.0), size=512):
        """Sky from an equirectangular picture uint8[H, W, 3], its upper edge at ``up``, its middle straight ahead.

        Ahead is +x where up is z, and −z where up is y (glTF's forward); sampled bilinearly.
        """
        up = np.asarray(up, np.float64) / np.linalg.norm(up)
        ahead = np.array((1.0, 0, 0)) if abs(up[2]) > 0.5 else np.array((0.0, 0, -1))
        ahead = ahead - (ahead @ up) * up
        ahead /= np.linalg.norm(ahead)
        right = np.cross(ahead, up)
        linear = decode(pixels[..., :3])
        height, width = linear.shape[:2]

        def color(directions):
            column = (np.arctan2(directions @ right, directions @ ahead) / (2 * np.pi) + 0.5) * width - 0.5
            row = np.arccos(np.clip(directions @ up, -1, 1)) / np.pi * height - 0.5
            x0, y0 = np.floor(column).astype(int), np.floor(row).astype(int)
            f, g = (column - x0)[..., None], (row - y0)[..., None]
            columns = x0 % width, (x0 + 1) % width
            rows = y0.clip(0, height - 1), (y0 + 1).clip(0, height - 1)
            upper, lower = ((1 - f) * linear[r, columns[0]] + f * linear[r, columns[1]] for r in rows)
            return (1 - g) * upper + g * lower

        return cls.of(color, size=size)

    @classmethod
    def gradient(cls, *, zenith, horizon, ground, up=(0.0, 0.0, 1.0), sun=None, sun_color=(1.0, 0.95, 0.8), size=512):
        """Clear sky: linear RGB at the zenith, the horizon and below it, and a glow round the direction of the sun."""
        up = np.asarray(up, np.float64) / np.linalg.norm(up)
        zenith, horizon, ground = (np.asarray(color, np.float64) for color in (zenith, horizon, ground))

        def color(directions):
            height = (directions @ up)[..., None]
            above = horizon + (zenith - horizon) * np.clip(height, 0, 1) ** 0.5
            result = np.where(height >= 0, above, ground + (horizon - ground) * np.exp(60 * np.minimum(height, 0)))
            if sun is not None:
                towards = np.clip(directions @ (np.asarray(sun) / np.linalg.norm(sun)), 0, 1)[..., None]
                result = result + np.asarray(sun_color) * (0.35 * towards**16 + 2.0 * towards**1024)
            return np.clip(result, 0, 1)

        return cls.of(color, size=size)
