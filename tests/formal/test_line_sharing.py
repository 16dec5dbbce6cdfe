"""Caches that share a memory port get the words of the lines that they have asked for, and no others.

Any one line is followed. That the memory answers in order and gives no words that nobody has asked for, and that no
cache asks for more lines than it may, is assumed.
"""

import pytest
from amaranth.hdl import Assert, Assume, Cat, Module, Signal

from rtl.line_sharing import LineSharing
from tests.formal.prove import Refuted, prove

LINE_WIDTH = 2


def sharing_proof(*, num_users, num_fetches, line_words, broken=False):
    m = Module()
    m.submodules.sharing = dut = LineSharing(num_users=num_users, num_fetches=num_fetches, line_width=LINE_WIDTH,
                                             line_words=line_words)
    mark, memory_ready, word_valid, word = Signal(), Signal(), Signal(), Signal(32)
    ports = [mark, memory_ready, word_valid, word]
    depth = num_users * num_fetches
    owed = Signal(range(depth + 1))
    place = Signal(range(line_words))
    line_ends = Signal()
    asked = dut.line_request.valid & dut.line_request.ready
    m.d.comb += [dut.line_request.ready.eq(memory_ready), dut.line_data.valid.eq(word_valid),
                 dut.line_data.payload.eq(word), Assume(~word_valid | (owed != 0)),
                 line_ends.eq(word_valid & (place == line_words - 1))]
    m.d.sync += owed.eq(owed + asked - line_ends)
    with m.If(word_valid):
        m.d.sync += place.eq(place + 1)
        with m.If(line_ends):
            m.d.sync += place.eq(0)

    takes, waiting = [], []
    for user, request in enumerate(dut.request):
        valid, line = Signal(name=f"valid{user}"), Signal(LINE_WIDTH, name=f"line{user}")
        outstanding = Signal(range(num_fetches + 1), name=f"outstanding{user}")
        ports += [valid, line]
        takes.append(request.valid & request.ready)
        last = Signal(name=f"last{user}")
        m.d.comb += [request.valid.eq(valid & (outstanding != num_fetches)), request.payload.eq(line),
                     last.eq(dut.data[user].valid & line_ends),
                     Assert(~last | (outstanding != 0)),
                     Assert(~takes[-1] | (dut.line_request.payload == line))]
        m.d.sync += outstanding.eq(outstanding + takes[-1] - last)
        waiting.append(outstanding)
    m.d.comb += [Assert(sum(takes) == asked), Assert(sum(waiting) == owed),
                 Assert(sum(data.valid for data in dut.data) == word_valid),
                 *(Assert(data.payload == word) for data in dut.data)]

    marked, inside, ahead = Signal(), Signal(), Signal(range(depth + 1))
    user = Signal(range(num_users))
    with m.If(mark & ~marked & asked):
        m.d.sync += [marked.eq(1), inside.eq(1), ahead.eq(owed - line_ends)]
        for number, take in enumerate(takes):
            with m.If(take):
                m.d.sync += user.eq((number + broken) % num_users)
    with m.Elif(inside & line_ends):
        m.d.sync += [ahead.eq(ahead - 1), inside.eq(ahead != 0)]
    with m.If(inside & (ahead == 0) & word_valid):
        m.d.comb += Assert(Cat(data.valid for data in dut.data) == 1 << user)
    return m, ports


@pytest.mark.parametrize(("parameters", "cycles"), [
    (dict(num_users=2, num_fetches=1, line_words=2), 12), (dict(num_users=2, num_fetches=2, line_words=1), 12),
    (dict(num_users=3, num_fetches=1, line_words=3), 12)])
def test_words_go_to_whoever_asked(tmp_path, parameters, cycles):
    module, ports = sharing_proof(**parameters)
    prove(module, ports=ports, cycles=cycles, by_induction=False, folder=tmp_path)
    module, ports = sharing_proof(**parameters, broken=True)
    with pytest.raises(Refuted, match="model found"):
        prove(module, ports=ports, cycles=cycles, by_induction=False, folder=tmp_path)
