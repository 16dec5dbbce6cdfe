"""Traversal stack and mailboxed list lose no token and double none.

Who has the token of each thread is kept account of: the unit, or one of those that it gives tokens to and takes them
from. What the others do with it, and when, is free; that they do not make tokens up is assumed.
"""

import pytest
from amaranth.hdl import Assert, Assume, Cat, Const, Module, Mux, Signal, Value

from fpu import FloatFormat
from rtl.mailboxed_list import MailboxedList
from rtl.stack import TraversalStack
from tests.formal.prove import Refuted, prove

FMT = FloatFormat(2, 1)
NUM_THREADS = 2


class Account:
    """Who has each thread's token: the unit is holder 0, and all tokens begin with holder 1."""

    def __init__(self):
        self._taken = []
        self._given = []

    def takes(self, valid, token, *, holder):
        """When the unit takes a token from ``holder``."""
        self._taken.append((valid, token, holder))

    def gives(self, valid, token, *, holder):
        """When the unit gives a token to ``holder``."""
        self._given.append((valid, token, holder))

    def close(self, m, *, patience):
        """Asserts that the unit gives only what it has, and keeps nothing for longer than ``patience`` cycles."""
        for thread in range(NUM_THREADS):
            place = Signal(range(3), init=1, name=f"place{thread}")
            age = Signal(range(patience + 2), name=f"age{thread}")
            # What is taken can go out again in the same cycle.
            has = Signal(name=f"has{thread}")
            m.d.comb += [has.eq(place == 0), Assert((place != 0) | (age <= patience))]
            m.d.sync += age.eq(age + (age <= patience))
            for valid, token, holder in self._taken:
                with m.If(valid & (token.thread == thread)):
                    m.d.comb += [Assume(place == holder), has.eq(1)]
                    m.d.sync += [place.eq(0), age.eq(0)]
            for valid, token, holder in self._given:
                with m.If(valid & (token.thread == thread)):
                    m.d.comb += Assert(has)
                    m.d.sync += place.eq(holder)
            m.d.comb += [Assume(self._number(self._taken, thread) <= 1), Assert(self._number(self._given, thread) <= 1)]

    @staticmethod
    def _number(events, thread):
        return sum((valid & (token.thread == thread) for valid, token, _ in events), Const(0))


class Free:
    """Gives signals any value in any cycle."""

    def __init__(self, m):
        self._m = m
        self.ports = []

    def __call__(self, *targets):
        for target in map(Value.cast, targets):
            value = Signal(len(target), name=f"free{len(self.ports)}")
            self.ports.append(value)
            self._m.d.comb += target.eq(value)


def stack_proof(*, stack_depth, patience):
    m = Module()
    free = Free(m)
    m.submodules.stack = dut = TraversalStack(fmt=FMT, num_threads=NUM_THREADS, stack_depth=stack_depth, index_width=1,
                                              latencies={"cmp": 1})
    free(dut.push, dut.pop.payload, dut.pop.valid, dut.hit_distances)
    m.d.comb += Assume(~dut.push.valid | (dut.push.token.sp < stack_depth))
    m.d.comb += Assume(~dut.pop.valid | (dut.pop.payload.sp <= stack_depth))
    # Who pushes holds the thread's token, and is not popping with it.
    inside = Signal(NUM_THREADS)
    m.d.comb += Assume(~(dut.push.valid & (inside.bit_select(dut.push.token.thread, 1)
                                           | dut.pop.valid & (dut.pop.payload.thread == dut.push.token.thread))))
    for port, token, is_inside in ((dut.resume, dut.resume.payload.token, 0), (dut.exhausted, dut.exhausted.payload, 0),
                                   (dut.pop, dut.pop.payload, 1)):
        with m.If(port.valid & port.ready):
            m.d.sync += inside.bit_select(token.thread, 1).eq(is_inside)
    account = Account()
    account.takes(dut.pop.valid & dut.pop.ready, dut.pop.payload, holder=1)
    account.gives(dut.resume.valid, dut.resume.payload.token, holder=1)
    account.gives(dut.exhausted.valid, dut.exhausted.payload, holder=1)
    account.close(m, patience=patience)
    return m, free.ports


def list_proof(*, patience):
    m = Module()
    free = Free(m)
    m.submodules.list = dut = MailboxedList(num_threads=NUM_THREADS, stack_depth=1, index_width=1, mailbox_entries=1)
    free(dut.begin, *(member for port in (dut.leaf, dut.tested, dut.left, dut.entry)
                      for member in (port.payload, port.valid)))
    m.d.comb += [dut.fetch.ready.eq(1), dut.pop.ready.eq(1)]

    # A packet's first entry comes some cycles after it has begun, and there is a cycle between two that begin.
    entry = dut.entry.payload.payload.token
    begin, began = dut.begin, Signal()
    m.d.sync += began.eq(begin.valid)
    m.d.comb += Assume(~(begin.valid & began))
    for thread in range(NUM_THREADS):
        young = Signal(range(6), name=f"young{thread}")
        begins = Signal(name=f"begins{thread}")
        m.d.comb += [begins.eq(begin.valid & (begin.thread == thread)),
                     Assume(~((begins | young.any()) & dut.entry.valid & (entry.thread == thread)))]
        m.d.sync += young.eq(Mux(begins, 5, young - young.any()))

    # Who comes back to a list has been sent from one.
    sent = Signal(2 * NUM_THREADS)
    for port in (dut.tested, dut.left):
        m.d.comb += Assume(~port.valid | sent.bit_select(Cat(port.payload.level, port.payload.thread), 1))
    with m.If(dut.job.valid):
        m.d.sync += sent.bit_select(Cat(dut.job.payload.token.level, dut.job.payload.token.thread), 1).eq(1)

    rest, cache = 1, 2
    account = Account()
    account.takes(dut.leaf.valid & dut.leaf.ready, dut.leaf.payload.token, holder=rest)
    account.takes(dut.tested.valid & dut.tested.ready, dut.tested.payload, holder=rest)
    account.takes(dut.left.valid & dut.left.ready, dut.left.payload, holder=rest)
    account.takes(dut.entry.valid & dut.entry.ready, entry, holder=cache)
    account.gives(dut.fetch.valid, dut.fetch.payload.payload.token, holder=cache)
    account.gives(dut.job.valid, dut.job.payload.token, holder=rest)
    account.gives(dut.pop.valid, dut.pop.payload, holder=rest)
    account.close(m, patience=patience)
    return m, free.ports


# The longest that a token stays: a cycle less is refuted.
@pytest.mark.parametrize(("proof", "parameters", "patience", "cycles"), [
    (stack_proof, dict(stack_depth=1), 7, 13),
    (stack_proof, dict(stack_depth=2), 14, 18),
    (list_proof, dict(), 7, 16),
])
def test_no_token_is_lost_or_doubled(tmp_path, proof, parameters, patience, cycles):
    module, ports = proof(**parameters, patience=patience)
    prove(module, ports=ports, cycles=cycles, by_induction=False, folder=tmp_path)
    module, ports = proof(**parameters, patience=patience - 1)
    with pytest.raises(Refuted, match="model found"):
        prove(module, ports=ports, cycles=cycles, by_induction=False, folder=tmp_path)
