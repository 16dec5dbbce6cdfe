"""The chips that boards are built with by default, by what fits."""

from fpu import FloatFormat
from rtl.config import ChipConfig
from rtl.program.features import ShaderFeatures

__all__ = ["FULL", "SIMPLE", "SMALL"]

#: All that the shader can do, with adders a stage deeper for its clock. The paper's 64 threads would take more block
#: RAMs than an LFE5U-85F has; with 32, nine in ten, nextpnr finds no way for all wires in their rows. A line of a cache
#: is as wide as its block RAMs, which have 512 rows. In 32 MB there are at most four million nodes.
FULL = ChipConfig(num_threads=16, add_latency=7, index_width=22, shader=ShaderFeatures(depth=4), node_lines=512,
                  list_lines=512, matrix_lines=512, shading_lines=512, texture_lines=512)
#: Colours and a cosine, the paper's format and caches, for an LFE5U-45F. Stacks of 32 would need two block
#: RAMs more than it has.
SIMPLE = ChipConfig(num_threads=32, stack_depth=16, add_latency=7)
#: For an LFE5U-25F: as many threads and lines as its 56 block RAMs hold, in a format in which the room looks right;
#: with as few stages as its clock asks for, as flip-flops and what delays beside them would fill it.
SMALL = ChipConfig(fmt=FloatFormat(6, 12), add_latency=3, mul_latency=2, div_latency=8, cmp_latency=1, num_threads=8,
                   stack_depth=16, edge_tolerance=0, mailbox_entries=0, node_lines=128, list_lines=64, matrix_lines=64,
                   index_width=16, coord_width=10)
