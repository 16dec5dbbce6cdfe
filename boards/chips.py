"""The chips that boards are built with by default, by what fits."""

from fpu import FloatFormat
from rtl.config import ChipConfig
from rtl.program.features import ShaderFeatures

__all__ = ["FULL", "SIMPLE", "SMALL"]

#: All that the shader can do, with adders a stage deeper for its clock. The paper's 64 threads would take more block
#: RAMs than an LFE5U-85F has.
FULL = ChipConfig(num_threads=32, add_latency=7, shader=ShaderFeatures(depth=4))
#: Colours and a cosine, the paper's format and caches, for an LFE5U-45F. Stacks of 32 would need two block
#: RAMs more than it has.
SIMPLE = ChipConfig(num_threads=32, stack_depth=16)
#: For an LFE5U-25F: as many threads and lines as its 56 block RAMs hold, in a format in which the room looks right;
#: with as few stages as its clock asks for, as flip-flops and what delays beside them would fill it.
SMALL = ChipConfig(fmt=FloatFormat(6, 12), add_latency=3, mul_latency=2, div_latency=8, cmp_latency=1, num_threads=8,
                   stack_depth=16, edge_tolerance=0, mailbox_entries=0, node_lines=128, list_lines=64, matrix_lines=64,
                   index_width=16, coord_width=10)
