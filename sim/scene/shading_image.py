"""What full shading reads: the records of the shading memory (their table is in rtl/program/records.py)."""

import numpy as np

from rtl.program.features import ShaderFeatures
from rtl.program.records import BEYOND, FIRST_MATRIX, MAX_CONE_SQUARINGS, FadeFlag, LightFlag, MaterialFlag
from rtl.srgb import COLOR_ONE, linear_colors

from .error import SceneError
from .light import Light
from .normals import flat_normals
from .srgb import encode
from .texels import pack_textures

__all__ = ["frame_records", "needed_features", "num_lights", "shading_records"]

# Ambient light of scenes that have no lights of their own.
_HEADLIGHTS_AMBIENT = 0.15

# Beyond that radius, in units of the chip's scene, a light is taken for one without falloff.
_FAR = 2.0**10

_LIGHT_FLAG_BITS, _FADE_FLAG_BITS = 3, 1 + MAX_CONE_SQUARINGS


def _byte(value):
    return int(np.rint(255 * value))


def _packed(values):
    first, second, third = (_byte(value) for value in values)
    return first << 16 | second << 8 | third


def _encoded(color):
    """Three encoded bytes of a linear colour."""
    return _packed(encode(np.asarray(color, np.float64)))


def _decoded(color):
    """The colours that three encoded bytes stand for."""
    word, table = _encoded(color), linear_colors()
    return [table[word >> shift & 255] for shift in (16, 8, 0)]


def needed_features(scene, *, instances, depth=4):
    """The least ShaderFeatures that draw all that is in a scene."""
    materials = [scene.materials[k] for k in
                 np.unique(np.concatenate([mesh.material_ids for mesh in scene.meshes])).tolist()]
    lights = scene.lights or [Light("point")]
    kinds = {light.kind for light in lights}

    def some(what):
        return any(what(material) for material in materials)

    return ShaderFeatures(
        # What cannot go through is mirrored.
        reflection=some(lambda m: _byte(m.reflection) > 0 or m.fresnel or _byte(m.transmission) > 0),
        refraction=some(lambda m: _byte(m.transmission) > 0),
        transparency=some(lambda m: m.alpha_mode != "opaque"),
        textures=some(lambda m: m.texture is not None) and any(mesh.uvs is not None for mesh in scene.meshes),
        highlights=some(lambda m: _byte(m.specular) > 0),
        fresnel=some(lambda m: m.fresnel), emission=some(lambda m: any(m.emission)),
        point_lights="point" in kinds, spot_lights="spot" in kinds, directional_lights="directional" in kinds,
        fading_lights=any(light.reach < np.inf and light.kind != "directional" for light in lights),
        shadows=True, sky=scene.sky is not None, instances=instances,
        smooth=any(mesh.normals is not None for mesh in scene.meshes), depth=depth)


def _flags(material, *, textured):
    squarings = material.shininess_log2
    clear, mirrors = _byte(material.transmission) > 0, _byte(material.reflection) > 0 or material.fresnel
    glossy, blends = _byte(material.specular) > 0, material.alpha_mode == "blend"
    local = _byte(material.transmission) < 255 and _byte(material.reflection) < 255
    bits = {
        MaterialFlag.TEXTURED: textured, MaterialFlag.ALPHA: material.alpha_mode != "opaque",
        MaterialFlag.MASK: material.alpha_mode == "mask", MaterialFlag.BLEND: blends,
        MaterialFlag.FRESNEL: material.fresnel, MaterialFlag.TINTED: material.tinted,
        MaterialFlag.CLEAR: clear, MaterialFlag.BENDS: clear and not material.thin,
        MaterialFlag.SHARES: clear or mirrors, MaterialFlag.GLOSSY: glossy, MaterialFlag.LIT: local or glossy,
        MaterialFlag.SHINES: any(material.emission), MaterialFlag.PARENT: clear or mirrors or blends,
        MaterialFlag.FORKS: clear or blends,
    }
    return sum(1 << flag for flag, is_set in bits.items() if is_set) | (1 << squarings) - 1 << MaterialFlag.SQUARINGS


class _Records:
    """Records as they are put together, each twelve fields."""

    def __init__(self, fmt, count):
        self.fmt = fmt
        self.fields = np.zeros((count, 12), np.int64)

    def floats(self, rows, first, values):
        """Floats into lanes from ``first`` on."""
        values = np.asarray(values, np.float64)
        self.fields[rows, first:first + values.shape[-1]] = self.fmt.encode(values)

    def integers(self, rows, first, values):
        """Integers into lanes from ``first`` on."""
        values = np.asarray(values)
        self.fields[rows, first:first + values.shape[-1]] = values


