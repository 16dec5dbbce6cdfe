"""The hardware under a link that damages frames, and resets in the middle of anything."""

import random

import pytest

from tests.rtl.host.verilated import VerilatedBoard
from tests.sim.host.faulty_link import Session


@pytest.fixture(scope="module")
def board():
    board = VerilatedBoard(values=Session.values(), **Session.shape)
    yield board
    board.close()


@pytest.mark.parametrize(("seed", "rate", "frames"), [(1, 0.0, 300), (2, 0.15, 6000), (3, 0.4, 4000)])
def test_nothing_wrong_goes_unreported(board, seed, rate, frames):
    session = Session(board, random.Random(seed), rate=rate)
    session.run(frames)
    assert sum(session.commands.values()) > frames // 8
    assert session.reported["BoardReset"] > 0 or frames < 1000
