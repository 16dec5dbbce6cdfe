"""The pinhole camera and the rays it sends through pixel centres."""

import math
from dataclasses import dataclass

import numpy as np

from .error import SceneError

__all__ = ["Camera"]

# Sine of the angle between view and up below which "right" is mostly rounding error.
_MIN_UP_SINE = 1e-6


@dataclass(frozen=True, eq=False)
class Camera:
    """Pinhole camera: pixel (px, py) looks along x·right + y·up + forward.

    Parameters
    ----------
    eye : array_like of 3 floats
        Origin of every ray, in world units.
    at : array_like of 3 floats
        Point in the middle of the picture.
    up : array_like of 3 floats
        Direction that appears upright; any length, not parallel to the view.
    hfov_deg : float
        Horizontal field of view, in degrees, within (0, 180).
    name : str
        Name in the scene file, may be empty.

    Raises
    ------
    SceneError
        If a number is not finite, ``at`` equals ``eye``, ``up`` is zero or parallel to the view, or the field
        of view is outside (0, 180).
    """

    eye: np.ndarray
    at: np.ndarray
    up: np.ndarray
    hfov_deg: float
    name: str = ""

    def __post_init__(self):
        who = f"camera '{self.name}'" if self.name else "camera"
        for field in ("eye", "at", "up"):
            value = np.array(getattr(self, field), dtype=np.float64)
            if value.shape != (3,) or not np.isfinite(value).all():
                raise SceneError(f"{who}: {field} must be three finite numbers, not {getattr(self, field)}")
            object.__setattr__(self, field, value)
        if not 0.0 < self.hfov_deg < 180.0:
            raise SceneError(f"{who}: horizontal field of view must be within (0, 180) degrees, "
                             f"not {self.hfov_deg:g}")
        view_length = np.linalg.norm(self.at - self.eye)
        if not 0.0 < view_length < math.inf:
            raise SceneError(f"{who}: zero direction: look-at point equals eye {tuple(self.eye.tolist())}")
        up_length = np.linalg.norm(self.up)
        if not 0.0 < up_length < math.inf:
            raise SceneError(f"{who}: up vector is zero")
        right = np.cross((self.at - self.eye) / view_length, self.up / up_length)
        if np.linalg.norm(right) < _MIN_UP_SINE:
            raise SceneError(f"{who}: up vector {tuple(self.up.tolist())} is parallel to the view direction")

    @classmethod
    def parse(cls, text):
        """Camera from ten comma-separated numbers: eye xyz, look-at xyz, up xyz, horizontal field of view."""
        try:
            numbers = [float(word) for word in text.split(",")]
        except ValueError as error:
            raise SceneError(f"camera '{text}': {error}") from None
        if len(numbers) != 10:
            raise SceneError(f"camera '{text}': {len(numbers)} numbers instead of ten "
                             "(eye xyz, look-at xyz, up xyz, horizontal field of view in degrees)")
        return cls(numbers[0:3], numbers[3:6], numbers[6:9], numbers[9])

    def basis(self):
        """Orthonormal ``(right, up, forward)``: right = forward × up, up = right × forward."""
        forward = self.at - self.eye
        forward = forward / np.linalg.norm(forward)
        right = np.cross(forward, self.up / np.linalg.norm(self.up))
        right /= np.linalg.norm(right)
        return right, np.cross(right, forward), forward

    def rays(self, width, height, *, shift=(0.0, 0.0)):
        """Rays through the pixel centres, directions not normalised (forward component 1).

        Parameters
        ----------
        width, height : int
            Size of the picture, in pixels.
        shift : (float, float)
            Right and down, in pixels: where instead of the centres they go through.

        Returns
        -------
        origin : float64[3]
        directions : float64[height, width, 3]
            Row 0 is the top of the picture.
        """
        right, up, forward = self.basis()
        half_width = math.tan(math.radians(self.hfov_deg) / 2)
        x = (2 * (np.arange(width) + 0.5 + shift[0]) / width - 1) * half_width
        y = (1 - 2 * (np.arange(height) + 0.5 + shift[1]) / height) * half_width * height / width
        directions = x[None, :, None] * right + y[:, None, None] * up + forward
        return self.eye.copy(), directions
