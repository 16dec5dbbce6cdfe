"""An SDRAM's banks keep their distances, refreshes come in time, and nobody waits for ever."""

from dataclasses import replace
from math import ceil

import pytest
from amaranth.hdl import Assert, Assume, Cat, Const, Module, Mux, Signal

from rtl.least_recent import LeastRecent
from rtl.sdram.arbiter import Arbiter
from rtl.sdram.bank import Bank
from rtl.sdram.commands import Command
from rtl.sdram.timing import SLOWEST, SdramTiming
from rtl.sdram.upkeep import Upkeep
from tests.formal.prove import Refuted, prove

#: Few rows and columns
SMALL = replace(SLOWEST, row_width=11, column_width=4)


@pytest.mark.parametrize("num_bidders", [2, 3, 4, 7])
def test_one_bid_is_granted(tmp_path, num_bidders):
    m = Module()
    m.submodules.dut = dut = LeastRecent(num_bidders=num_bidders)
    bid, served = Signal(num_bidders), Signal(num_bidders)
    m.d.comb += [dut.bid.eq(bid), dut.served.eq(served), Assume((served & (served - 1)) == 0),
                 Assert((dut.grant & ~bid) == 0), Assert((dut.grant & (dut.grant - 1)) == 0),
                 Assert(bid.any() == dut.grant.any())]
    prove(m, ports=[bid, served], cycles=4, by_induction=False, folder=tmp_path)


@pytest.mark.parametrize("num_bidders", [2, 3, 4])
def test_nobody_is_passed_over_twice_by_another(tmp_path, num_bidders):
    m = Module()
    m.submodules.dut = dut = LeastRecent(num_bidders=num_bidders)
    bid = Signal(num_bidders)
    m.d.comb += [dut.bid.eq(bid), dut.served.eq(dut.grant)]
    for a in range(num_bidders):
        passed = Signal(num_bidders, name=f"passed_{a}")
        # Its bid may come and go; passed over is who bids.
        with m.If(dut.grant[a]):
            m.d.sync += passed.eq(0)
        with m.Elif(bid[a]):
            m.d.sync += passed.eq(passed | dut.grant)
        m.d.comb += Assert(~(bid[a] & (passed & dut.grant).any()))
    prove(m, ports=[bid], cycles=10, by_induction=False, folder=tmp_path)


def test_a_refresh_comes_in_time(tmp_path):
    """However long rows must stay open after all has stopped, within their times."""
    # A clock at which times are short, and refreshes so often that several fit the proof.
    chip = replace(SMALL, num_init_refreshes=2, t_power_up=100, t_refresh=SMALL.t_refresh / 27)
    timing = SdramTiming(chip, clock_mhz=25)
    assert timing.refresh == 13
    m = Module()
    m.submodules.dut = dut = Upkeep(timing=timing)
    second, may_close = Signal(), Signal()
    longest = max(timing.ras, timing.read_to_precharge, timing.write_to_precharge)
    waited = Signal(range(longest + 1))
    opened = Signal()
    m.d.sync += second.eq(~second)
    m.d.comb += [dut.second.eq(second), dut.may_close.eq(may_close),
                 Assume(may_close | (waited != longest - 1) | ~second)]
    with m.If(second):
        m.d.sync += waited.eq(Mux(dut.hold & ~may_close, waited + 1, 0))
        # Rows are open in between, and closed before the chip is refreshed or its mode is set.
        with m.If(~dut.hold):
            m.d.sync += opened.eq(1)
        with m.If(dut.command == Command.PRECHARGE):
            m.d.sync += opened.eq(0)
            m.d.comb += Assert(may_close)
        with m.If((dut.command == Command.REFRESH) | (dut.command == Command.MODE)):
            m.d.comb += Assert(~opened)
        with m.If(dut.command != Command.NOP):
            m.d.comb += Assert(dut.hold)
    since = Signal(6)
    m.d.sync += since.eq(Mux(second & (dut.command == Command.REFRESH), 0, since + 1))
    m.d.comb += Assert(~dut.ready | (since <= 2 * (timing.refresh + timing.refresh_latest)))
    prove(m, ports=[may_close], cycles=64, by_induction=False, folder=tmp_path)


