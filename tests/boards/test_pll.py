"""What a PLL makes of a board's clock, against the equations of its data sheet."""

import pytest

from boards.pll import Clock, plan_pll

SCREENS = [(125.875, 25.175), (325.0, 65.0)]


def checked(input_mhz, clocks):
    """The plan; the equations and limits are written here anew."""
    plan = plan_pll(input_mhz, clocks)
    compared = input_mhz / plan.input_divider
    oscillator = compared * plan.feedback_divider * plan.feedback_output
    assert 1 <= plan.feedback_output <= 128
    assert 10 <= compared <= 400
    assert 400 <= oscillator <= 800
    assert 1 <= plan.feedback_divider <= 80
    assert oscillator == pytest.approx(plan.oscillator_mhz)
    for clock, divider, phase, mhz in zip(clocks, plan.dividers, plan.phases, plan.mhz, strict=True):
        assert 1 <= divider <= 128
        assert 0 <= phase < divider
        assert mhz == pytest.approx(oscillator / divider)
        assert mhz == pytest.approx(clock.mhz, rel=0.008)
        # As near to what is asked for as a period of the oscillator allows, modulo the clock's own
        apart = (phase / oscillator * 1000 - clock.lag_ns) % (1000 / mhz)
        assert min(apart, 1000 / mhz - apart) <= 500 / oscillator + 1e-9
    return plan


@pytest.mark.parametrize("input_mhz", [25, 50])
@pytest.mark.parametrize("mhz", range(40, 134, 5))
def test_chip_and_sdram(input_mhz, mhz):
    plan = checked(input_mhz, [Clock(domain="sync", mhz=mhz), Clock(domain="sdram", mhz=mhz, lag_ns=-5)])
    assert plan.mhz[0] == plan.mhz[1]


@pytest.mark.parametrize("input_mhz", [25, 50])
@pytest.mark.parametrize(("shift", "pixel"), SCREENS)
def test_screens(input_mhz, shift, pixel):
    plan = checked(input_mhz, [Clock(domain="shift", mhz=shift), Clock(domain="pixel", mhz=pixel)])
    assert plan.mhz[0] == pytest.approx(5 * plan.mhz[1])


def test_exact_if_there_is_an_exact_one():
    assert checked(25, [Clock(domain="shift", mhz=325), Clock(domain="pixel", mhz=65)]).mhz == (325, 65)
    assert checked(50, [Clock(domain="sync", mhz=62.5)]).mhz == (62.5,)


@pytest.mark.parametrize(("input_mhz", "clocks", "message"), [
    (4, [100], r"an input of 4 MHz; a PLL takes 8 to 400"),
    (25, [], r"0 clocks; a PLL has 1 to 3"),
    (25, [450], r"no PLL makes 450 MHz of 25 within 0\.8 %; ask for others"),
    (25, [399, 250], r"no PLL makes 399, 250 MHz of 25 within 0\.8 %; ask for others"),
])
def test_what_cannot_be(input_mhz, clocks, message):
    with pytest.raises(ValueError, match=f"^{message}$"):
        plan_pll(input_mhz, [Clock(domain=f"clock{mhz}", mhz=mhz) for mhz in clocks])
