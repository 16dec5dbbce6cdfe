"""The chips whose area is compared, each with the one it is set beside."""

from dataclasses import dataclass, replace

from rtl.config import ChipConfig
from rtl.program.features import SWITCHES, ShaderFeatures

__all__ = ["CHIPS", "CLOCKED", "DETAILED", "SMALL", "Chip"]

#: Generations of secondary rays where there are any.
DEPTH = 4
#: What a feature does nothing, or cannot be had, without.
NEEDS = {"refraction": "reflection", "fresnel": "reflection", "fading_lights": "point_lights"}
#: What sends secondary rays, and so needs a depth.
SENDING = {"reflection", "refraction", "transparency"}


@dataclass(frozen=True, kw_only=True)
class Chip:
    """A chip to measure.

    Parameters
    ----------
    name : str
        In the table.
    beside : str or None
        Name of the chip that its area is compared with.
    config : ChipConfig
        What it is built with.
    """

    name: str
    beside: str | None = None
    config: ChipConfig


def _with(*features):
    """The least shader, which has a directional light and no more, with ``features``."""
    switches = dict.fromkeys(SWITCHES, False) | dict.fromkeys(("directional_lights", *features), True)
    return ChipConfig(edge_tolerance=0,
                      shader=ShaderFeatures(**switches, depth=DEPTH if SENDING.intersection(features) else 0))


def _words(feature):
    return feature.replace("_", " ")


def _chips():
    least, everything = "least shader", "everything"
    whole = ChipConfig(edge_tolerance=0, shader=ShaderFeatures(depth=DEPTH))
    simple = ChipConfig(edge_tolerance=0)
    yield Chip(name="simple", config=simple)
    yield Chip(name="simple + edge tolerance", beside="simple", config=ChipConfig())
    yield Chip(name=least, beside="simple", config=_with())
    for feature in SWITCHES:
        if feature == "directional_lights":
            continue
        needed = NEEDS.get(feature)
        base = f"{least} + {_words(needed)}" if needed else least
        yield Chip(name=f"{base} + {_words(feature)}", beside=base,
                   config=_with(*filter(None, (needed, feature))))
    yield Chip(name=everything, beside=least, config=whole)
    # The least shader has these.
    yield Chip(name=f"{everything} without directional lights", beside=everything,
               config=replace(whole, shader=replace(whole.shader, directional_lights=False)))
    yield Chip(name=f"{everything} without secondary rays", beside=everything,
               config=replace(whole, shader=replace(whole.shader, depth=0)))
    for shaders in (2, 4):
        yield Chip(name=f"{everything}, {shaders} shaders", beside=everything,
                   config=replace(whole, num_shaders=shaders))
    yield Chip(name=f"{everything}, 2 pipelines", beside=everything, config=replace(whole, num_pipelines=2))
    yield Chip(name=SMALL, beside=everything, config=replace(whole, num_threads=32))


#: With half the threads, whose registers the block RAMs of an LFE5U-85F can hold.
SMALL = "everything, 32 threads"
#: In the table's order
CHIPS = {chip.name: chip for chip in _chips()}
#: Whose units are listed.
DETAILED = ("simple", "everything")
#: Which are placed and routed.
CLOCKED = ("simple", SMALL)
