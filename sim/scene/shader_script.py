"""Shader scripts of Quake III: which picture a surface shows, and how it covers what is behind."""

import math
import re
from dataclasses import dataclass, field

__all__ = ["Shader", "Stage", "parse_shaders"]

_BLENDS = {"blend": ("gl_src_alpha", "gl_one_minus_src_alpha"), "add": ("gl_one", "gl_one"),
           "filter": ("gl_dst_color", "gl_zero")}
_COMMENT = re.compile(r"//[^\n]*|/\*.*?(?:\*/|\Z)", re.DOTALL)
_MAPS = ("map", "clampmap", "animmap")


@dataclass
class Stage:
    """A layer of a shader.

    Parameters
    ----------
    image : str or None
        Name of its picture; of several (animMap) the first. Those that begin with ``$`` are the game's own.
    blend : (str, str)
        Factors of the layer and of what is behind it.
    alpha : str or None
        Test of its opacity: ``gt0``, ``lt128`` or ``ge128``.
    scale : (float, float)
        Factors of the texture coordinates.
    odd : list of str
        Directives that change it in ways that are not drawn.
    """

    image: str | None = None
    blend: tuple[str, str] = ("gl_one", "gl_zero")
    alpha: str | None = None
    scale: tuple[float, float] = (1.0, 1.0)
    odd: list[str] = field(default_factory=list)

    @property
    def has_picture(self):
        """True if its picture is a file."""
        return self.image is not None and not self.image.startswith(("$", "*"))

    def take(self, words):
        """One line of the script, as words in lower case."""
        match words:
            case [key, *rest] if key in _MAPS:
                rest = rest[1:] if key == "animmap" else rest
                self.image = rest[0] if rest else None
                if key == "clampmap":
                    self.odd.append(key)
            case ["blendfunc", name] if name in _BLENDS:
                self.blend = _BLENDS[name]
            case ["blendfunc", source, behind, *_]:
                self.blend = source, behind
            case ["alphafunc", test, *_]:
                self.alpha = test
            case ["tcmod", "scale", s, t, *_]:
                self.scale = tuple(x * y for x, y in zip(self.scale, (_factor(s), _factor(t)), strict=True))
            case ["tcgen", "environment", *_]:
                self.odd.append("tcgen environment")


def _factor(word):
    try:
        value = float(word)
    except ValueError:
        return 1.0
    return value if math.isfinite(value) and abs(value) < 1e6 else 1.0


@dataclass
class Shader:
    """A surface's look.

    Parameters
    ----------
    name : str
    stages : list of Stage
        From the one behind to the one in front.
    odd : list of str
        Directives that change the surface in ways that are not drawn.
    """

    name: str
    stages: list[Stage] = field(default_factory=list)
    odd: list[str] = field(default_factory=list)

    def take(self, words):
        """One line of the script outside of the stages."""
        if words[0] == "deformvertexes":
            self.odd.append(" ".join(words[:2]))


def _lines(text):
    """Words of each line in lower case, without comments; braces stand alone."""
    text = _COMMENT.sub(" ", text).replace("{", "\n{\n").replace("}", "\n}\n").replace('"', " ")
    return (words for words in map(str.split, text.lower().splitlines()) if words)


def parse_shaders(text):
    """Shaders of a script, by name in lower case; of equal names the first counts.

    As in the game nothing in a script is an error: what is not understood changes nothing.

    Parameters
    ----------
    text : str
        ``name { directive … { directive of a stage … } … } …``
    """
    shaders, shader, stage, name, depth = {}, None, None, None, 0
    for words in _lines(text):
        if words == ["{"]:
            depth += 1
            if depth == 1:
                shader = Shader(name or "")
            elif depth == 2:
                stage = Stage()
        elif words == ["}"]:
            depth = max(depth - 1, 0)
            if depth == 1:
                shader.stages.append(stage)
            elif depth == 0 and shader is not None:
                shaders.setdefault(shader.name, shader)
                shader = name = None
        elif depth == 0:
            name = words[0].replace("\\", "/")
        elif depth == 1:
            shader.take(words)
        elif depth == 2:
            stage.take(words)
    return shaders