def bank_proof(*, clock_mhz, broken=""):
    timing = SdramTiming(SMALL, clock_mhz=clock_mhz)
    chip = timing.chip
    m = Module()
    m.submodules.dut = dut = Bank(timing=timing, tag_width=2, depth=2)
    names = ("valid", "write", "row", "left", "turn", "allowed", "hold", "column_grant", "row_grant", "close")
    free = {name: Signal(2 if name in ("row", "left") else 1, name=name) for name in names}
    second, writing = Signal(), Signal()
    m.d.sync += second.eq(~second)
    with m.If(second & free["turn"]):
        m.d.sync += writing.eq(~writing)
    held = Signal()
    taken = Signal(2)
    with m.If(second):
        m.d.sync += held.eq(free["hold"])
    m.d.comb += [
        dut.access.valid.eq(free["valid"]), dut.access.payload.write.eq(free["write"]),
        dut.access.payload.row.eq(free["row"]), dut.access.payload.left.eq(Mux(free["write"], 0, free["left"][0])),
        dut.access.payload.tag.eq(taken),
        dut.second.eq(second), dut.hold.eq(held), dut.writing.eq(writing), dut.column_allowed.eq(free["allowed"]),
        dut.column_granted.eq(free["column_grant"] & dut.column_bid),
        dut.row_granted.eq(free["row_grant"] & dut.row_bid),
        dut.close.eq(free["close"] & second & dut.may_close & held & ~dut.column_bid & ~dut.row_bid),
    ]
    accepted = Signal()
    m.d.comb += accepted.eq(dut.access.valid & dut.access.ready)
    m.d.sync += taken.eq(taken + accepted)

    # What a chip's datasheet would say, in cycles: a slot's row is one cycle before its column.
    def cycles(time):
        return ceil(time * clock_mhz / 1000)

    opened, row = Signal(), Signal(chip.row_width)
    ages = {name: Signal(4, name=f"since_{name}", init=15) for name in ("activate", "precharge", "read", "write")}
    for age in ages.values():
        m.d.sync += age.eq(Mux(age == 15, 15, age + 1))
    activates, precharges, moves = Signal(), Signal(), Signal()
    m.d.comb += [activates.eq(second & dut.row_granted & ~dut.closing),
                 precharges.eq(second & (dut.row_granted & dut.closing | dut.close)),
                 moves.eq(second & dut.column_granted)]
    more = int(broken == "time")
    with m.If(activates):
        m.d.sync += [opened.eq(1), row.eq(dut.row), ages["activate"].eq(1)]
        m.d.comb += [Assert(~opened), Assert(ages["precharge"] >= cycles(chip.t_rp) + 2 * more),
                     Assert(ages["activate"] >= cycles(chip.t_rc))]
    with m.If(precharges):
        m.d.sync += [opened.eq(0), ages["precharge"].eq(1)]
        with m.If(opened):
            # A column at its own cycle is one later than the grant says.
            m.d.comb += [Assert(ages["activate"] >= cycles(chip.t_ras)), Assert(ages["read"] - 1 >= 2),
                         Assert(ages["write"] - 1 >= 1 + cycles(chip.t_wr))]
    with m.If(moves):
        with m.If(writing):
            m.d.sync += ages["write"].eq(1)
        with m.Else():
            m.d.sync += ages["read"].eq(1)
        m.d.comb += [Assert(opened), Assert(ages["activate"] + 1 >= cycles(chip.t_rcd))]

    # One access is followed: its words come after those of all before it, in its row, and in its direction.
    mark = Signal()
    marked, ahead, left, wrote, where = Signal(), Signal(3), Signal(2), Signal(), Signal(2)
    pending, ends = Signal(3), Signal()
    m.d.comb += ends.eq(moves & dut.finishing)
    m.d.sync += pending.eq(pending + accepted - ends)
    inside = Signal()
    with m.If(accepted & mark & ~marked):
        m.d.sync += [marked.eq(1), inside.eq(1), ahead.eq(pending - ends), left.eq(dut.access.payload.left),
                     wrote.eq(free["write"]), where.eq(free["row"] ^ int(broken == "row"))]
    with m.Elif(inside & moves):
        with m.If(ahead != 0):
            m.d.sync += ahead.eq(ahead - ends)
        with m.Else():
            m.d.comb += [Assert(row == where), Assert(writing == wrote), Assert(dut.finishing == (left == 0))]
            m.d.sync += [left.eq(left - 1), inside.eq(left != 0)]
    return m, [*free.values(), mark]


