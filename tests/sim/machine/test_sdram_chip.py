"""The SDRAM chip takes what its datasheet allows, and each thing that it forbids is refused; in C++ as in Python."""

import ctypes
import random
import subprocess
from dataclasses import replace
from pathlib import Path

import pytest

import sim.machine
from sim.machine.library import compiler
from sim.machine.sdram_chip import DATASHEETS, SdramChip, SdramViolation

PART = "AS4C16M16SA-7"
PERIOD = 7.5
POWER_UP = 100 * PERIOD
MODE, REFRESH, PRECHARGE, ACTIVE, WRITE, READ, TERMINATE, NOP = range(8)
ALL = 1 << 10
#: CAS latency 3, bursts of 2
CL3 = 0x31

#: Time after power-up, as a command, bank and address at a cycle.
INIT = [(100, PRECHARGE, 0, ALL), (103, REFRESH, 0, 0), (112, REFRESH, 0, 0), (121, MODE, 0, CL3)]
#: The first cycle in which a row may be opened.
READY = 123


class Driver:
    """Gives commands at cycles, with data where the controller drives them."""

    def __init__(self, commands, *, data=None, masks=None, sheet=DATASHEETS[PART], cke=lambda cycle: 1):
        self.chip = SdramChip(sheet, period=PERIOD, power_up=POWER_UP)
        self._commands = {cycle: rest for cycle, *rest in commands}
        self._data, self._masks, self._cke = data or {}, masks or {}, cke
        self.seen = {}

    def run(self, cycles):
        for cycle in range(cycles):
            command, bank, a = self._commands.get(cycle, (NOP, 0, 0))
            out = self.chip.edge(cke=self._cke(cycle), cs_n=0, ras_n=command >> 2, cas_n=command >> 1 & 1,
                                 we_n=command & 1, ba=bank, a=a, dqm=self._masks.get(cycle, 0),
                                 dq=self._data.get(cycle))
            if out is not None:
                self.seen[cycle + 1] = out
        return self


def refused(commands, message, *, cycles=400, **parameters):
    with pytest.raises(SdramViolation) as caught:
        Driver(commands, **parameters).run(cycles)
    assert str(caught.value).startswith(message), caught.value


def after(*commands):
    """The power-up sequence and commands at cycles counted from its end."""
    return [*INIT, *((READY + cycle, *rest) for cycle, *rest in commands)]


def test_words_are_written_and_read():
    commands = after((0, ACTIVE, 2, 77), (3, WRITE, 2, 10), (5, READ, 2, 10), (7, READ, 2, 12), (9, PRECHARGE, 2, 0))
    driver = Driver(commands, data={READY + 3: 0x1234, READY + 4: 0x5678}).run(200)
    assert driver.chip.contents == {(2, 77, 10): 0x1234, (2, 77, 11): 0x5678}
    # CAS latency 3 after its command, and the second burst right behind
    assert driver.seen == {READY + 8: 0x1234, READY + 9: 0x5678, READY + 10: 0, READY + 11: 0}
    assert driver.chip.data_cycles == 6


def test_masks():
    commands = after((0, ACTIVE, 0, 1), (3, WRITE, 0, 0), (6, READ, 0, 0))
    masks = {READY + 3: 0b01, READY + 4: 0b10, READY + 7: 0b01, READY + 8: 0b10}
    driver = Driver(commands, masks=masks, data={READY + 3: 0x1234, READY + 4: 0x5678}).run(200)
    assert driver.chip.contents == {(0, 1, 0): 0x1200, (0, 1, 1): 0x0078}
    # A mask reaches what is read two cycles later; what is masked is whatever is on the lines.
    assert (driver.seen[READY + 9] >> 8, driver.seen[READY + 10] & 255) == (0x12, 0x78)
    assert driver.seen[READY + 9] & 255 == 0x5A


def test_bursts_wrap():
    driver = Driver([*INIT[:3], (121, MODE, 0, 0x32), *((READY + cycle, *rest) for cycle, *rest in (
        (0, ACTIVE, 1, 0), (3, WRITE, 1, 6)))], data={READY + 3 + beat: beat + 1 for beat in range(4)}).run(200)
    assert driver.chip.contents == {(1, 0, 6): 1, (1, 0, 7): 2, (1, 0, 4): 3, (1, 0, 5): 4}


