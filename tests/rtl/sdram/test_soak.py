"""The long run's traffic, for a short while; and that it would see errors."""

import pytest

from tests.rtl.sdram.soak import soak
from tests.rtl.sdram.verilated import Soak


def test_a_short_run():
    counts = soak(20_000, optimise="-O0")
    assert counts["errors"] == counts["violations"] == counts["underruns"] == 0
    assert counts["accesses"] >= 20_000
    # One each 7.8 µs of 8 ns a cycle
    assert counts["refreshes"] >= (counts["cycles"] - 30_000) / (7812.5 / 8)
    assert min(counts[name] for name in ("read_words", "written_words", "shown_words")) > 1000


def test_a_chip_slower_than_the_controller_believes_is_noticed():
    """The same memory with another chip behind it, at a clock for which its times are too short."""
    with Soak([2, 4, 9, 1], num_writers=2, display=True, clock_mhz=125, chip_mhz=142, part="MT48LC16M16A2-75",
              optimise="-O0") as run:
        run.read(0, rate=1.0)
        counts = run.run(1000, max_cycles=100_000)
    assert counts["violations"]
    assert run.last_message.startswith("tCK: ")


def test_a_wrong_word_is_noticed():
    with Soak([2, 4, 9, 1], num_writers=2, display=True, optimise="-O0") as run:
        run.read(2, rate=1.0)
        run.damage(9 * 4321)
        counts = run.run(1000, max_cycles=100_000, finish=True)
    assert counts["errors"]
    assert run.last_message.startswith("word 38889")


def test_a_picture_is_shown():
    with Soak([2, 4, 9, 1], num_writers=2, display=True, optimise="-O0") as run:
        run.show(bits=16)
        counts = run.run(1 << 40, max_cycles=200_000)
    assert counts["underruns"] == counts["errors"] == 0
    assert counts["shown_words"] == pytest.approx(140_000 / 125 * 25.175 / 2 * 0.8, rel=0.05)