def _beyond(records, background, sky):
    table = linear_colors()
    records.integers(BEYOND, 0, [table[level] for level in background])
    records.integers(BEYOND, 3, sky)


def _with_flags(fmt, value, flags, bits):
    """A float's bits, with flags in the lowest of its fraction."""
    coarse = fmt.encode(value)
    step = 1 << bits
    most = fmt.encode(fmt.max)
    return int(min((coarse + step // 2) // step * step, most // step * step) | flags)


def _light(records, row, light, center, scale):
    fmt = records.fmt
    color = np.array(light.color, np.float64)
    most = color.max(initial=0.0)
    color = np.rint(255 * color / (most or 1.0)) / 255 * most * light.intensity
    directional, spot = light.kind == "directional", light.kind == "spot"
    if directional:
        records.floats(row, 0, light.direction)
        records.floats(row, 3, color)
        records.integers(row, 9, [1 << LightFlag.DIRECTIONAL])
        return
    radius, flags, fade_flags, fading = light.radius * scale, 0, 0, 0.0
    color = color * scale**2
    if radius > _FAR:
        # The product of both is what counts.
        color, radius = color * (_FAR / radius) ** 2, _FAR
    nearest = min(radius**-2.0 if radius else np.inf, fmt.max)
    if light.reach < np.inf:
        flags |= 1 << LightFlag.FADES
        fading = min((light.reach * scale) ** -2.0 if light.reach else np.inf, fmt.max)
    if spot:
        cone_scale, offset, squarings = light.cone
        flags |= 1 << LightFlag.SPOT
        if squarings > MAX_CONE_SQUARINGS:
            raise SceneError(f"light '{light.name}': its cone is squared {squarings} times, more than the "
                             f"{MAX_CONE_SQUARINGS} that the shader does")
        fade_flags = (cone_scale + offset > 1.0) << FadeFlag.CLAMPED | (1 << squarings) - 1 << FadeFlag.SQUARINGS
        records.floats(row, 6, light.direction * cone_scale)
        records.floats(row, 11, [offset])
    records.floats(row, 0, (light.position - center) * scale)
    records.floats(row, 3, color)
    records.integers(row, 9, [_with_flags(fmt, nearest, flags, _LIGHT_FLAG_BITS),
                              _with_flags(fmt, fading, fade_flags, _FADE_FLAG_BITS)])


def _material(records, row, material, descriptor):
    color = _decoded(material.base_color)
    textured = descriptor is not None
    records.integers(row, 0, color)
    records.integers(row, 3, [_flags(material, textured=textured), 0,
                              _packed((material.opacity, material.alpha_cutoff, 0.0))])
    records.integers(row, 6, [*(descriptor or (0, 0)), _encoded(material.emission)])
    records.floats(row, 9, [1.0 / material.ior, material.ior])
    records.integers(row, 11, [_packed((material.reflection, material.transmission, material.specular))])


def _triangles(records, scene, rows, mesh, prim, first, sign, linear, smooth_row, material_rows):
    """Records of triangles ``prim`` of a mesh, u = v = 0 at their corner ``first``, normals turned by ``sign``;
    ``linear``, if not None, brings them into the chip's space."""
    corner = (first[:, None] + np.arange(3)) % 3
    corners = mesh.vertices[mesh.triangles[prim]]
    turn = np.eye(3) if linear is None else np.linalg.inv(linear).T
    flat = flat_normals(corners) @ turn.T
    flat *= sign[:, None] / np.linalg.norm(flat, axis=1, keepdims=True)
    records.floats(rows, 0, flat)
    has_uvs = mesh.uvs is not None
    records.integers(rows, 5, material_rows[mesh.material_ids[prim], int(has_uvs)][:, None])
    if has_uvs:
        uvs = mesh.uvs[prim[:, None], corner]
        uvs = np.where(np.isfinite(uvs), uvs, 0.0)
        # Whole numbers do not matter, and leave fewer bits to the rest.
        uvs = uvs - np.floor(uvs.min(axis=1, keepdims=True))
        records.floats(rows, 3, uvs[:, 1] - uvs[:, 0])
        records.floats(rows, 6, uvs[:, 2] - uvs[:, 0])
        records.floats(rows, 9, uvs[:, 0])
    if smooth_row is None:
        return
    normals = mesh.shading_normals[prim[:, None], corner] @ turn.T
    normals *= sign[:, None, None] / np.abs(turn).max()
    smooth = np.arange(smooth_row, smooth_row + len(prim))
    records.integers(rows, 11, smooth[:, None])
    for k, column in enumerate((normals[:, 1] - normals[:, 0], normals[:, 2] - normals[:, 0], normals[:, 0])):
        records.floats(smooth, 3 * k, column)


def shading_records(scene, image, *, parts, background, num_slots):
    """The shading memory's records and the texture memory of a scene, but for what :func:`frame_records` has.

    Parameters
    ----------
    scene : Scene
    image : SceneImage
        Its geometry.
    parts : list of (Mesh, matrices, prims, firsts, signs, linear)
        Triangles: the numbers of their matrices, their numbers in the mesh, their corners at u = v = 0, the signs of
        their normals, and the map to the chip's space without
        its translation if they are in it, else None.
    background : tuple of int
        sRGB-encoded bytes.
    num_slots : int
        Frames whose lights have room.

    Returns
    -------
    records : int64[R, 12]
        The fields.
    texels : uint32[K]
    first_light : int
        The first slot's first light.
    """
    fmt, num_matrices = image.fmt, len(image.matrices)
    descriptors, sky, texels = pack_textures([material.texture for material in scene.materials], scene.sky)
    smooth = [mesh.normals is not None for mesh, *_ in parts]
    num_smooth = sum(len(prim) for (_, _, prim, *_), has in zip(parts, smooth, strict=True) if has)
    first_material = FIRST_MATRIX + num_matrices
    first_light = first_material + 2 * len(scene.materials)
    first_smooth = first_light + num_slots * num_lights(scene)
    count = first_smooth + num_smooth
    if count > 1 << 24:
        raise SceneError(f"scene needs {count:,} records of shading, more than the {1 << 24:,} that the shader "
                         "addresses; leave objects out")
    records = _Records(fmt, count)
    _beyond(records, background, sky)
    material_rows = first_material + np.arange(2 * len(scene.materials)).reshape(-1, 2)
    for number, material in enumerate(scene.materials):
        # As it is on meshes without and with texture coordinates.
        _material(records, material_rows[number, 0], material, None)
        _material(records, material_rows[number, 1], material, descriptors[number])
    row = first_smooth
    for (mesh, matrices, prim, first, sign, linear), has_normals in zip(parts, smooth, strict=True):
        _triangles(records, scene, FIRST_MATRIX + matrices, mesh, prim, first, sign, linear,
                   row if has_normals else None,
                   material_rows)
        row += len(prim) if has_normals else 0
    return records.fields, texels, first_light


def num_lights(scene):
    """Lights of a scene in memory: without its own it has one at the eye."""
    return len(scene.lights) or 1


def frame_records(scene, *, fmt, center, scale, maps, first_light, eye):
    """The records that change from frame to frame.

    Parameters
    ----------
    scene : Scene
        As it stands in the frame.
    fmt : FloatFormat
    center : float64[3]
    scale : float
        The chip's scene coordinates are (world − center) · scale.
    maps : float64[I, 4, 3]
        The instances' matrices.
    first_light : int
        Number of the frame's first light.
    eye : float64[3]
        Where the headlight of a scene without lights is.

    Returns
    -------
    instances : int64[I, 12]
    lights : int64[L, 12]
    about_lights : int64[1, 12]
        Record 0.
    """
    lights = _Records(fmt, num_lights(scene))
    for number, light in enumerate(scene.lights or [Light.headlight(eye)]):
        _light(lights, number, light, center, scale)
    linear = maps[:, :3].reshape(-1, 9)
    instances = _Records(fmt, len(linear))
    if len(linear):
        # Normals are made unit vectors afterwards; so any scale will do.
        instances.floats(np.arange(len(linear)), 0,
                         linear * 2.0 ** -np.floor(np.log2(np.abs(linear).max(axis=1, keepdims=True))))
    ambient = scene.ambient
    if not scene.lights and not any(ambient):
        ambient = (_HEADLIGHTS_AMBIENT,) * 3
    most = max(ambient)
    ambient = np.rint(255 * np.array(ambient) / most) / 255 * most if most else np.zeros(3)
    about = _Records(fmt, 1)
    about.integers(0, 0, np.minimum(np.rint(ambient * COLOR_ONE), (1 << 24) - 1).astype(np.int64))
    about.integers(0, 9, [first_light, first_light + num_lights(scene)])
    return instances.fields, lights.fields, about.fields
