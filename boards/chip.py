"""A whole chip as a design out of context."""

from amaranth.hdl import Const, Module, Value
from amaranth.lib import wiring
from amaranth.lib.wiring import In

from rtl.block_memory import APART

from .design import SYNTHESIS, design_of
from .device import DEVICES

__all__ = ["DEVICE", "OBSERVING", "WITHOUT_CHECKS", "Unobserved", "chip_design"]

#: Members of a :class:`~rtl.dynrtc.DynRTC` that a simulation looks at.
OBSERVING = ("probe", "counters")
#: Assertions are a simulation's too; a cell that stays would keep what it watches. What the memories of
#: :class:`~rtl.block_memory.BlockMemory` answer where that is asserted not to be asked may be anything.
WITHOUT_CHECKS = (f"chformal -remove; setparam -set COLLISION_X_MASK 1'1 t:$memrd_v2 r:MEMID=*{APART} %i; "
                  f"{SYNTHESIS}")
#: What does not fit the smaller ones.
DEVICE = DEVICES["LFE5U-85F"]


class Unobserved(wiring.Component):
    """A chip without what only a simulation looks at, so that what drives that alone is not built.

    Parameters
    ----------
    chip : Component
        Usually a :class:`~rtl.dynrtc.DynRTC`.

    Members
    -------
    All of the chip's but :data:`OBSERVING`.
    """

    #: Not all its outputs come from registers.
    latency = 0

    def __init__(self, chip):
        self._chip = chip
        super().__init__({name: member for name, member in chip.signature.members.items() if name not in OBSERVING})

    def elaborate(self, platform):
        m = Module()
        m.submodules.chip = chip = self._chip
        inside = {path: Value.cast(value) for path, _, value in chip.signature.flatten(chip)}
        for path, member, value in self.signature.flatten(self):
            value = Value.cast(value)
            # A stream that is always ready has a constant in place of ready.
            if not isinstance(value, Const):
                m.d.comb += inside[path].eq(value) if member.flow is In else value.eq(inside[path])
        return m


def chip_design(chip, *, name, device=DEVICE):
    """Design of a chip, as :func:`~boards.ecp5.design_of` makes it, without what only a simulation looks at.

    Parameters
    ----------
    chip : Component
        Usually a :class:`~rtl.dynrtc.DynRTC`.
    name : str
        For messages.
    device : Device
        What it is placed on.
    """
    return design_of(Unobserved(chip), name=name, synthesis=WITHOUT_CHECKS, device=device)
