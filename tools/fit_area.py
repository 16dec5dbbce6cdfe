"""What fitted chips take of an ECP5, and the smallest of several."""

from boards.chip import chip_design
from boards.design import design_of
from boards.device import DEVICES
from boards.ecp5 import place
from boards.packing import is_packed, pack
from rtl.affine_map import affine_map
from rtl.arithmetic import ARITHMETICS
from rtl.dynrtc import DynRTC
from rtl.intersection import unit_triangle
from rtl.layout import PACKET_RAYS
from rtl.traversal import kd_step

from .pipeline_chips import CHIPS

__all__ = ["FULL", "GRADE", "area_of", "blocks_of", "datapath_tables", "smallest_device", "speed_of"]

#: The full chip, which a fitted one is set beside.
FULL = CHIPS["everything"].config
#: Of the device, and of its placer.
GRADE, _SEED = 6, 1
# A block RAM has 512 words of 36 bits, of which memory's words use 32.
_BLOCK_BYTES = 2048


def datapath_tables(config, *, progress=lambda text: None):
    """Tables of a chip's datapaths, each synthesised alone: one map, four kd-steps, one test of a triangle."""
    options = dict(arithmetic=ARITHMETICS[config.arithmetic], latencies=config.latencies)
    near = config.shader is not None and config.shader.passes
    parts = ((1, "transformation", affine_map(config.fmt, scaled=config.edge_tolerance > 0, **options)),
             (PACKET_RAYS, "kd-step", kd_step(config.fmt, **options)),
             (1, "intersection", unit_triangle(config.fmt, near=near, tolerant=config.edge_tolerance > 0, **options)))
    total = 0
    for number, name, datapath in parts:
        progress(f"synthesising the {name} at {config.fmt}")
        total += number * pack(design_of(datapath.component(), name=f"{name} at {config.fmt}")).lut
    return total


def _design(config, name):
    return chip_design(DynRTC(config), name=name)


def area_of(config, *, name, progress=lambda text: None):
    """The :class:`~boards.packing.Area` of a chip.

    Raises
    ------
    ToolError
        If a tool is missing or fails.
    """
    design = _design(config, name)
    if not is_packed(design):
        progress(f"synthesising {name}, some minutes")
    return pack(design)


def speed_of(config, *, name, progress=lambda text: None):
    """The clock of a chip in MHz, placed on the largest device."""
    progress(f"placing and routing {name}, up to an hour")
    return place(_design(config, name), grade=GRADE, seed=_SEED).fmax_mhz


def blocks_of(image):
    """Block RAMs that a memory image takes on the chip."""
    return sum(-(-size // _BLOCK_BYTES) for size in image.bytes_of_memories.values())


def smallest_device(area, blocks=0):
    """The smallest device that has room for a chip and ``blocks`` block RAMs, or None."""
    return next((device for device in DEVICES.values()
                 if area.lut <= device.lut and area.ff <= device.lut and area.dsp <= device.dsp
                 and area.ebr + blocks <= device.ebr), None)