def test_a_closed_bank_ends_a_read():
    driver = Driver([*INIT[:3], (121, MODE, 0, 0x33), *((READY + cycle, *rest) for cycle, *rest in (
        (0, ACTIVE, 1, 0), (3, READ, 1, 0), (7, PRECHARGE, 1, 0)))]).run(200)
    # Words come until CAS latency cycles after the command.
    assert sorted(driver.seen) == [READY + 3 + 3 + beat for beat in range(4)]


@pytest.mark.parametrize(("commands", "message"), [
    ([(99, PRECHARGE, 0, ALL)], "power-up: all banks, cycle 99: PRECHARGE after 742.5 ns; at least 750"),
    ([(100, REFRESH, 0, 0)], "initialization: all banks, cycle 100: AUTO REFRESH before all banks were precharged"),
    ([(100, PRECHARGE, 0, 0)], "initialization: all banks, cycle 100"),
    ([*INIT[:2], (121, MODE, 0, CL3), (130, ACTIVE, 1, 5)],
     "initialization: bank 1, cycle 130: ACTIVE before 2 refreshes and the mode"),
    ([*INIT[:3], (130, ACTIVE, 1, 5)], "initialization: bank 1, cycle 130"),
    ([*INIT[:3], (121, MODE, 0, 0x34)], "mode: all banks, cycle 121: 0x34 for bank address 0 is reserved"),
    ([*INIT[:3], (121, MODE, 1, CL3)], "mode: all banks, cycle 121"),
    ([*INIT[:3], (121, MODE, 0, 0x21)], "tCK: all banks, cycle 121: CAS latency 2 needs 10 ns"),
    ([INIT[0], (102, REFRESH, 0, 0)], "tRP: bank 0, cycle 102: AUTO REFRESH after 15 ns; at least 21"),
    ([*INIT[:2], (111, REFRESH, 0, 0)], "tRFC: bank 0, cycle 111: AUTO REFRESH after 60 ns; at least 63"),
    (after((-1, ACTIVE, 0, 5)), "tMRD: bank 0, cycle 122: ACTIVE after 7.5 ns; at least 14"),
    (after((0, ACTIVE, 3, 5), (2, READ, 3, 0)), "tRCD: bank 3, cycle 125: READ after 15 ns; at least 21"),
    (after((0, ACTIVE, 3, 5), (2, WRITE, 3, 0)), "tRCD: bank 3, cycle 125: WRITE after 15 ns; at least 21"),
    (after((0, READ, 3, 0)), "state: bank 3, cycle 123: READ while no row is open"),
    (after((0, WRITE, 3, 0)), "state: bank 3, cycle 123: WRITE while no row is open"),
    (after((0, ACTIVE, 3, 5), (3, READ, 2, 0)), "state: bank 2, cycle 126: READ while no row is open"),
    (after((0, ACTIVE, 3, 5), (3, READ, 3, ALL)), "state: bank 3, cycle 126: READ with automatic precharge"),
    (after((0, ACTIVE, 3, 5), (20, ACTIVE, 3, 6)), "state: bank 3, cycle 143: ACTIVE while row 5 is open"),
    (after((0, ACTIVE, 3, 5), (1, ACTIVE, 2, 5)), "tRRD: bank 2, cycle 124: ACTIVE after 7.5 ns; at least 14"),
    (after((0, ACTIVE, 3, 5), (5, PRECHARGE, 3, 0)), "tRAS: bank 3, cycle 128: PRECHARGE after 37.5 ns; at least 42"),
    (after((0, ACTIVE, 3, 5), (5, PRECHARGE, 0, ALL)), "tRAS: bank 3, cycle 128"),
    (after((0, ACTIVE, 3, 5), (6, PRECHARGE, 3, 0), (8, ACTIVE, 3, 6)),
     "tRP: bank 3, cycle 131: ACTIVE after 15 ns; at least 21"),
    (after((0, ACTIVE, 3, 5), (10, REFRESH, 0, 0)), "state: bank 3, cycle 133: AUTO REFRESH while row 5 is open"),
    (after((0, ACTIVE, 3, 5), (10, MODE, 0, CL3)), "state: bank 3, cycle 133: LOAD MODE REGISTER while row 5 is open"),
    (after((0, TERMINATE, 0, 0)), "state: all banks, cycle 123: BURST TERMINATE is not modelled"),
    (after((0, ACTIVE, 3, 5), (3, READ, 3, 0), (5, WRITE, 3, 0)),
     "contention: bank 3, cycle 128: WRITE while words are still to come"),
    (after((0, ACTIVE, 3, 5), (3, WRITE, 3, 0)), "data: bank 3, cycle 126: a word is written that nobody drives"),
])
def test_it_would_be_refused(commands, message):
    refused(commands, message)


