"""A scene as the arrays that the shading kernel reads, rounded to 8 bits where the rules say so."""

from typing import NamedTuple

import numpy as np

from .texture import DECODED

__all__ = ["ALPHA_BLEND", "ALPHA_MASK", "Lamps", "Looks", "Surfaces", "background_color", "lamps", "looks", "surfaces"]

_ALPHA_OPAQUE, ALPHA_MASK, ALPHA_BLEND = 0, 1, 2
_ALPHA = {"opaque": _ALPHA_OPAQUE, "mask": ALPHA_MASK, "blend": ALPHA_BLEND}
_KINDS = {"point": 0, "spot": 1, "directional": 2}


class Looks(NamedTuple):
    """Materials, and the textures they name.

    Parameters
    ----------
    base_color, emission : float64[M, 3]
    specular, reflection, transmission, opacity, cutoff, ior : float64[M]
    alpha : int64[M]
        0 opaque, 1 mask, 2 blend.
    fresnel, tinted, thin, solid : bool[M]
        ``solid``: lets no light through, wherever it is hit.
    squarings : int64[M]
        Logarithm of the highlight's exponent.
    texture : int64[M]
        Row in ``layout``, −1 for none.
    layout : int64[X, 4]
        Of each texture: where it starts in ``texels``, width, height, filtered.
    texels : uint8[K, 4]
    decoded : float64[256]
    """

    base_color: np.ndarray
    emission: np.ndarray
    specular: np.ndarray
    reflection: np.ndarray
    transmission: np.ndarray
    opacity: np.ndarray
    cutoff: np.ndarray
    ior: np.ndarray
    alpha: np.ndarray
    fresnel: np.ndarray
    tinted: np.ndarray
    thin: np.ndarray
    solid: np.ndarray
    squarings: np.ndarray
    texture: np.ndarray
    layout: np.ndarray
    texels: np.ndarray
    decoded: np.ndarray


class Surfaces(NamedTuple):
    """What triangles carry besides their corners.

    Parameters
    ----------
    material : int32[T]
        Of each triangle of all meshes, one mesh after the other.
    normals : float64[A, 3, 3]
        Of the corners, of all meshes that have them.
    uvs : float64[B, 3, 2]
        Likewise.
    bases : int64[I, 2]
        Where the normals and uvs of an instance's mesh start, −1 if it has none.
    """

    material: np.ndarray
    normals: np.ndarray
    uvs: np.ndarray
    bases: np.ndarray


class Lamps(NamedTuple):
    """Lights: colours times intensities, and the constants that falloff and cone need."""

    color: np.ndarray
    position: np.ndarray
    direction: np.ndarray
    nearest: np.ndarray
    fading: np.ndarray
    cone: np.ndarray
    kind: np.ndarray
    squarings: np.ndarray


def _bytes(values):
    return np.rint(255 * np.asarray(values, np.float64)) / 255


def _color_bytes(linear):
    """Linear colours as they are after being kept in sRGB-encoded bytes."""
    linear = np.asarray(linear, np.float64)
    encoded = np.where(linear <= 0.0031308, 12.92 * linear, 1.055 * np.maximum(linear, 0.0031308) ** (1 / 2.4) - 0.055)
    return DECODED[np.rint(255 * encoded).astype(np.int64)]


def looks(materials):
    """Looks of a list of Material."""
    textures = list({id(m.texture): m.texture for m in materials if m.texture is not None}.values())
    number = {id(texture): k for k, texture in enumerate(textures)}
    sizes = [texture.pixels.shape[0] * texture.pixels.shape[1] for texture in textures]
    layout = [(start, t.pixels.shape[1], t.pixels.shape[0], t.filtered)
              for start, t in zip(np.cumsum([0, *sizes])[:-1], textures, strict=True)]
    alpha = np.array([_ALPHA[m.alpha_mode] for m in materials])
    transmission = _bytes([m.transmission for m in materials])
    return Looks(
        base_color=_color_bytes([m.base_color for m in materials]),
        emission=_color_bytes([m.emission for m in materials]),
        specular=_bytes([m.specular for m in materials]), reflection=_bytes([m.reflection for m in materials]),
        transmission=transmission, opacity=_bytes([m.opacity for m in materials]),
        cutoff=_bytes([m.alpha_cutoff for m in materials]), ior=np.array([m.ior for m in materials], np.float64),
        alpha=alpha, fresnel=np.array([m.fresnel for m in materials]), tinted=np.array([m.tinted for m in materials]),
        thin=np.array([m.thin for m in materials]), solid=(alpha == _ALPHA_OPAQUE) & (transmission == 0),
        squarings=np.array([m.shininess_log2 for m in materials]),
        texture=np.array([-1 if m.texture is None else number[id(m.texture)] for m in materials]),
        layout=np.array(layout, np.int64).reshape(-1, 4),
        texels=np.concatenate([t.pixels.reshape(-1, 4) for t in textures] or [np.zeros((0, 4), np.uint8)]),
        decoded=DECODED)


def surfaces(scene):
    """Surfaces of a scene's meshes."""
    normals = [mesh.shading_normals for mesh in scene.meshes]

    def joined(parts, *shape):
        given = [part for part in parts if part is not None]
        starts = np.cumsum([0] + [0 if part is None else len(part) for part in parts])[:-1]
        starts = np.where([part is None for part in parts], -1, starts)
        return np.ascontiguousarray(np.concatenate(given or [np.zeros((0, *shape))]), np.float64), starts

    all_normals, normal_starts = joined(normals, 3, 3)
    uvs, uv_starts = joined([mesh.uvs for mesh in scene.meshes], 3, 2)
    uvs[~np.isfinite(uvs)] = 0.0
    mesh_of = np.array([instance.mesh for instance in scene.instances])
    return Surfaces(np.concatenate([mesh.material_ids for mesh in scene.meshes]).astype(np.int32), all_normals, uvs,
                    np.stack([normal_starts[mesh_of], uv_starts[mesh_of]], axis=1).astype(np.int64))


def lamps(lights):
    """Lamps of a list of Light."""
    def column(values, *shape):
        return np.array(values, np.float64).reshape(len(lights), *shape)

    color = column([light.color for light in lights], 3)
    most = color.max(axis=1, initial=0.0)
    hue = np.rint(255 * color / np.where(most > 0, most, 1.0)[:, None]) / 255
    with np.errstate(divide="ignore"):
        nearest, fading = (1 / column([getattr(light, name) for light in lights]) ** 2 for name in ("radius", "reach"))
    return Lamps(
        color=hue * (most * column([light.intensity for light in lights]))[:, None],
        position=column([light.position for light in lights], 3),
        direction=column([light.direction for light in lights], 3), nearest=nearest, fading=fading,
        cone=column([light.cone[:2] for light in lights], 2),
        kind=np.array([_KINDS[light.kind] for light in lights], np.int64),
        squarings=np.array([light.cone[2] if light.kind == "spot" else 0 for light in lights], np.int64))


def background_color(color):
    """Linear colour of three sRGB-encoded bytes."""
    return tuple(float(DECODED[level]) for level in color)

