"""The cache answers every request exactly once, with the data of its own item.

The memory is whatever gives item i the word with i in its lowest bits; it delivers lines in order, after any time.
"""

import pytest
from amaranth.hdl import Assert, Assume, Cat, Module, Signal
from amaranth.lib import data

from rtl.cache import Cache
from rtl.queue import Queue
from tests.formal.prove import Refuted, prove

INDEX_WIDTH = 3


def cache_proof(*, line_items=2, num_fetches=1, num_waiting=3, patience=None, broken=False):
    """A cache whose requests carry their own index, and one of them a mark.

    With ``patience``, memory and receiver never let it wait, and so many cycles must do for the marked request.
    """
    m = Module()
    payload = data.StructLayout({"index": INDEX_WIDTH, "marked": 1})
    m.submodules.cache = dut = Cache(
        item_width=INDEX_WIDTH, payload_shape=payload, index_width=INDEX_WIDTH, num_lines=2, line_items=line_items,
        num_fetches=num_fetches, num_waiting=num_waiting)
    line_width = len(dut.line_request.payload)
    m.submodules.lines = lines = Queue(line_width, depth=num_fetches)
    index, mark, wants, takes, accepts, delivers = (
        Signal(INDEX_WIDTH), *(Signal(name=name) for name in ("mark", "wants", "takes", "accepts", "delivers")))
    ports = [index, mark, wants, takes, accepts, delivers]

    # Requests; no more of them in the cache than it was promised.
    held = Signal(range(num_waiting + 1))
    asked, answered = Signal(), Signal()
    marked, inside = Signal(), Signal()
    request, response = dut.request, dut.response
    m.d.comb += [
        request.valid.eq(wants & (held < num_waiting)),
        request.payload.index.eq(index),
        request.payload.payload.index.eq(index),
        request.payload.payload.marked.eq(mark & ~marked),
        response.ready.eq(takes),
        asked.eq(request.valid & request.ready),
        answered.eq(response.valid & takes),
    ]
    m.d.sync += held.eq(held + asked - answered)
    with m.If(asked & mark & ~marked):
        m.d.sync += [marked.eq(1), inside.eq(1)]
    with m.If(answered & response.payload.payload.marked):
        m.d.sync += inside.eq(0)

    # Memory: a line's words one after the other.
    word = Signal(range(line_items))
    m.d.comb += [
        lines.i.payload.eq(dut.line_request.payload),
        lines.i.valid.eq(dut.line_request.valid & accepts),
        dut.line_request.ready.eq(lines.i.ready & accepts),
        dut.line_data.valid.eq(lines.o.valid & delivers),
        dut.line_data.payload.eq(lines.o.payload * line_items + word),
        lines.o.ready.eq(delivers & (word == line_items - 1)),
    ]
    with m.If(dut.line_data.valid):
        m.d.sync += word.eq(word + 1)
        with m.If(word == line_items - 1):
            m.d.sync += word.eq(0)

    m.d.comb += [
        Assert(~response.valid | (held != 0)),
        Assert(~response.valid | (response.payload.item == response.payload.payload.index ^ broken)),
        Assert(~(response.valid & response.payload.payload.marked) | inside),
        Assert(~dut.line_request.valid | lines.i.ready | ~accepts),
    ]
    if patience:
        age = Signal(range(patience + 2))
        with m.If(inside):
            m.d.sync += age.eq(age + (age <= patience))
        m.d.comb += [Assume(Cat(takes, accepts, delivers).all()), Assert(age <= patience)]
    return m, ports


# The first answer comes in cycle 18.
@pytest.mark.parametrize(("parameters", "cycles"), [
    (dict(), 23),
    (dict(line_items=4), 23),
    (dict(num_fetches=2), 22),
    pytest.param(dict(), 27, marks=pytest.mark.slow),
    pytest.param(dict(num_fetches=2), 25, marks=pytest.mark.slow),
])
def test_answers_are_right_and_not_doubled(tmp_path, parameters, cycles):
    module, ports = cache_proof(**parameters)
    prove(module, ports=ports, cycles=cycles, by_induction=False, folder=tmp_path)


# The longest that a request waits: a cycle less is refuted.
@pytest.mark.parametrize(("num_waiting", "patience", "cycles"), [
    (1, 18, 23), (2, 23, 28)])
def test_every_request_is_answered(tmp_path, num_waiting, patience, cycles):
    module, ports = cache_proof(num_waiting=num_waiting, patience=patience)
    prove(module, ports=ports, cycles=cycles, by_induction=False, folder=tmp_path)
    module, ports = cache_proof(num_waiting=num_waiting, patience=patience - 1)
    with pytest.raises(Refuted, match="model found"):
        prove(module, ports=ports, cycles=cycles, by_induction=False, folder=tmp_path)


def test_a_wrong_claim_is_refuted(tmp_path):
    module, ports = cache_proof(broken=True)
    with pytest.raises(Refuted, match="model found"):
        prove(module, ports=ports, cycles=20, by_induction=False, folder=tmp_path)
