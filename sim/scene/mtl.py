"""Wavefront MTL: the colours of an OBJ file's materials."""

import math

from .error import SceneError
from .files import inside
from .scene import Material

__all__ = ["load_mtl"]


def _color(where, words):
    try:
        color = tuple(float(word) for word in words[1:4])
    except ValueError as error:
        raise SceneError(f"{where}: {error}") from None
    if len(color) != 3 or not all(map(math.isfinite, color)):
        raise SceneError(f"{where}: '{words[0]}' needs three finite numbers")
    return tuple(min(max(channel, 0.0), 1.0) for channel in color)


def load_mtl(folder, name, warnings):
    """Materials of one MTL file; base_color is Kd, or where that is black, Ks (metals), or Ke (lamps).

    Parameters
    ----------
    folder : Path
        Folder of the OBJ file.
    name : str
        Argument of ``mtllib``.
    warnings : list of str
        Receives a sentence if the file is missing.

    Raises
    ------
    SceneError
        For a colour that is no colour, or a name that leads out of the folder.
    """
    path = inside(folder, name)
    if not path.is_file():
        warnings.append(f"{path}: material file is missing; default grey used")
        return []
    colors = {}
    current = None
    for number, line in enumerate(path.read_text(encoding="utf-8", errors="replace").splitlines(), start=1):
        words = line.split("#", 1)[0].split()
        match words:
            case ["newmtl", *_]:
                current = colors.setdefault(line.split(None, 1)[1].strip() if len(words) > 1 else "", {})
            case [("Kd" | "Ks" | "Ke") as key, *_]:
                if current is None:
                    raise SceneError(f"{path}:{number}: '{key}' before any newmtl")
                current[key] = _color(f"{path}:{number}", words)
    choices = {name: [color[key] for key in ("Kd", "Ks", "Ke") if any(color.get(key, ()))]
               for name, color in colors.items()}
    return [Material(name, choices[name][0] if choices[name] else color.get("Kd", (0.8, 0.8, 0.8)))
            for name, color in colors.items()]
