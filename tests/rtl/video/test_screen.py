"""A frame through encoders, serialiser and a monitor."""

from dataclasses import asdict

import numpy as np
import pytest
from amaranth.sim import Simulator

from rtl.video.display import BarScreen
from rtl.video.mode import MODES, VGA, XGA, XGA_REDUCED, VideoMode
from rtl.video.serializer import Serializer
from sim.machine.dvi_receiver import DviError, DviReceiver
from tests.rtl.video.screen import TINY, expected_bars, received

TIMES = ("width", "h_front", "h_sync", "h_back", "height", "v_front", "v_sync", "v_back")


@pytest.mark.parametrize(("mode", "phase"), [
    (TINY, 0.0), (TINY, 0.3), (TINY, 0.5), (TINY, 0.9),
    (VideoMode(name="odd", pixel_mhz=25, width=17, h_front=1, h_sync=12, h_back=9, height=9, v_front=1, v_sync=1,
               v_back=1, v_positive=True), 0.1)])
def test_the_test_picture(mode, phase):
    receiver = received(BarScreen(mode), phase=phase, clocks=int(2.4 * mode.h_total * mode.v_total))
    frames = receiver.frames()
    assert len(frames) == 2
    for frame in frames:
        assert frame.times == {name: getattr(mode, name) for name in TIMES}
        assert (frame.h_positive, frame.v_positive) == (mode.h_positive, mode.v_positive)
        assert np.array_equal(frame.picture, expected_bars(mode.width, mode.height))


def test_the_first_frame_is_whole():
    """From reset on, all lines that are shown are of whole frames."""
    receiver = received(BarScreen(TINY), clocks=int(1.2 * TINY.h_total * TINY.v_total))
    assert int(receiver.active.sum()) == TINY.width * TINY.height


def test_modes():
    """Figures of VESA's standard that do not go into the modes: line and frame rates."""
    assert VGA.refresh_hz() == pytest.approx(59.940, abs=1e-3)
    assert VGA.refresh_hz(25.0) == pytest.approx(59.524, abs=1e-3)
    assert XGA.refresh_hz() == pytest.approx(60.004, abs=1e-3)
    assert XGA_REDUCED.refresh_hz() == pytest.approx(59.870, abs=1e-3)
    assert (XGA_REDUCED.h_total, XGA_REDUCED.v_total) == (1184, 790)
    assert (VGA.h_total, VGA.v_total, XGA.h_total, XGA.v_total) == (800, 525, 1344, 806)
    assert MODES["1024x768"] is XGA
    with pytest.raises(ValueError, match=r"^x: v_back is 0; it must be positive$"):
        VideoMode(**{**asdict(VGA), "name": "x", "v_back": 0})


def test_skew_and_where_bits_begin_do_not_matter():
    bits = received(BarScreen(TINY), clocks=int(2.3 * TINY.h_total * TINY.v_total), keep=True)
    length = bits.shape[1] - 20
    for skews in ((0, 0, 0), (3, 0, 4), (7, 8, 6)):
        skewed = np.stack([*(bits[channel, skew:skew + length] for channel, skew in enumerate(skews)),
                           bits[3, :length]])
        assert np.array_equal(DviReceiver(skewed).frames()[0].picture, expected_bars(TINY.width, TINY.height))


def test_a_monitor_that_sees_a_fault():
    bits = received(BarScreen(TINY), clocks=int(2.3 * TINY.h_total * TINY.v_total), keep=True)
    # A bit lost in green: from there on it has pixels when the others have none, or symbols that nobody sends.
    broken = np.stack([np.delete(bits[channel], 9999) if channel == 1 else bits[channel, :-1] for channel in range(4)])
    with pytest.raises(DviError, match="green: "):
        DviReceiver(broken).frames()


@pytest.mark.parametrize("phase", [0.05, 0.3, 0.5, 0.75, 0.95])
def test_a_symbol_is_taken_in_the_middle_of_its_time(phase):
    """From the pixel clock by which it comes, 2 to 3 of its 5 shift clocks."""
    dut, times = Serializer(num_channels=1), {}
    simulator = Simulator(dut)
    pixel_phase, shift_phase = 20.0, 8 * phase
    simulator.add_clock(40e-9, phase=pixel_phase * 1e-9, domain="pixel")
    simulator.add_clock(8e-9, phase=shift_phase * 1e-9, domain="shift")

    async def send(ctx):
        for number in range(20):
            ctx.set(dut.symbols[0], 0x3FF if number == 10 else 0)
            await ctx.tick("pixel")
        # It is held from the edge that ended number 10.
        times["held"] = pixel_phase + 40 * 10

    async def watch(ctx):
        for edge in range(100):
            _, _, pair = await ctx.tick("shift").sample(dut.pairs[0])
            if pair == 3:
                # It has been on its way to the pins since then.
                times.setdefault("taken", shift_phase + 8 * (edge - 1 - Serializer.way))

    simulator.add_testbench(send)
    simulator.add_testbench(watch)
    simulator.run()
    assert 2.0 <= (times["taken"] - times["held"]) / 8 <= 3.0
