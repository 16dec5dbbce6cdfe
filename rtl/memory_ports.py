"""The memories that a chip reads."""

from amaranth.lib import stream
from amaranth.lib.wiring import In, Out

from .cache import WORD_WIDTH
from .layout import NODE_BITS, matrix_layout
from .microcode import Op, lane_width

__all__ = ["cache_names", "memory_members", "memory_ports"]


def cache_names(config):
    """The caches of a chip, by what they keep."""
    names = ["nodes", "lists", "matrices"]
    if config.program is not None:
        names.append("shading")
        if Op.TEXTURE in config.program.ops:
            names.append("textures")
    return tuple(names)


def memory_ports(config):
    """Of each of a chip's memories, the words of a line and the bits of a line's number."""
    def port(words, items):
        return words, config.index_width - (items - 1).bit_length()

    ports = {
        "nodes": port(config.node_line_items * NODE_BITS // WORD_WIDTH, config.node_line_items),
        "lists": port(config.list_line_items, config.list_line_items),
        "matrices": port(-(-matrix_layout(config.fmt).size // WORD_WIDTH), 1),
        "shading": port(1, 1),
    }
    if config.program is not None:
        ports["shading"] = port(-(-12 * lane_width(config.fmt) // WORD_WIDTH), 1)
    if "textures" in cache_names(config):
        ports["textures"] = port(config.texture_line_items, config.texture_line_items)
    return ports


def memory_members(config):
    """Members for :func:`memory_ports`: of each the stream ``NAME_request`` of lines, and ``NAME_data`` of words."""
    members = {}
    for name, (_, line_width) in memory_ports(config).items():
        members[f"{name}_request"] = Out(stream.Signature(line_width))
        members[f"{name}_data"] = In(stream.Signature(WORD_WIDTH, always_ready=True))
    return members
