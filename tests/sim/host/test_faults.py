"""A driver over a link that damages frames."""

import random

import pytest

from sim.host import Board
from tests.sim.host.faulty_link import FAULTS, Session


@pytest.mark.parametrize(("seed", "rate", "frames"), [(1, 0.0, 500), (2, 0.15, 9000), (3, 0.4, 3000)])
def test_nothing_wrong_goes_unreported(seed, rate, frames):
    session = Session(Board(values=Session.values, **Session.shape), random.Random(seed), rate=rate)
    session.run(frames)
    assert sum(session.commands.values()) > frames // 8
    if rate:
        assert all(session.link.faults[fault] > rate * frames / 20 for fault in FAULTS)
        assert session.repeated > 100
        assert session.reported["NoAnswer"] > 0
    assert session.reported["BoardReset"] > 0 or frames < 1000


class Forgetful(Board):
    """A board that does not know that a frame is the last one again."""

    def receive(self, received):
        answer = super().receive(received)
        if self._last is not None:
            frame, refusal = self._last
            self._last = type(frame)(0, frame.sequence), refusal
        return answer


class Repeating(Board):
    """A board that does again what it has done."""

    def _execute(self, kind, words, again):
        return super()._execute(kind, words, False)


class Trusting(Board):
    """A board that does not look at checksums."""

    def receive(self, received):
        answers = []
        for inner in self._deframer.feed(received):
            words = inner[4:-4]
            if len(inner) > 16 and inner[0] == 2:
                address = int.from_bytes(words[:4], "little")
                self.memory[address] = int.from_bytes(words[4:8], "little")
            answers.append(super().receive(b"\xc0" + self._escaped(inner) + b"\xc0"))
        return b"".join(answers)

    @staticmethod
    def _escaped(inner):
        return inner.replace(b"\xdb", b"\xdb\xdd").replace(b"\xc0", b"\xdb\xdc")


@pytest.mark.parametrize("board", [Forgetful, Repeating, Trusting])
def test_a_board_with_a_fault_is_found(board):
    session = Session(board(values=Session.values, **Session.shape), random.Random(5))
    with pytest.raises(AssertionError):
        session.run(3000)
