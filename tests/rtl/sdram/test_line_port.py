"""A line's pieces are its words, and none leaves its row."""

import random
from collections import deque

import pytest

from rtl.sdram.line_port import LinePort
from rtl.sdram.timing import SLOWEST
from tests.bench import drain, feed, simulate, steady, until

ROW = 256


@pytest.mark.parametrize(("words", "gap"), [(1, 0.0), (2, 0.3), (3, 0.0), (8, 0.0), (9, 0.3), (15, 0.0), (16, 0.5)])
def test_pieces(words, gap):
    rng = random.Random(words)
    dut = LinePort(chip=SLOWEST, words=words, line_width=18)
    base = rng.randrange(1 << 18)
    # Enough lines one after the other that they begin at each place of a row that they can
    lines = [*range(300), *(rng.randrange(1 << 18) for _ in range(50))]
    expected = deque((base * 16 + line * words + word) % (1 << 23) for line in lines for word in range(words))
    left = deque()

    def take(piece):
        if not piece.second:
            assert not left
            left.append(words)
            assert piece.place == 0
        addresses = [piece.address + word for word in range(piece.left + 1)]
        assert piece.place == words - left[0]
        assert addresses[0] // ROW == addresses[-1] // ROW, "a piece in two rows"
        assert addresses == [expected.popleft() for _ in addresses]
        left[0] -= len(addresses)
        assert bool(piece.split and not piece.second) == bool(left[0])
        if not left[0]:
            left.popleft()

    async def set_base(ctx):
        ctx.set(dut.base, base)

    simulate(dut, set_base, until(lambda: not expected and not left, quiet=5), name="line_port", background=(
        feed(dut.request, deque(lines), rng=rng, gap=gap), drain(dut.piece, take, rng=rng, gap=gap), steady(dut.piece)))


@pytest.mark.parametrize("words", [0, 17])
def test_lines_too_long(words):
    with pytest.raises(ValueError, match=rf"^a line has {words} words; it must have from 1 to 16$"):
        LinePort(chip=SLOWEST, words=words, line_width=8)
