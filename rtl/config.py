"""The parameters of a whole chip; below the top, units take plain keyword arguments."""

from dataclasses import dataclass, field
from functools import cached_property

from fpu import FloatFormat

from .arithmetic import ARITHMETICS
from .program.features import ShaderFeatures
from .shader_program import shader_program, stack_words

_EDGE_TOLERANCE = 8


@dataclass(frozen=True)
class ChipConfig:
    """What one DynRTC is built with.

    The defaults are the paper's prototype (Schmittler et al. 2004, §4.2, §4.3): 24-bit floats, 64 threads of
    2×2 rays, 64 traversal states a packet (32 in each of the two levels), caches of about 12 KB together.

    Parameters
    ----------
    fmt : :class:`~fpu.FloatFormat`
        Format of every floating-point number on the chip.
    add_latency, mul_latency, div_latency, cmp_latency : int
        Pipeline stages of the operators. Fewer than the operators' own defaults, which are for 175 MHz alone: each
        stage of a kd-step is one more that a thread waits in, and the whole chip is to run at 100 to 125 MHz.
    num_threads : int
        Packets in flight, 1…64.
    stack_depth : int
        Traversal states kept for each level of each packet.
    mailbox_entries : int
        Triangles a packet remembers having been tested against; 0 builds no mailbox.
    node_lines, list_lines, matrix_lines : int
        Lines of the three caches.
    node_line_items, list_line_items : int
        Nodes (8 bytes each) and list entries (4 bytes each) in a line, which has 8 bytes or more; a matrix (36 bytes)
        is a line by itself.
    num_fetches : int
        Lines that each cache may have requested from memory at a time.
    index_width : int
        Bits of a node, list or matrix number.
    coord_width : int
        Bits of a pixel coordinate.
    arithmetic : int
        Which of :data:`~rtl.arithmetic.ARITHMETICS` it computes by.
    edge_tolerance : int
        By how much edges of triangles give, in units in the last place of what was added up: a power of two up to 64,
        or 0 for none. One of two triangles at an edge may give by twice that, where the ray does not graze it. Not with
        fused sums, whose products are not seen; so the default is 8, but none with these.
    num_pipelines : int
        Pipelines behind one ray generation controller, 1…4.
    shader : :class:`~rtl.program.features.ShaderFeatures`, optional
        What the shader is able to do; without one, triangles have one colour each and no rays but the primary ones.
    num_shaders : int
        Shaders of each pipeline, 1, 2 or 4, each for its part of the threads.
    offset_log2 : int
        Logarithm of the shader's offset against self-intersection, in units in the last place.
    shading_lines, texture_lines, texture_line_items : int
        Lines of the shader's caches, if it has them: of records, of which one is a line, and of texels.

    Raises
    ------
    ValueError
        If a parameter is out of its range; the message names it.
    """

    fmt: FloatFormat = field(default_factory=lambda: FloatFormat(7, 16))
    add_latency: int = 6
    mul_latency: int = 3
    div_latency: int = 14
    cmp_latency: int = 2
    num_threads: int = 64
    stack_depth: int = 32
    mailbox_entries: int = 4
    node_lines: int = 256
    node_line_items: int = 2
    list_lines: int = 128
    list_line_items: int = 4
    matrix_lines: int = 128
    num_fetches: int = 4
    index_width: int = 24
    coord_width: int = 12
    arithmetic: int = 0
    edge_tolerance: int | None = None
    num_pipelines: int = 1
    shader: ShaderFeatures | None = None
    num_shaders: int = 1
    offset_log2: int = 1
    shading_lines: int = 128
    texture_lines: int = 256
    texture_line_items: int = 4

    def __post_init__(self):
        if self.edge_tolerance is None:
            is_fused = self.arithmetic in range(len(ARITHMETICS)) and ARITHMETICS[self.arithmetic].fused
            object.__setattr__(self, "edge_tolerance", 0 if is_fused else _EDGE_TOLERANCE)
        ranges = {
            "add_latency": (0, 32), "mul_latency": (0, 32), "div_latency": (0, 64), "cmp_latency": (0, 8),
            "num_threads": (1, 64), "stack_depth": (1, 64), "mailbox_entries": (0, 16),
            "node_lines": (2, 1 << 16), "node_line_items": (1, 8), "list_lines": (2, 1 << 16),
            "list_line_items": (2, 16), "matrix_lines": (2, 1 << 16), "num_fetches": (1, 16),
            "index_width": (8, 24), "coord_width": (4, 14),
            "arithmetic": (0, len(ARITHMETICS) - 1), "num_pipelines": (1, 4), "offset_log2": (0, 8),
            "edge_tolerance": (0, 64),
            "num_shaders": (1, 4),
            "shading_lines": (2, 1 << 16), "texture_lines": (2, 1 << 16), "texture_line_items": (2, 16),
        }
        for name, (low, high) in ranges.items():
            value = getattr(self, name)
            if not low <= value <= high:
                raise ValueError(f"{name} is {value}; it must be from {low} to {high}")
        for name in ("node_lines", "list_lines", "matrix_lines", "node_line_items", "list_line_items",
                     "shading_lines", "texture_lines", "texture_line_items", "num_shaders"):
            if getattr(self, name).bit_count() != 1:
                raise ValueError(f"{name} is {getattr(self, name)}; it must be a power of two")

        if self.edge_tolerance.bit_count() > 1:
            raise ValueError(f"edge_tolerance is {self.edge_tolerance}; it must be a power of two, or 0")
        if self.edge_tolerance and ARITHMETICS[self.arithmetic].fused:
            raise ValueError(f"edge_tolerance is {self.edge_tolerance}, but arithmetic is {self.arithmetic} "
                             f"('{ARITHMETICS[self.arithmetic].name}'), which does not show its products; it must be 0")

    @cached_property
    def program(self):
        """The shader's program, or None."""
        return None if self.shader is None else shader_program(features=self.shader)

    @property
    def ray_stack_depth(self):
        """Registers on the stack of a ray in the shader."""
        return 0 if self.shader is None else max(stack_words(self.shader), 1)

    @property
    def latencies(self):
        """The operators' latencies as a :class:`~fpu.Datapath` takes them."""
        return {"add": self.add_latency, "mul": self.mul_latency, "div": self.div_latency, "cmp": self.cmp_latency}
