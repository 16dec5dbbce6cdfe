"""Queue and Merge lose nothing, double nothing, keep the order."""

import pytest
from amaranth.hdl import Assert, Assume, Cat, Const, Module, Signal

from rtl.queue import Merge, Queue
from tests.formal.prove import Refuted, prove

WIDTH = 2


def queue_proof(depth, *, block=False, always_ready=False, broken=False):
    """Any one element is followed through a queue: its place, and what it was."""
    m = Module()
    m.submodules.queue = dut = Queue(WIDTH, depth=depth, always_ready=always_ready, block=block)
    payload, valid, ready, mark = Signal(WIDTH), Signal(), Signal(), Signal()
    wrote, reads = Signal(), Signal()
    marked, inside, value = Signal(), Signal(), Signal(WIDTH)
    ahead, held = Signal(range(depth + 2)), Signal(range(depth + 2))
    had_one = Signal()
    m.d.comb += [
        dut.i.payload.eq(payload),
        # The writer that does not look at ``ready`` has other grounds to know that there is room.
        dut.i.valid.eq(valid & (held < depth) if always_ready else valid),
        dut.o.ready.eq(ready),
        wrote.eq(dut.i.valid & dut.i.ready),
        reads.eq(dut.o.valid & ready),
        Assert(dut.level == held),
        # From block RAM, what found only one other there may come a cycle later.
        Assert((dut.o.valid == (held != 0)) | (block & ~dut.o.valid & had_one)),
        Assert(dut.i.ready == (1 if always_ready else held < depth)),
    ]
    m.d.sync += [held.eq(held + wrote - reads), had_one.eq(reads)]
    with m.If(wrote & mark & ~marked):
        m.d.sync += [marked.eq(1), inside.eq(1), value.eq(payload ^ broken), ahead.eq(held - reads)]
    with m.Elif(inside & reads):
        m.d.sync += [ahead.eq(ahead - 1), inside.eq(ahead != 0)]
    with m.If(inside & (ahead == 0)):
        m.d.comb += Assert((dut.o.valid | (block & had_one)) & (~dut.o.valid | (dut.o.payload == value)))
    return m, [payload, valid, ready, mark]


@pytest.mark.parametrize(("depth", "always_ready", "block", "cycles"), [
    (1, False, False, 10), (2, True, False, 14), (3, False, False, 16), (3, True, True, 14), (2, False, True, 12)])
def test_queue(tmp_path, depth, always_ready, block, cycles):
    module, ports = queue_proof(depth, always_ready=always_ready, block=block)
    prove(module, ports=ports, cycles=cycles, by_induction=False, folder=tmp_path)


def test_a_wrong_claim_is_refuted(tmp_path):
    module, ports = queue_proof(2, broken=True)
    with pytest.raises(Refuted, match="model found"):
        prove(module, ports=ports, cycles=6, by_induction=False, folder=tmp_path)


def merge_proof(num_inputs):
    m = Module()
    m.submodules.merge = dut = Merge(WIDTH, num_inputs=num_inputs)
    ready = Signal()
    ports, taken = [ready], []
    m.d.comb += dut.o.ready.eq(ready)
    for number, port in enumerate(dut.i):
        payload, valid = Signal(WIDTH, name=f"payload{number}"), Signal(name=f"valid{number}")
        take = Signal(name=f"take{number}")
        m.d.comb += [port.payload.eq(payload), port.valid.eq(valid), take.eq(valid & port.ready)]
        ports += [payload, valid]
        taken.append(take)
    return m, dut, ports, taken


@pytest.mark.parametrize("num_inputs", [1, 2, 3])
def test_merge_passes_each_element_once(tmp_path, num_inputs):
    m, dut, ports, taken = merge_proof(num_inputs)
    num_taken = Signal(range(num_inputs + 1))
    m.d.comb += [
        num_taken.eq(sum(taken, Const(0))),
        Assert(num_taken == (dut.o.valid & dut.o.ready)),
        Assert(dut.o.valid == Cat(port.valid for port in dut.i).any()),
        *(Assert(~take | (dut.o.payload == port.payload)) for port, take in zip(dut.i, taken, strict=True)),
    ]
    prove(m, ports=ports, cycles=2, by_induction=True, folder=tmp_path)


@pytest.mark.parametrize("num_inputs", [2, 3])
def test_merge_offers_an_element_until_it_is_taken(tmp_path, num_inputs):
    m, dut, ports, _ = merge_proof(num_inputs)

    def holds(port, name):
        """Whether what the stream has offered before, and nobody took, is there still."""
        waits, last = Signal(name=f"{name}_waits"), Signal(WIDTH, name=f"{name}_last")
        m.d.sync += [waits.eq(port.valid & ~port.ready), last.eq(port.payload)]
        return ~waits | port.valid & (port.payload == last)

    m.d.comb += [*(Assume(holds(port, f"input{number}")) for number, port in enumerate(dut.i)),
                 Assert(holds(dut.o, "output"))]
    prove(m, ports=ports, cycles=12, by_induction=False, folder=tmp_path)


@pytest.mark.parametrize("num_inputs", [2, 3])
def test_merge_is_fair(tmp_path, num_inputs):
    """Whoever waits is passed over at most once by each other input."""
    m, dut, ports, taken = merge_proof(num_inputs)
    for number, (port, take) in enumerate(zip(dut.i, taken, strict=True)):
        waited = Signal(range(num_inputs + 1), name=f"waited{number}")
        m.d.sync += waited.eq(0)
        with m.If(port.valid & ~take):
            m.d.sync += waited.eq(waited + (dut.o.valid & dut.o.ready))
        m.d.comb += Assert(waited < num_inputs)
    prove(m, ports=ports, cycles=12, by_induction=False, folder=tmp_path)
