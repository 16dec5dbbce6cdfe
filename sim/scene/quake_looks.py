"""Materials of Quake III: pictures by way of shader scripts, as far as the fixed-function shader draws them."""

from dataclasses import replace

import numpy as np

from .error import SceneError
from .material import DEFAULT_MATERIAL, Material
from .pk3 import read_text
from .shader_script import parse_shaders
from .srgb import decode, encode
from .texture import decode_texture, resampling_warning

__all__ = ["QuakeLooks"]

_SUFFIXES = (".tga", ".jpg", ".jpeg", ".png")
_MAX_TEXELS = 1 << 26
_MAX_SCRIPTS = 1 << 22
_SHOWN = 4
_CUTOFFS = {"gt0": 1 / 255, "ge128": 128 / 255, "lt128": 128 / 255}


def _stem(name):
    """A picture's name without its ending, in the form that archives compare."""
    name = name.replace("\\", "/").lower()
    return next((name[:-len(suffix)] for suffix in _SUFFIXES if name.endswith(suffix)), name)


def _as_veil(texture):
    """The picture of which a veil adds as much light as this one would if it were added.

    Opacity o is the greatest of the colour's channels c, linear, and the colour c/o, so that o·c/o = c; but what is
    behind is dimmed by 1 − o.
    """
    light = decode(texture.pixels[..., :3])
    opacity = light.max(axis=-1, keepdims=True)
    color = encode(light / np.maximum(opacity, 1e-9))
    return replace(texture, pixels=np.rint(255 * np.concatenate([color, opacity], axis=-1)).astype(np.uint8))


def _changed(texture, channels):
    """The picture with some channels turned over."""
    pixels = texture.pixels.copy()
    pixels[..., channels] = 255 - pixels[..., channels]
    return replace(texture, pixels=pixels)


def _filter(name, texture):
    """What is behind is seen through the picture, as through coloured glass."""
    return Material(name, (1.0, 1.0, 1.0), texture, transmission=1.0, thin=True)


class QuakeLooks:
    """Reads the materials that surfaces name, each once.

    A surface shows the first picture of its shader, covering what is behind as the shader's first stage does: not at
    all if that is blended, wholly or not by its alpha test, as a veil, as a filter, or (an added stage) as a veil of
    the picture's brightness. A surface without a shader shows the picture of its name. What moves stands as at time 0.

    Parameters
    ----------
    archive : Archive

    Raises
    ------
    SceneError
        If a script cannot be unpacked, or there is too much of them.
    """

    def __init__(self, archive):
        self._archive = archive
        self._textures, self._resampled, self._odd, self._texels = {}, [], {}, 0
        self._shaders = {}
        size = 0
        for name in archive.names("scripts", ".shader"):
            text = read_text(archive, name)
            size += len(text)
            if size > _MAX_SCRIPTS:
                raise SceneError(f"{name}: with it there are more than {_MAX_SCRIPTS:,} bytes of shader scripts")
            self._shaders = parse_shaders(text) | self._shaders

    def warnings(self):
        """What is to be said when all are read: at most two sentences."""
        parts = []
        for what, names in self._odd.items():
            more = f" and {len(names) - _SHOWN} more" if len(names) > _SHOWN else ""
            parts.append(f"{what}: {', '.join(list(names)[:_SHOWN])}{more}")
        return ([f"not drawn as the game does: {'; '.join(parts)}"] if parts else []) + resampling_warning(
            self._resampled)

    def _note(self, what, name):
        self._odd.setdefault(what, {})[name] = True

    def _texture(self, name):
        """The picture of a name, whatever its ending; None if there is none."""
        stem = _stem(name)
        if stem not in self._textures:
            path = next((stem + suffix for suffix in _SUFFIXES if stem + suffix in self._archive), None)
            texture = None
            if path is not None:
                texture = decode_texture(self._archive.read(path), path, self._resampled)
                self._texels += texture.pixels.shape[0] * texture.pixels.shape[1]
                if self._texels > _MAX_TEXELS:
                    raise SceneError(f"texture '{path}': with it there are more than {_MAX_TEXELS:,} texels")
            self._textures[stem] = texture
        return self._textures[stem]

    def picture(self, name):
        """Name of the picture that a surface shows, None if its shader has none."""
        shader = self._shaders.get(_stem(name))
        if shader is None:
            return _stem(name)
        return next((_stem(stage.image) for stage in shader.stages if stage.has_picture), None)

    def material(self, name):
        """``(material, scale of texture coordinates)`` of a surface, or None if its shader draws nothing.

        Raises
        ------
        SceneError
            If its picture is none, or pictures have too many texels.
        """
        shader, image = self._shaders.get(_stem(name)), self.picture(name)
        if image is None:
            self._note("without a picture, left out", name)
            return None
        texture = self._texture(image)
        if texture is None:
            self._note("without its picture, in grey", name)
            return replace(DEFAULT_MATERIAL, name=name), (1.0, 1.0)
        if shader is None:
            return Material(name, (1.0, 1.0, 1.0), texture), (1.0, 1.0)
        stage = next(stage for stage in shader.stages if stage.has_picture)
        for odd in (*shader.odd, *stage.odd):
            self._note(odd, name)
        return self._covering(name, texture, shader.stages[0]), stage.scale

    def _covering(self, name, texture, stage):
        white = (1.0, 1.0, 1.0)
        if stage.alpha in _CUTOFFS:
            texture = _changed(texture, slice(3, 4)) if stage.alpha == "lt128" else texture
            return Material(name, white, texture, alpha_mode="mask", alpha_cutoff=_CUTOFFS[stage.alpha])
        match stage.blend:
            case ("gl_one", "gl_zero"):
                return Material(name, white, texture)
            case ("gl_src_alpha" | "gl_one", "gl_one_minus_src_alpha"):
                return Material(name, white, texture, alpha_mode="blend" if texture.has_holes else "opaque")
            case ("gl_dst_color", "gl_zero") | ("gl_zero", "gl_src_color"):
                return _filter(name, texture)
            case ("gl_zero", "gl_one_minus_src_color"):
                return _filter(name, _changed(texture, slice(0, 3)))
            case (_, "gl_one"):
                self._note("added, as veils", name)
                return Material(name, white, _as_veil(texture), alpha_mode="blend")
        self._note(f"blendfunc {' '.join(stage.blend)}", name)
        return Material(name, white, texture)
