"""Hardware and its description in Python answer the same bytes to the same frames, sensible or not."""

import random

import pytest

from rtl.host.protocol import MAX_WORDS, Command
from sim.host import Board, Frame
from sim.host.wire import pack_words
from tests.rtl.host.verilated import VerilatedBoard
from tests.sim.host.faulty_link import FaultyLink, Session


@pytest.fixture(scope="module")
def hardware():
    hardware = VerilatedBoard(values=Session.values(), **Session.shape)
    yield hardware
    hardware.close()


class Counting(Board):
    """Counts words written."""

    words_written = 0

    def _execute(self, kind, words, again):
        if kind == Command.WRITE and not again:
            self.words_written += len(words) - 1
        return super()._execute(kind, words, again)


def random_frame(rng, sequence):
    """Most follow the last one; most words are near what is allowed."""
    kind = rng.choice([*Command, *Command, Command.WRITE, Command.READ, 0, 7, 0x82, 0xFF, rng.randrange(256)])
    sequence = rng.choice([sequence + 1] * 6 + [sequence, sequence + 2, rng.randrange(256)]) % 256
    length = rng.choice([0, 1, 2, 2, 2, 3, 10, MAX_WORDS, MAX_WORDS + 1, MAX_WORDS + 2, MAX_WORDS + 40])
    edge = rng.choice([0, 1, 2, 4090, 4095, 4096, 6, 10, 13, MAX_WORDS, 0xFFFFFFFF, 0x80000000])
    words = [edge, rng.choice([0, 1, 2, 3, MAX_WORDS, MAX_WORDS + 1, 0xFFFFFFFF, 0x100000001 - edge & 0xFFFFFFFF]),
             *(rng.getrandbits(32) for _ in range(length))]
    return Frame(kind, sequence, pack_words(words[:length]))


@pytest.mark.parametrize(("seed", "rate"), [(1, 0.0), (2, 0.3)])
def test_answers_are_the_same(hardware, seed, rate):
    rng = random.Random(seed)
    model = Counting(values=Session.values, **Session.shape)
    link = FaultyLink(model, rng, rate=rate)
    hardware.reset()
    model.memory = dict(hardware.memory)
    starts, written, sequence, answers = hardware.starts, hardware.words_written, 0, set()
    for number in range(3000):
        if rng.random() < 0.05 or number == 0:
            frame = Frame(Command.OPEN, rng.randrange(256), pack_words([rng.getrandbits(32)]))
        else:
            frame = random_frame(rng, sequence)
        ready = rng.random() < 0.7
        hardware.ready = model.ready = ready
        # What comes while a frame is answered is missed by the hardware alone, so frames come one by one.
        for piece in link._frames(link.damaged(frame.encode())):
            answer = hardware.receive(piece)
            assert answer == model.receive(piece), f"frame {number}: {frame}"
            answers.add(answer[1:2])
        if model._last is not None:
            sequence = model._last[0].sequence
        assert hardware.registers == model.registers
        # A frame that is doubled is not done again, though that would write the same.
        assert hardware.words_written - written == model.words_written
    assert hardware.memory == model.memory
    assert hardware.starts - starts == model.starts
    assert {bytes([0x80 | kind]) for kind in Command} | {b"\xff"} <= answers
