"""The look of a surface, as the fixed-function shader knows it (docs/shading.md, sections 4 and 6)."""

import math
from dataclasses import dataclass

from .error import SceneError
from .texture import Texture

__all__ = ["ALPHA_MODES", "DEFAULT_MATERIAL", "MAX_SHININESS_LOG2", "Material"]

ALPHA_MODES = ("opaque", "mask", "blend")
MAX_SHININESS_LOG2 = 10


@dataclass(frozen=True)
class Material:
    """Look of a surface.

    Parameters
    ----------
    name : str
    base_color : tuple of 3 floats
        Diffuse colour, linear RGB within 0…1; also the tint of metals and of what is seen through glass.
    texture : Texture, optional
        Multiplies base_color and opacity.
    emission : tuple of 3 floats
        Light that it gives off, linear RGB within 0…1.
    specular : float
        Strength of highlights, 0…1.
    shininess : float
        Exponent of highlights; the shader takes the nearest power of two from 1 to 1024.
    reflection : float
        Part of the light that is mirrored, 0…1; with ``fresnel`` that at right angles.
    fresnel : bool
        Mirrors more where the ray grazes (Schlick).
    tinted : bool
        Highlights and mirrored light take the base colour, as with metals.
    transmission : float
        Part of what is not mirrored that goes through, refracted, 0…1.
    ior : float
        Index of refraction inside, with outside 1.
    thin : bool
        What goes through is not refracted: a pane of a single sheet.
    opacity : float
        0…1, multiplied by the texture's.
    alpha_mode : str
        ``opaque``: opacity is ignored; ``mask``: all or nothing, by ``alpha_cutoff``; ``blend``: as it is.
    alpha_cutoff : float
        Opacity from which ``mask`` is there, 0…1.

    Raises
    ------
    SceneError
        For a value out of its range.
    """

    name: str
    base_color: tuple[float, float, float]
    texture: Texture | None = None
    emission: tuple[float, float, float] = (0.0, 0.0, 0.0)
    specular: float = 0.0
    shininess: float = 32.0
    reflection: float = 0.0
    fresnel: bool = False
    tinted: bool = False
    transmission: float = 0.0
    ior: float = 1.5
    thin: bool = False
    opacity: float = 1.0
    alpha_mode: str = "opaque"
    alpha_cutoff: float = 0.5

    def __post_init__(self):
        for field in ("specular", "reflection", "transmission", "opacity", "alpha_cutoff"):
            self._require(field, 0.0 <= getattr(self, field) <= 1.0, "within 0…1")
        for field in ("base_color", "emission"):
            color = getattr(self, field)
            self._require(field, len(color) == 3 and all(0.0 <= channel <= 1.0 for channel in color),
                          "three numbers within 0…1")
        self._require("ior", 0.0 < self.ior < math.inf, "positive")
        self._require("shininess", 0.0 <= self.shininess < math.inf, "not negative")
        self._require("alpha_mode", self.alpha_mode in ALPHA_MODES, " or ".join(ALPHA_MODES))

    def _require(self, field, holds, what):
        if not holds:
            raise SceneError(f"material '{self.name}': {field} must be {what}, not {getattr(self, field)}")

    @property
    def shininess_log2(self):
        """Logarithm of the exponent that the shader takes, 0…10."""
        return min(max(round(math.log2(max(self.shininess, 1.0))), 0), MAX_SHININESS_LOG2)


DEFAULT_MATERIAL = Material("default", (0.8, 0.8, 0.8))
