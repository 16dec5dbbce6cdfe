"""What a shader program is able to do."""

from dataclasses import dataclass, fields

__all__ = ["SWITCHES", "ShaderFeatures"]


@dataclass(frozen=True, kw_only=True)
class ShaderFeatures:
    """What is off takes no instruction, and its effect is not drawn.

    Parameters
    ----------
    reflection, refraction, transparency : bool
        The three kinds of secondary rays: of mirrors, of what light goes through, of what covers a part.
    textures : bool
        Pictures on surfaces.
    highlights : bool
        Specular highlights.
    fresnel, emission : bool
        Mirrors by angle, surfaces that shine.
    point_lights, spot_lights, directional_lights : bool
        Kinds of light.
    fading_lights : bool
        Lights that have a range.
    shadows : bool
        Shadow rays.
    sky : bool
        A picture in place of a background colour.
    instances : bool
        Normals are mapped from an instance's space.
    smooth : bool
        Interpolated normals.
    depth : int
        Generations of secondary rays, 0…16.

    Raises
    ------
    ValueError
        For a depth out of range, or refraction without reflection, which is needed where it is total.
    """

    reflection: bool = True
    refraction: bool = True
    transparency: bool = True
    textures: bool = True
    highlights: bool = True
    fresnel: bool = True
    emission: bool = True
    point_lights: bool = True
    spot_lights: bool = True
    directional_lights: bool = True
    fading_lights: bool = True
    shadows: bool = True
    sky: bool = True
    instances: bool = True
    smooth: bool = True
    depth: int = 4

    def __post_init__(self):
        if not 0 <= self.depth <= 16:
            raise ValueError(f"depth is {self.depth}; it must be from 0 to 16")
        if self.refraction and not self.reflection:
            raise ValueError("refraction needs reflection: where it is total, light is mirrored")

    def missing(self, needed):
        """Names of what ``needed`` (ShaderFeatures) has and this has not; a depth is no need."""
        return [name for name in SWITCHES if getattr(needed, name) and not getattr(self, name)]

    @property
    def shares(self):
        """Whether a surface may not keep all light for itself."""
        return self.reflection

    @property
    def clear(self):
        """Whether light may go through a surface."""
        return self.refraction or self.transparency

    @property
    def passes(self):
        """Whether rays go on beyond what they have hit, from a t_near that is not 0."""
        return self.transparency or (self.shadows and self.clear)

    @property
    def children(self):
        """Whether there are secondary rays."""
        return self.depth > 0 and (self.shares or self.transparency)

    @property
    def near_lights(self):
        """Whether there are lights at a place."""
        return self.point_lights or self.spot_lights


#: Names of what a shader may be able to do or not.
SWITCHES = tuple(field.name for field in fields(ShaderFeatures) if field.type is bool)
