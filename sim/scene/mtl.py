"""Wavefront MTL: the materials of an OBJ file."""

import math
import re
from dataclasses import dataclass, field

from .error import SceneError
from .files import inside
from .material import Material

__all__ = ["load_mtl"]

_COLORS = ("Kd", "Ks", "Ke", "Tf")
_NUMBERS = {"Ns": (0.0, 1e6), "Ni": (1e-3, 1e3), "d": (0.0, 1.0), "Tr": (0.0, 1.0)}
_MAPS = ("map_Kd", "map_d")
# Arguments that each option of a texture line takes; what they do to the picture is not drawn.
_MAP_OPTIONS = {"-blendu": 1, "-blendv": 1, "-boost": 1, "-mm": 2, "-o": 3, "-s": 3, "-t": 3, "-texres": 1, "-clamp": 1,
                "-bm": 1, "-imfchan": 1, "-type": 1, "-cc": 1}
_NOT_DRAWN = ("map_Ks", "map_Ke", "map_Ns", "map_Bump", "map_bump", "bump", "norm", "disp", "decal", "refl", "map_Pr",
              "map_Pm")
# Illumination models of which the surface mirrors, lets light through, and does either more where the ray grazes.
_MIRRORS, _GLASS, _FRESNEL = (3, 4, 5, 6, 7, 8, 9), (4, 6, 7, 9), (4, 5, 6, 7, 9)


@dataclass
class _Entry:
    values: dict = field(default_factory=dict)
    textures: dict = field(default_factory=dict)


def _color(where, words):
    try:
        color = tuple(float(word) for word in words[1:4])
    except ValueError as error:
        raise SceneError(f"{where}: {error}") from None
    if len(color) != 3 or not all(map(math.isfinite, color)):
        raise SceneError(f"{where}: '{words[0]}' needs three finite numbers")
    return tuple(min(max(channel, 0.0), 1.0) for channel in color)


def _number(where, words):
    # Of '-halo' and the like the number comes last.
    try:
        value = float(words[-1]) if len(words) > 1 else math.nan
    except ValueError as error:
        raise SceneError(f"{where}: {error}") from None
    if not math.isfinite(value):
        raise SceneError(f"{where}: '{words[0]}' needs a finite number")
    return min(max(value, _NUMBERS[words[0]][0]), _NUMBERS[words[0]][1])


def _file_name(words, odd):
    """The file that a texture line names, after its options."""
    position = 1
    while position < len(words) and words[position] in _MAP_OPTIONS:
        odd.add(f"option {words[position]} of {words[0]}")
        wanted = _MAP_OPTIONS[words[position]]
        position += 1
        for taken in range(wanted):
            # Of vectors the second and third number may be missing.
            if taken and not (position < len(words) and _is_number(words[position])):
                break
            position += 1
    return " ".join(words[position:])


def _is_number(word):
    try:
        float(word)
    except ValueError:
        return False
    return True


def _material(name, entry):
    """The shader's material for MTL's Kd, Ks, Ke, Tf, Ns, Ni, d (or 1 − Tr) and illumination model."""
    values = entry.values
    illum = values.get("illum", 2)
    choices = [values[key] for key in ("Kd", "Ks", "Ke") if any(values.get(key, ()))]
    base_color = choices[0] if choices else values.get("Kd", (0.8, 0.8, 0.8))
    opacity = values.get("d", 1.0 - values.get("Tr", 0.0))
    specular = max(values.get("Ks", (0.0,)))
    common = dict(emission=values.get("Ke", (0.0,) * 3), shininess=values.get("Ns", 32.0))
    is_metal = illum in _MIRRORS and illum not in _GLASS and base_color == values.get("Ks")
    if illum in _GLASS and (opacity < 1 or "Tf" in values):
        filtered = values.get("Tf", (1.0,) * 3)
        return Material(name, filtered if any(filtered) else base_color, specular=specular, reflection=specular,
                        fresnel=True, transmission=1.0 - opacity if opacity < 1 else 1.0, ior=values.get("Ni", 1.5),
                        thin=illum in (4, 9) and "Ni" not in values, **common)
    texture, mode = entry.textures.get("map_Kd"), "opaque"
    veil = entry.textures.get("map_d")
    if veil is not None:
        texture = (texture or veil.whitened()).with_opacity(veil)
        mode = "mask" if texture.is_cut_out and opacity == 1 else "blend"
    elif opacity < 1:
        mode, texture = "blend", texture.without_opacity() if texture else None
    reflection = (1.0 if is_metal else specular) if illum in _MIRRORS and specular else 0.0
    return Material(name, base_color, texture, specular=0.5 if is_metal else specular if illum >= 2 else 0.0,
                    reflection=reflection, tinted=is_metal, fresnel=illum in _FRESNEL and not is_metal,
                    opacity=opacity, alpha_mode=mode, **common)


def load_mtl(folder, name, textures, warnings):
    """Materials of one MTL file.

    base_color is Kd, or where that is black, Ks (metals), or Ke (lamps). From illumination model 3 on surfaces mirror
    by Ks; models 4, 6, 7 and 9 are glass where d < 1 or Tf is given. Elsewhere d < 1 is a veil.

    Parameters
    ----------
    folder : Path
        Folder of the OBJ file.
    name : str
        Argument of ``mtllib``.
    textures : TextureFiles
    warnings : list of str
        Receives a sentence if the file is missing, and one for what cannot be drawn.

    Raises
    ------
    SceneError
        For a colour that is no colour, or a name that leads out of the folder.
    """
    path = inside(folder, name)
    if not path.is_file():
        warnings.append(f"{path}: material file is missing; default grey used")
        return []
    entries, current, odd = {}, None, set()
    for number, line in enumerate(path.read_text(encoding="utf-8", errors="replace").splitlines(), start=1):
        words, where = line.split("#", 1)[0].split(), f"{path}:{number}"
        if not words:
            continue
        key = words[0]
        if key == "newmtl":
            title = line.split("#", 1)[0].split(None, 1)[1].strip() if len(words) > 1 else ""
            current = entries.setdefault(title, _Entry())
        elif key in (*_COLORS, *_NUMBERS, *_MAPS, "illum"):
            if current is None:
                raise SceneError(f"{where}: '{key}' before any newmtl")
            if key in _MAPS:
                current.textures[key] = textures.load(_file_name(words, odd))
            elif key == "illum":
                current.values[key] = int(words[1]) if len(words) > 1 and re.fullmatch("[0-9]{1,2}", words[1]) else 2
            else:
                current.values[key] = (_color if key in _COLORS else _number)(where, words)
        elif key in _NOT_DRAWN:
            odd.add(key)
    if odd:
        warnings.append(f"{path}: cannot be drawn, left out: {', '.join(sorted(odd))}")
    return [_material(title, entry) for title, entry in entries.items()]
