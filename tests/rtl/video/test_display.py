"""Frames from a memory, through all of the display, as a monitor sees them."""

import random
from collections import deque
from itertools import count

import numpy as np
import pytest

from rtl.sdram.timing import SLOWEST
from rtl.video.display import Display
from rtl.video.double_buffer import DoubleBuffer
from rtl.video.frame_reader import FrameReader
from rtl.video.line_buffer import LineBuffer
from rtl.video.mode import VideoMode
from tests.bench import simulate
from tests.rtl.video.screen import expected_bars, received

STRIDE = 64
BASES = (3, 1000)
MODE = VideoMode(name="small", pixel_mhz=25.0, width=64, h_front=8, h_sync=12, h_back=12, height=16, v_front=2,
                 v_sync=2, v_back=3)
FRAME = MODE.h_total * MODE.v_total


def color(base, row, column):
    """A frame's pixel, by where the frame begins."""
    return (base * 0x9E3779 + row * 0x10305 + column * 0x71) & 0xFFFFFF


def picture(base, *, scale):
    rows = np.array([[color(base, y // scale, x // scale) for x in range(MODE.width)] for y in range(MODE.height)])
    return np.stack([rows >> 16, rows >> 8 & 255, rows & 255], axis=-1).astype(np.uint8)


def memory(dut, rng, *, gap=0.2, stalls=()):
    """Testbench in place of a display port: words of two frames, with gaps; none in the given ranges of cycles."""
    wanted = deque()

    async def testbench(ctx):
        ctx.set(dut.frame.ready, 1)
        sampled = dut.frame.valid, dut.frame.payload.base, dut.frame.payload.lines, dut.word.valid, dut.word.ready
        ticks = ctx.tick("sync").sample(*sampled)
        cycles, offered = count(), False
        async for _, _, valid, base, lines, _, ready in ticks:
            cycle = next(cycles)
            if valid:
                start = max((each for each in BASES if each <= base), default=None)
                assert start is not None, f"nobody asked for a frame at {base}"
                row, rest = divmod(16 * (base - start), STRIDE)
                assert rest == 0
                wanted.extend(color(start, row, column) for column in range(16 * (lines + 1)))
            if offered and ready:
                wanted.popleft()
                offered = False
            if not offered and wanted and rng.random() >= gap and not any(cycle in stall for stall in stalls):
                ctx.set(dut.word.payload, wanted[0])
                offered = True
            ctx.set(dut.word.valid, offered)
    return testbench


def swaps(dut, times, rng):
    """Testbench that swaps at random moments; gives up the bases of what is not shown."""
    async def testbench(ctx):
        for base, port in zip(BASES, dut.bases, strict=True):
            ctx.set(port, base)
        cycles = count()
        async for _, _, shown, draw in ctx.tick("sync").sample(dut.shown, dut.draw):
            assert draw == BASES[1 - shown]
            ctx.set(dut.swap, next(cycles) in times)
    return testbench


@pytest.mark.parametrize(("scale", "sync", "phase"), [(1, 37, 0.2), (2, 61, 0.7), (2, 40, 0.0)])
def test_frames_are_whole_and_swap_between_two(scale, sync, phase):
    rng = random.Random(scale * sync)
    dut = Display(MODE, chip=SLOWEST, scale=scale, stride=STRIDE)
    num_cycles = int(5.5 * FRAME * 40 / sync)
    times = {rng.randrange(num_cycles) for _ in range(3)} if sync != 40 else set(range(50, num_cycles, 700))
    receiver = received(dut, clocks=int(5.5 * FRAME), phase=phase, sync=sync, testbenches=[
        memory(dut, rng, gap=0.1), swaps(dut, times, rng)])
    frames = receiver.frames()
    assert len(frames) == 5
    pictures = [picture(base, scale=scale) for base in BASES]
    shown = [[np.array_equal(frame.picture, each) for each in pictures] for frame in frames]
    assert all(sum(each) == 1 for each in shown), "a frame is of neither picture"
    assert {each.index(True) for each in shown} == {0, 1}


def test_a_late_memory_makes_black_lines_and_no_shifted_ones():
    rng = random.Random(7)
    dut = Display(MODE, chip=SLOWEST, stride=STRIDE)
    stall = range(int(1.2 * FRAME), int(1.2 * FRAME) + 3 * MODE.h_total)
    long = range(int(3.4 * FRAME), int(4.6 * FRAME))
    counted = []

    async def counts(ctx):
        async for _, _, late, number in ctx.tick("sync").sample(dut.late, dut.frames):
            counted[:] = [late, number]

    frames = received(dut, clocks=int(7.5 * FRAME), sync=40, testbenches=[
        memory(dut, rng, gap=0.05, stalls=(stall, long)), swaps(dut, set(), rng), counts]).frames()
    good = picture(BASES[0], scale=1)
    late = []
    for frame in frames:
        right = (frame.picture == good).all(axis=(1, 2))
        black = (frame.picture == 0).all(axis=(1, 2))
        assert (right | black).all()
        late.append(int((~right).sum()))
    assert late[0] == late[-1] == 0
    assert late.count(0) >= 3
    assert sum(late) > 16
    # The first frame ends before a monitor has seen it begin, with the vertical sync.
    assert counted == [sum(late), 8]


def test_the_test_picture_needs_no_memory():
    dut = Display(MODE, chip=SLOWEST, scale=2, stride=STRIDE)

    async def test_picture(ctx):
        ctx.set(dut.test, 1)

    frames = received(dut, clocks=int(2.4 * FRAME), sync=30, testbenches=[test_picture]).frames()
    assert [np.array_equal(frame.picture, expected_bars(MODE.width, MODE.height)) for frame in frames] == [True] * 2


def test_shown_changes_with_a_blank_only():
    rng = random.Random(3)
    dut = DoubleBuffer(base_width=8)
    model = {"shown": 0, "pending": 0}

    async def testbench(ctx):
        for port, base in zip(dut.bases, (17, 99), strict=True):
            ctx.set(port, base)
        for _ in range(3000):
            swap, blank = rng.random() < 0.2, rng.random() < 0.2
            ctx.set(dut.swap, swap)
            ctx.set(dut.blank, blank)
            await ctx.tick()
            wants = model["pending"] or swap
            if blank:
                model["shown"] ^= wants
            model["pending"] = wants and not blank
            assert ctx.get(dut.shown) == model["shown"]
            assert ctx.get(dut.pending) == model["pending"]
            assert ctx.get(dut.begin) == blank
            assert (ctx.get(dut.show), ctx.get(dut.draw)) == ((99, 17) if model["shown"] else (17, 99))

    simulate(dut, testbench, name="double_buffer")


def test_what_cannot_be_is_refused():
    with pytest.raises(ValueError, match=r"^rows of 40 words, 64 apart: both must be multiples of 16$"):
        FrameReader(chip=SLOWEST, width=40, height=3, stride=64)
    with pytest.raises(ValueError,
                       match=r"^small: pixels are shown 3-fold; a scale is 1 or 2, and divides the screen$"):
        LineBuffer(MODE, scale=3)
