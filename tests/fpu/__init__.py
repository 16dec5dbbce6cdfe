"""Tests of the floating-point package."""

from amaranth.hdl import Module, Signal


def clocked(dut):
    """``dut`` in a design that has a clock even if ``dut``, being combinational, has none."""
    m = Module()
    m.submodules.dut = dut
    m.d.sync += Signal(name="tick").eq(1)
    return m


class ECP5:
    """Platform for which operators instantiate an ECP5's own cells."""

    device = "LFE5U-85F"
