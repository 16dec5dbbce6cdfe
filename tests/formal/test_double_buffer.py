"""What is shown never changes but between two frames."""

import pytest
from amaranth.hdl import Assert, Module, Signal

from rtl.video.double_buffer import DoubleBuffer
from tests.formal.prove import Refuted, prove


def double_buffer_proof(*, broken=False):
    """All that can come, in any order; ``broken`` claims that swaps never happen."""
    m = Module()
    m.submodules.buffer = dut = DoubleBuffer(base_width=3)
    swap, blank = Signal(), Signal()
    bases = [Signal(3, name=f"base{number}") for number in range(2)]
    # The cycle before: who asked, what was shown and where it began, and if there has been one
    began, blanked, swapped, awaited, shown, show = Signal(), Signal(), Signal(), Signal(), Signal(), Signal(3)
    m.d.comb += [dut.swap.eq(swap), dut.blank.eq(blank),
                 *(port.eq(base) for port, base in zip(dut.bases, bases, strict=True))]
    m.d.sync += [began.eq(1), blanked.eq(blank), swapped.eq(swap), awaited.eq(dut.pending), shown.eq(dut.shown),
                 show.eq(dut.show)]
    kept = [Signal(3, name=f"kept{number}") for number in range(2)]
    m.d.sync += [each.eq(base) for each, base in zip(kept, bases, strict=True)]
    steady = Signal()
    m.d.comb += steady.eq((kept[0] == bases[0]) & (kept[1] == bases[1]))
    m.d.comb += Assert(dut.begin == (began & blanked))
    with m.If(began):
        m.d.comb += [
            Assert((dut.shown == shown) | blanked),
            Assert((dut.show == show) | blanked | ~steady),
            # What was asked for is done with the first blank, and not without.
            Assert((dut.shown != shown) == (blanked & (awaited | swapped))),
            Assert(dut.pending == (~blanked & (awaited | swapped))),
        ]
        if broken:
            m.d.comb += Assert(dut.shown == shown)
    return m, [swap, blank, *bases]


def test_what_is_shown_changes_between_frames_only(tmp_path):
    module, ports = double_buffer_proof()
    prove(module, ports=ports, cycles=8, by_induction=False, folder=tmp_path)


def test_a_wrong_claim_is_refuted(tmp_path):
    module, ports = double_buffer_proof(broken=True)
    with pytest.raises(Refuted, match="model found"):
        prove(module, ports=ports, cycles=6, by_induction=False, folder=tmp_path)
