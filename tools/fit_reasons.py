"""Why a fitted chip is what it is."""

from dataclasses import dataclass

from rtl.arithmetic import ARITHMETICS
from rtl.program.features import SWITCHES

from .fit_area import blocks_of
from .fit_format import VARIANTS

__all__ = ["CACHES", "Reason", "reasons_of"]

#: Lines of caches, and items of a line.
CACHES = {"node_lines": "node_line_items", "list_lines": "list_line_items", "matrix_lines": None,
          "shading_lines": None, "texture_lines": "texture_line_items"}
# Of separate sums, with other ways to divide, which draw as they do.
_DIVIDING = "table", "reciprocal"


@dataclass(frozen=True)
class Reason:
    """Why a parameter has its value.

    Parameters
    ----------
    what : str
        The parameter, or what is worth knowing besides.
    value
    why : str
    """

    what: str
    value: object
    why: str


def reasons_of(config, compiled, images, *, size, tried, tables):
    """Reasons for what pictures, scene and size decide.

    Parameters
    ----------
    config : ChipConfig
    compiled : CompiledScene
    images : list of SceneImage
    size : (int, int)
    tried : dict
        Of the :class:`~tools.fit_format.FormatSearch`.
    tables : dict or None
        Tables of whole chips by their ways to compute.
    """
    name = ARITHMETICS[config.arithmetic].name
    yield Reason("fmt", str(config.fmt), _narrower(config, tried))
    yield Reason("arithmetic", name, "no chips were synthesised; the first of those that draw well enough in "
                 "the narrowest format" if tables is None else "tables of whole chips: " + "; ".join(
                     f"{way}: {number:,}" for way, number in tables.items()))
    yield Reason("edge_tolerance", config.edge_tolerance, "closes the cracks that are left" if config.edge_tolerance
                 else "it is not needed in this format")
    if config.shader is not None:
        yield Reason("shader", ", ".join(switch for switch in SWITCHES if getattr(config.shader, switch)) or "none",
                     "what lights, materials and meshes of the scene have")
        yield Reason("lights", len(compiled.scene.lights) or "at the eye",
                     "they lie in memory, up to 256; their kinds are switches")
    yield Reason("second level", "unused" if compiled.is_flat else "used",
                 "no mesh is there twice and nothing moves; no switch leaves it out" if compiled.is_flat else
                 "meshes are there more than once, or move")
    yield Reason("stack_depth", config.stack_depth, "the deepest of the scene's kd-trees has "
                 f"{max(image.stack_depth for image in images)} levels below its root, and no ray puts off more nodes "
                 "than that, wherever it goes")
    memories = {memory: len(getattr(images[0], memory)) for memory in images[0].bytes_of_memories}
    largest = max(memories, key=memories.get)
    yield Reason("index_width", config.index_width, f"the largest memory, {largest}, has {memories[largest]:,} items")
    yield Reason("coord_width", config.coord_width, f"the picture has {max(size)} pixels a side")
    yield Reason("caches", ", ".join(f"{cache} {getattr(config, cache)}" for cache in CACHES),
                 "up to 512 lines take the same block RAMs; no more lines than the memories have")
    yield Reason("memory image", f"{images[0].num_bytes:,} bytes", f"{blocks_of(images[0])} block RAMs, if on the chip")


def _narrower(config, tried):
    """What was found in formats with a bit less."""
    name, fmt = ARITHMETICS[config.arithmetic].name, config.fmt
    way = {"edge_tolerance": config.edge_tolerance, "arithmetic": 0 if name in _DIVIDING else config.arithmetic}
    variant = next(variant for variant, parameters in VARIANTS.items()
                   if {"edge_tolerance": 0, "arithmetic": 0} | parameters == way)
    places = (fmt.exp_width, fmt.frac_width - 1), (fmt.exp_width - 1, fmt.frac_width)
    found = [f"{exponent}.{fraction}, {one}: {faults}" for (exponent, fraction, one), faults in tried.items()
             if one == variant and (exponent, fraction) in places]
    return "; ".join(found) or "the narrowest that is tried"
