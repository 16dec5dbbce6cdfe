"""The narrowest formats that draw pictures well enough, each with the arithmetic that it needs for that."""

from dataclasses import dataclass, field

from fpu import FloatFormat
from rtl.arithmetic import NUMBERS

__all__ = ["VARIANTS", "Candidate", "FormatSearch"]

#: Ways to compute that draw different pictures: parameters of a chip by name.
VARIANTS = {"separate": {"edge_tolerance": 0}, **{f"tolerant {ulp}": {"edge_tolerance": ulp} for ulp in (1, 2, 4, 8)},
            **{name: {"arithmetic": NUMBERS[name], "edge_tolerance": 0} for name in ("fused-narrow", "truncated")}}
_EXPONENTS, _FRACTIONS = range(5, 9), range(10, 24)
#: Fraction bits in which exponents are compared: enough for all scenes of the chart.
_AMPLE = 20
#: Fraction bits over the narrowest format that are tried in the other ways to compute.
_FURTHER = 1


@dataclass(frozen=True, kw_only=True)
class Candidate:
    """A format and a way to compute that draw well enough.

    Parameters
    ----------
    fmt : FloatFormat
    variant : str
        One of :data:`VARIANTS`.
    faults : Faults
    """

    fmt: FloatFormat
    variant: str
    faults: object

    def __str__(self):
        return f"{self.fmt} {self.variant}"


@dataclass(frozen=True, eq=False)
class FormatSearch:
    """Tries formats from narrow to wide.

    First the exponent: the narrowest with which pictures are no worse than with the widest. Then, with that, every
    number of fraction bits from below, in every way to compute, until one is good enough and so is the next wider
    format: more bits are not always better, and one that is good by chance is not taken. The others are tried up to one
    bit further. In the end one exponent bit less is tried once more, at the formats that were found.

    Parameters
    ----------
    faults_of : callable
        ``faults_of(fmt, variant)``: the Faults, or a text if the scene does not fit.
    quality : Quality
    most_bits : int
        Fraction bits that the chip can be built with; wider ones are drawn, but not taken.
    variants : dict
        As :data:`VARIANTS`.
    tell : callable
        Is told of each measurement.
    """

    faults_of: object
    quality: object
    most_bits: int = _FRACTIONS[-1]
    variants: dict = field(default_factory=lambda: VARIANTS)
    tell: object = print
    tried: dict = field(default_factory=dict)

    def run(self):
        """The Candidates, at most one a variant, narrowest first; none if nothing is good enough."""
        exponent = self._exponent()
        found, last = {}, self.most_bits
        for fraction in _FRACTIONS:
            good = [variant for variant in self.variants
                    if variant not in found and self._is_good(exponent, fraction, variant)]
            for variant in good:
                if fraction == _FRACTIONS[-1] or self._is_good(exponent, fraction + 1, variant):
                    found[variant] = fraction
                    last = min(last, fraction + _FURTHER)
            if fraction >= last:
                break
        candidates = []
        for variant, fraction in found.items():
            narrow = exponent
            while narrow > _EXPONENTS[0] and self._is_good(narrow - 1, fraction, variant) and self._is_good(
                    narrow - 1, min(fraction + 1, _FRACTIONS[-1]), variant):
                narrow -= 1
            candidates.append(Candidate(fmt=FloatFormat(narrow, fraction), variant=variant,
                                        faults=self.tried[narrow, fraction, variant]))
        return sorted(candidates, key=lambda candidate: candidate.fmt.width)

    def best(self):
        """Of all that was tried what comes nearest, as (format, variant, Faults), or None."""
        drawn = [(FloatFormat(exponent, fraction), variant, faults)
                 for (exponent, fraction, variant), faults in self.tried.items() if not isinstance(faults, str)]
        return min(drawn, key=lambda one: (one[2].cracks, one[2].wrong), default=None)

    def _exponent(self):
        widest = self._faults(_EXPONENTS[-1], _AMPLE, "separate")
        for exponent in _EXPONENTS[:-1]:
            faults = self._faults(exponent, _AMPLE, "separate")
            if isinstance(widest, str):
                break
            if not isinstance(faults, str) and faults.worst(widest) == widest:
                return exponent
        return _EXPONENTS[-1]

    def _is_good(self, *place):
        faults = self._faults(*place)
        return not isinstance(faults, str) and self.quality.admits(faults)

    def _faults(self, exponent, fraction, variant):
        place = exponent, fraction, variant
        if place not in self.tried:
            self.tried[place] = self.faults_of(FloatFormat(exponent, fraction), variant)
            self.tell(f"{exponent}.{fraction} {variant}: {self.tried[place]}")
        return self.tried[place]
