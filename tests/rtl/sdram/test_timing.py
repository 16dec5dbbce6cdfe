"""Times in nanoseconds become cycles."""

import pytest

from rtl.sdram.timing import AS4C16M16SA_6, MT48LC16M16A2_75, SLOWEST, SdramTiming
from sim.machine.sdram_chip import DATASHEETS


@pytest.mark.parametrize(("clock_mhz", "latency", "row_to_column", "cycle"), [
    (50, 2, 3, 4), (100, 2, 3, 8), (100.1, 3, 3, 8), (125, 3, 3, 10), (133, 3, 3, 10)])
def test_cycles(clock_mhz, latency, row_to_column, cycle):
    timing = SdramTiming(SLOWEST, clock_mhz=clock_mhz)
    assert timing.cas_latency == latency
    # A column comes in the second cycle of its slot.
    assert 2 * timing.rcd + 1 == row_to_column
    assert 2 * timing.rc == cycle


@pytest.mark.parametrize("clock_mhz", [33, 50, 66.7, 99, 100, 111, 125, 128, 133.3])
def test_no_distance_is_too_short_for_any_datasheet(clock_mhz):
    timing, period = SdramTiming(SLOWEST, clock_mhz=clock_mhz), 1000 / clock_mhz
    for name, sheet in DATASHEETS.items():
        assert (2 * timing.rcd + 1) * period >= sheet.trcd, name
        for slots, time in ((timing.rp, sheet.trp), (timing.ras, sheet.tras), (timing.rc, sheet.trc),
                            (timing.rrd, sheet.trrd), (timing.rfc, sheet.trfc), (timing.mrd, sheet.tmrd),
                            (timing.power_up, sheet.power_up)):
            assert 2 * slots * period >= time - 1e-9, name
        # From the second cycle of a slot to the first of another, behind the second column
        assert (2 * timing.write_to_precharge - 1 - 1) * period >= sheet.twr
        assert 2 * timing.read_to_precharge - 1 >= 2
        assert 2 * timing.read_to_write >= timing.cas_latency + 2 + 1
        assert 2 * timing.refresh * period <= sheet.refresh_period / sheet.rows
        assert period >= sheet.tck[timing.cas_latency] - 1e-9


def test_bad_clocks():
    with pytest.raises(ValueError, match=r"^the clock is 134 MHz; the SDRAM takes up to 133\.3$"):
        SdramTiming(SLOWEST, clock_mhz=134)
    assert SdramTiming(AS4C16M16SA_6, clock_mhz=166).cas_latency == 3
    with pytest.raises(ValueError, match=r"^the clock is 2 MHz; refreshing the SDRAM would take half of the time or"):
        SdramTiming(MT48LC16M16A2_75, clock_mhz=2)