def test_a_row_may_come_again_only_after_its_cycle():
    # Of the parts here, the other times see to that.
    sheet = replace(DATASHEETS[PART], trc=70)
    refused(after((0, ACTIVE, 1, 0), (6, PRECHARGE, 1, 0), (9, ACTIVE, 1, 1)),
            "tRC: bank 1, cycle 132: ACTIVE after 67.5 ns; at least 70", sheet=sheet)
    Driver(after((0, ACTIVE, 1, 0), (6, PRECHARGE, 1, 0), (10, ACTIVE, 1, 1)), sheet=sheet).run(150)


def test_what_is_written_must_have_arrived():
    data = {READY + 3 + number: 7 for number in range(20)}
    commands = after((0, ACTIVE, 1, 5), (3, WRITE, 1, 0), (5, WRITE, 1, 2))
    Driver([*commands, (READY + 8, PRECHARGE, 1, 0)], data={READY + 3 + n: 7 for n in range(4)}).run(150)
    refused([*commands, (READY + 7, PRECHARGE, 1, 0)], "tWR: bank 1, cycle 130: PRECHARGE after 7.5 ns; at least 14",
            data=data)
    refused([*commands, (READY + 6, PRECHARGE, 1, 0)], "tWR: bank 1, cycle 129: PRECHARGE before the burst is written",
            data=data)


@pytest.mark.parametrize(("driven", "message"), [
    (6, "contention: all banks, cycle 129: chip and controller drive the data lines"),
    (7, "contention: all banks, cycle 130: chip and controller drive the data lines"),
    (8, "contention: all banks, cycle 131: the controller drives the data lines while the chip is letting go (tHZ)")])
def test_contention(driven, message):
    commands = after((0, ACTIVE, 1, 5), (3, READ, 1, 0))
    refused(commands, message, data={READY + driven: 7})
    Driver(commands, data={READY + 5: 7, READY + 9: 7}).run(200)


def test_clock_enable():
    refused(INIT, "CKE: all banks, cycle 140: low; power-down is not modelled", cke=lambda cycle: cycle != 140)


def test_too_fast_a_clock():
    with pytest.raises(SdramViolation, match=r"tCK: a period of 5 ns is too short; at least 6\.0"):
        SdramChip(DATASHEETS["AS4C16M16SA-6"], period=5)


def test_refreshes_must_not_be_missing():
    interval = int(7812.5 / PERIOD)
    later = [(112 + number * interval, REFRESH, 0, 0) for number in range(1, 4)]
    # Eight may be owed, and as many be ahead, of which the initial one is one.
    last = 112 + 3 * interval
    Driver([*INIT, *later]).run(last + 9 * interval)
    refused([*INIT, *later], "tREF: all banks", cycles=last + 11 * interval)


def test_rows_must_not_be_open_too_long():
    refresh = DATASHEETS[PART].tras_max / PERIOD
    refused(after((0, ACTIVE, 1, 5), (int(refresh) + 2, PRECHARGE, 1, 0)), "tRE", cycles=int(refresh) + 200)
    # Where refreshes were not missing as well
    chip = SdramChip(DATASHEETS[PART], period=1000.0, power_up=0)
    for command, a in ((PRECHARGE, ALL), (REFRESH, 0), (REFRESH, 0), (MODE, CL3), (ACTIVE, 5)):
        chip.edge(cke=1, cs_n=0, ras_n=command >> 2, cas_n=command >> 1 & 1, we_n=command & 1, ba=0, a=a, dqm=0)
    chip._refresh_due = None
    for _ in range(121):
        chip.edge(cke=1, cs_n=1, ras_n=1, cas_n=1, we_n=1, ba=0, a=0, dqm=0)
    with pytest.raises(SdramViolation, match="tRAS max: bank 0"):
        chip.edge(cke=1, cs_n=0, ras_n=0, cas_n=1, we_n=0, ba=0, a=0, dqm=0)


