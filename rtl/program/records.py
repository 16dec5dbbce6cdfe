"""What lies where in the records of the shading memory, as the shader's program reads them.

A record is twelve lanes, which a LOAD puts into four registers:

==========  =================  ==============================  ==============================  =======================
record      register 0         1                               2                               3
==========  =================  ==============================  ==============================  =======================
lights      ambient light      0, 0, 0                         0, 0, 0                         first light, end, –
beyond      background         sky: base, size, –              –                               –
triangle    flat unit normal   s₁ − s₀, t₁ − t₀, material      s₂ − s₀, t₂ − t₀, –             s₀, t₀, smooth record
smooth      n₁ − n₀            n₂ − n₀                         n₀                              –
instance    row 0 of A⁻¹       row 1                           row 2                           –
material    colour             flags, –, opacity and cutoff    texture: base, size; emission   1/ior, ior; r₀, q, kₛ
light       position, or       colour × intensity              axis × cone's scale             1/radius², 1/reach²,
            direction                                                                          cone's offset
==========  =================  ==============================  ==============================  =======================

Record 0 is about all lights, 1 about what is beyond the scene; record 2 + m is that of matrix m, an instance's or a
triangle's; the numbers of all others stand in those. A smooth record of 0 is none. Positions, normals, texture
coordinates, ior and lights are floats, ambient light and colours of background and material have 16 fraction bits, and
opacity, cutoff; emission; r₀, q, kₛ are bytes, the first the most significant. The flags of lights are in the lowest
fraction bits of the floats 1/radius² and 1/reach².
"""

from amaranth.lib import enum

__all__ = ["BEYOND", "FIRST_MATRIX", "MAX_CONE_SQUARINGS", "FadeFlag", "LightFlag", "MaterialFlag"]

#: Record of what is beyond the scene.
BEYOND = 1

#: Record of matrix 0.
FIRST_MATRIX = 2

#: Times that a cone's cosine can be squared.
MAX_CONE_SQUARINGS = 3


class MaterialFlag(enum.IntEnum):
    """Bits of a material's flags."""

    #: It has a texture.
    TEXTURED = 0
    #: Its opacity matters: alpha mode mask or blend.
    ALPHA = 1
    #: Alpha mode mask.
    MASK = 2
    #: Alpha mode blend.
    BLEND = 3
    #: Mirrors by angle.
    FRESNEL = 4
    #: Mirrored light and highlights are tinted.
    TINTED = 5
    #: Light goes through.
    CLEAR = 6
    #: What goes through is bent.
    BENDS = 7
    #: Something is mirrored or goes through.
    SHARES = 8
    #: It has highlights.
    GLOSSY = 9
    #: Lights matter to it.
    LIT = 10
    #: It shines.
    SHINES = 11
    #: It has children.
    PARENT = 12
    #: Besides a reflection ray it may have others.
    FORKS = 13
    #: The highlight's exponent is 2 to the number of ones from here up.
    SQUARINGS = 14


class LightFlag(enum.IntEnum):
    """Lowest bits of a light's 1/radius²."""

    DIRECTIONAL = 0
    SPOT = 1
    FADES = 2


class FadeFlag(enum.IntEnum):
    """Lowest bits of a light's 1/reach²; of the cone."""

    #: Its cosine may exceed 1.
    CLAMPED = 0
    #: It is squared as often as there are ones from here up.
    SQUARINGS = 1
