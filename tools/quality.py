"""How well pictures are drawn, and how well they are wanted."""

import re
from dataclasses import asdict, dataclass, fields

__all__ = ["Faults", "Quality"]


@dataclass(frozen=True, kw_only=True)
class Faults:
    """What is wrong with a picture, or at most with any of several.

    Parameters
    ----------
    wrong : float
        Pixels that show another triangle than golden, in per cent.
    cracks, phantoms : int
        See :class:`~tools.chart_truth.Truth`.
    psnr : float
        In dB.
    """

    wrong: float
    cracks: int
    phantoms: int
    psnr: float

    def __str__(self):
        return f"{self.wrong:.3f} % wrong, {self.cracks} cracks, {self.phantoms} phantoms, {self.psnr:.1f} dB"

    def worst(self, other):
        """The worse of both in each respect."""
        return Faults(wrong=max(self.wrong, other.wrong), cracks=max(self.cracks, other.cracks),
                      phantoms=max(self.phantoms, other.phantoms), psnr=min(self.psnr, other.psnr))


@dataclass(frozen=True, kw_only=True)
class Quality:
    """Bounds of :class:`Faults`; None for none.

    Parameters
    ----------
    wrong, cracks, phantoms, psnr
        At most, of ``psnr`` at least.
    """

    wrong: float | None = 0.1
    cracks: int | None = 0
    phantoms: int | None = None
    psnr: float | None = None

    @classmethod
    def parse(cls, text):
        """From ``"wrong=0.1,cracks=0"``; what is not named keeps its default, ``any`` bounds nothing.

        Raises
        ------
        ValueError
            If it is not that.
        """
        names, bounds = [field.name for field in fields(cls)], {}
        for part in text.split(","):
            name, _, value = (piece.strip() for piece in part.partition("="))
            if name not in names:
                raise ValueError(f"'{name}' is no quality; there are {', '.join(names)}, as in wrong=0.1,cracks=0")
            whole = name in ("cracks", "phantoms")
            if value != "any" and not re.fullmatch(r"\d+" if whole else r"\d+(\.\d+)?", value):
                what = "WHOLE NUMBER" if whole else "NUMBER"
                raise ValueError(f"'{part.strip()}' is not {name}={what} or {name}=any")
            bounds[name] = None if value == "any" else int(value) if whole else float(value)
        return cls(**bounds)

    def __str__(self):
        signs = {"psnr": "≥"}
        return ", ".join(f"{name} {signs.get(name, '≤')} {bound:g}{' %' if name == 'wrong' else ''}"
                         for name, bound in asdict(self).items() if bound is not None) or "any"

    def admits(self, faults):
        """Whether a picture is good enough."""
        return all(bound is None or (value >= bound if name == "psnr" else value <= bound)
                   for name, bound, value in ((name, bound, getattr(faults, name))
                                              for name, bound in asdict(self).items()))