@pytest.mark.parametrize(("clock_mhz", "cycles"), [
    (60, 19), pytest.param(133, 32, marks=pytest.mark.slow)])
def test_a_bank_keeps_its_distances_and_its_order(tmp_path, clock_mhz, cycles):
    module, ports = bank_proof(clock_mhz=clock_mhz)
    prove(module, ports=ports, cycles=cycles, by_induction=False, folder=tmp_path)


@pytest.mark.parametrize("broken", ["time", "row"])
def test_a_wrong_claim_of_a_bank_is_refuted(tmp_path, broken):
    module, ports = bank_proof(clock_mhz=60, broken=broken)
    with pytest.raises(Refuted, match="model found"):
        prove(module, ports=ports, cycles=19, by_induction=False, folder=tmp_path)


def arbiter_proof(num_sources, *, in_a_row, bound):
    """A source that is always able to go goes after so many others at the latest, however urgent they are."""
    m = Module()
    m.submodules.dut = dut = Arbiter(chip=SMALL, tag_width=1, num_sources=num_sources, urgent_in_a_row=in_a_row)
    valid, urgent, room, payloads = Signal(num_sources), Signal(num_sources), Signal(4), []
    ready = Cat(source.ready for source in dut.source)
    waits, all_ready = Signal(num_sources), Signal(num_sources)
    m.d.comb += [dut.access.ready.eq(1), dut.urgent.eq(urgent), dut.room.eq(room | 1), all_ready.eq(ready)]
    m.d.sync += waits.eq(valid & ~all_ready)
    number = Signal(range(num_sources))
    for index, source in enumerate(dut.source):
        payload = Signal(len(source.payload.as_value()), name=f"payload_{index}")
        last = Signal.like(payload, name=f"last_{index}")
        payloads.append(payload)
        m.d.sync += last.eq(payload)
        m.d.comb += [
            source.valid.eq(valid[index]), source.payload.as_value().eq(payload),
            # What is offered stays.
            Assume(~waits[index] | valid[index] & (payload == last)),
            Assert(~all_ready[index] | valid[index]),
        ]
        with m.If(all_ready[index]):
            m.d.comb += number.eq(index)
    # The first source's bank, number 0, has room.
    low = SMALL.column_width - 1
    waited = Signal(range(bound + 2))
    taken = Signal(len(payloads[0]))
    m.d.sync += taken.eq(Mux(all_ready.any(), Cat(payloads).word_select(number, len(payloads[0])), taken))
    m.d.comb += [
        Assume(dut.source[0].payload.address[low:low + 2] == 0),
        Assert((all_ready & (all_ready - 1)) == 0),
        Assert(~dut.access.valid | (dut.access.payload.as_value() == taken)),
        Assert(waited <= bound),
    ]
    with m.If(~valid[0] | all_ready[0]):
        m.d.sync += waited.eq(0)
    with m.Elif(all_ready.any()):
        m.d.sync += waited.eq(waited + 1)
    return m, [valid, urgent, room, *payloads, Const(0)][:-1]


@pytest.mark.parametrize(("num_sources", "in_a_row", "bound"), [(2, 1, 3), (3, 2, 7)])
def test_no_source_waits_for_ever(tmp_path, num_sources, in_a_row, bound):
    module, ports = arbiter_proof(num_sources, in_a_row=in_a_row, bound=bound)
    prove(module, ports=ports, cycles=24, by_induction=False, folder=tmp_path)


def test_a_bound_too_low_is_refuted(tmp_path):
    module, ports = arbiter_proof(2, in_a_row=2, bound=1)
    with pytest.raises(Refuted, match="model found"):
        prove(module, ports=ports, cycles=24, by_induction=False, folder=tmp_path)
