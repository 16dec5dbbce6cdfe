"""Lights (docs/shading.md, section 5)."""

import math
from dataclasses import dataclass, replace

import numpy as np

from .error import SceneError

__all__ = ["MAX_LIGHTS", "Light"]

#: Lights that the shader has room for (paper, section 4.3).
MAX_LIGHTS = 256
_KINDS = ("point", "spot", "directional")


@dataclass(frozen=True, eq=False)
class Light:
    """A light; a white surface that it meets head-on at distance 1 gets the colour ``color`` × ``intensity``.

    Parameters
    ----------
    kind : str
        ``point``, ``spot`` or ``directional``.
    color : tuple of 3 floats
        Linear RGB, not negative.
    intensity : float
        Falls off as min(1/distance², 1/radius²); a directional light's stays.
    position : float64[3]
        Of point and spot lights, in world space.
    direction : float64[3]
        Into which a spot or directional light shines; any length.
    radius : float
        Distance within which it gets no brighter.
    reach : float
        Distance at which it fades to nothing, as glTF's ``range``: × max(0, 1 − (distance/reach)⁴).
    cone : (float, float, int)
        Scale, offset and number of squarings of a spot light: × clamp(cos·scale + offset)^(2^squarings), with cos
        between its direction and that to the point.
    name : str

    Raises
    ------
    SceneError
        For a value that is none of the above.
    """

    kind: str
    color: tuple[float, float, float] = (1.0, 1.0, 1.0)
    intensity: float = 1.0
    position: np.ndarray = (0.0, 0.0, 0.0)
    direction: np.ndarray = (0.0, 0.0, -1.0)
    radius: float = 0.0
    reach: float = math.inf
    cone: tuple[float, float, int] = (0.0, 1.0, 0)
    name: str = ""

    def __post_init__(self):
        who = f"light '{self.name}'" if self.name else "light"
        if self.kind not in _KINDS:
            raise SceneError(f"{who}: kind must be {', '.join(_KINDS)}, not '{self.kind}'")
        for field in ("position", "direction"):
            value = np.array(getattr(self, field), dtype=np.float64)
            if value.shape != (3,) or not np.isfinite(value).all():
                raise SceneError(f"{who}: {field} must be three finite numbers, not {getattr(self, field)}")
            object.__setattr__(self, field, value)
        length = np.linalg.norm(self.direction)
        if not 0.0 < length < math.inf:
            raise SceneError(f"{who}: direction is zero")
        object.__setattr__(self, "direction", self.direction / length)
        if len(self.color) != 3 or not all(0.0 <= channel < math.inf for channel in self.color):
            raise SceneError(f"{who}: color must be three finite numbers, not negative, not {self.color}")
        for field, most in (("intensity", False), ("radius", False), ("reach", True)):
            value = getattr(self, field)
            if not (0.0 <= value < math.inf or (most and value == math.inf)):
                raise SceneError(f"{who}: {field} must not be negative, it is {value}")

    @classmethod
    def spot(cls, position, direction, *, inner_angle, outer_angle, **others):
        """Spot light as glTF's: full inside ``inner_angle``, nothing outside ``outer_angle``, radians from the axis."""
        inner, outer = math.cos(inner_angle), math.cos(outer_angle)
        scale = 1.0 / max(inner - outer, 1e-3)
        return cls("spot", position=position, direction=direction, cone=(scale, -outer * scale, 1), **others)

    @classmethod
    def patch(cls, position, normal, **others):
        """A small piece of surface that shines by Lambert's law: × max(0, cos) from its normal."""
        return cls("spot", position=position, direction=normal, cone=(1.0, 0.0, 0), **others)

    @classmethod
    def headlight(cls, eye):
        """The light of scenes that have none: white, at the eye, without falloff, intensity 0.85."""
        # 2⁶⁰: beyond all scenes, and its square well within float64.
        return cls("point", position=eye, radius=2.0**60, intensity=0.85 * 2.0**120, name="headlight")

    def placed(self, matrix):
        """The light with its position and direction mapped by a 4×4 matrix."""
        direction = matrix[:3, :3] @ self.direction
        return replace(self, position=(matrix @ [*self.position, 1.0])[:3],
                       direction=direction if np.linalg.norm(direction) > 0 else self.direction)