_HARNESS = r"""
#include <cstring>
#include "sdram_chip.h"
extern "C" {
sdram::Chip* chip_new(int sheet, double period, double power_up) {
    return new sdram::Chip(sdram::datasheets[sheet], period, power_up);
}
void chip_delete(sdram::Chip* chip) { delete chip; }
int chip_edge(sdram::Chip* chip, int cke, int command, int ba, int a, int dqm, int dq) {
    return chip->edge({bool(cke), false, bool(command >> 2), bool(command >> 1 & 1), bool(command & 1), dq >= 0,
                       unsigned(ba), unsigned(a), unsigned(dqm), unsigned(dq)});
}
uint64_t chip_violations(sdram::Chip* chip) { return chip->violations; }
const char* chip_message(sdram::Chip* chip) { return chip->first_violation.c_str(); }
}
"""


@pytest.fixture(scope="module")
def library(tmp_path_factory):
    folder = tmp_path_factory.mktemp("chip")
    (folder / "chip.cpp").write_text(_HARNESS)
    subprocess.run([*compiler(), "-std=c++17", "-O1", "-fPIC", "-shared", f"-I{Path(sim.machine.__file__).parent}",
                    "chip.cpp", "-o", "chip.so"], cwd=folder, check=True)
    library = ctypes.CDLL(str(folder / "chip.so"))
    library.chip_new.restype = ctypes.c_void_p
    library.chip_violations.restype = ctypes.c_uint64
    library.chip_message.restype = ctypes.c_char_p
    return library


def random_commands(rng, *, careless):
    """What a controller might do: mostly with enough time in between, but for a part ``careless`` of the distances."""
    commands, data, masks = list(INIT), {}, {}
    cycle, opened = READY, {}
    busy_until = 0
    for _ in range(60):
        def wait(most):
            return rng.randint(0, most) if rng.random() < careless else most
        bank = rng.randrange(4)
        if bank not in opened:
            cycle += wait(4)
            opened[bank] = rng.randrange(4)
            commands.append((cycle, ACTIVE, bank, opened[bank]))
            cycle += wait(3)
        elif rng.random() < 0.3:
            cycle += wait(7)
            commands.append((cycle, PRECHARGE, bank, 0))
            del opened[bank]
            cycle += wait(3)
        elif rng.random() < 0.5:
            commands.append((cycle, READ, bank, rng.randrange(6)))
            busy_until = cycle + 6
            cycle += rng.randint(1, 4)
        else:
            cycle = max(cycle, busy_until - (rng.random() < careless))
            commands.append((cycle, WRITE, bank, rng.randrange(6)))
            for beat in range(2):
                data[cycle + beat] = rng.getrandbits(16)
                masks[cycle + beat] = rng.choice([0, 0, 1, 2, 3])
            cycle += 2
    return commands, data, masks


@pytest.mark.parametrize("careless", [0.0, 0.05, 0.5])
def test_the_chip_in_cpp_is_the_same(library, careless):
    rules = set()
    for seed in range(60):
        commands, data, masks = random_commands(random.Random(seed), careless=careless)
        python = SdramChip(DATASHEETS[PART], period=PERIOD, power_up=POWER_UP)
        chip = ctypes.c_void_p(library.chip_new([*DATASHEETS].index(PART), ctypes.c_double(PERIOD),
                                                ctypes.c_double(POWER_UP)))
        at = {cycle: rest for cycle, *rest in commands}
        try:
            for cycle in range(commands[-1][0] + 10):
                command, bank, a = at.get(cycle, (NOP, 0, 0))
                mask, dq = masks.get(cycle, 0), data.get(cycle)
                got = library.chip_edge(chip, 1, command, bank, a, mask, -1 if dq is None else dq)
                try:
                    out = python.edge(cke=1, cs_n=0, ras_n=command >> 2, cas_n=command >> 1 & 1, we_n=command & 1,
                                      ba=bank, a=a, dqm=mask, dq=dq)
                except SdramViolation as violation:
                    rule, cycle_text = str(violation).split(":")[0], f"cycle {cycle}:"
                    message = library.chip_message(chip).decode()
                    assert message.split(":")[0] == rule
                    assert cycle_text in message
                    rules.add(rule)
                    break
                assert library.chip_violations(chip) == 0, library.chip_message(chip).decode()
                assert got == (0x5A5A if out is None else out)
        finally:
            library.chip_delete(chip)
    if not careless:
        assert not rules
    else:
        assert len(rules) >= 3
