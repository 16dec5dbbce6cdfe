"""The controller against a chip that refuses what its datasheet forbids, and a plain dictionary."""

import random
from collections import deque

import pytest

from rtl.sdram.controller import Controller
from rtl.sdram.timing import AS4C16M16SA_6, AS4C16M16SA_7, MT48LC16M16A2_75, SLOWEST, SdramTiming
from sim.machine.sdram_chip import DATASHEETS, SdramChip, SdramViolation, sdram_bench
from tests.bench import feed, simulate, until

TAG_WIDTH = 8
POWER_UP_NS = 2_000
PARTS = {"AS4C16M16SA-6": AS4C16M16SA_6, "AS4C16M16SA-7": AS4C16M16SA_7, "MT48LC16M16A2-75": MT48LC16M16A2_75}


def word_at(contents, address):
    """A 32-bit word in a chip, whose rows of consecutive kilobytes are in consecutive banks."""
    place = address >> 8 & 3, address >> 10, address % 256 << 1
    return contents.get(place, 0) | contents.get((*place[:2], place[2] + 1), 0) << 16


def random_accesses(rng, count, *, writes, rows, sequential=False):
    """Accesses as the controller takes them, words and masks for those that write."""
    accesses, stores = [], {}
    following = 0
    for number in range(count):
        length = rng.randint(1, 16)
        column = rng.randint(0, 256 - length)
        address = rng.randrange(rows) << 10 | rng.randrange(4) << 8 | column
        if sequential:
            length, address, following = 16, following, following + 16
        write = rng.random() < writes
        # A write's tag is what it is fetched by, and free again when it has been.
        tag = number % (1 << TAG_WIDTH)
        accesses.append({"write": write, "address": address, "left": 0 if write else length - 1,
                         "place": 0 if write else rng.randint(0, 16 - length), "tag": tag})
        stores[number] = rng.getrandbits(32), rng.choice([15, 15, 15, rng.getrandbits(4)])
    return accesses, stores


def run(timing, accesses, stores, *, datasheet, seed=0, gap=0.0, delay=0, ticks=200_000, quiet=40):
    """Does accesses and checks each word read; returns the chip, and the cycles from the first answer to the last."""
    rng = random.Random(seed)
    dut = Controller(timing=timing, tag_width=TAG_WIDTH, input_delay=delay)
    chip = SdramChip(DATASHEETS[datasheet], period=1000 / timing.clock_mhz, power_up=POWER_UP_NS)
    memory, expected = {}, {}
    by_tag = {}
    done = [0]
    taken = [0]
    span = [None, None]

    def expect(number):
        access = accesses[number]
        by_tag[access["tag"]] = number
        if access["write"]:
            word, mask = stores[number]
            keep = sum(0xFF << 8 * byte for byte in range(4) if not mask >> byte & 1)
            address = access["address"]
            memory[address] = memory.get(address, 0) & keep | word & ~keep
        else:
            expected[access["tag"]] = deque(
                (access["place"] + offset, memory.get(access["address"] + offset, 0), offset == access["left"])
                for offset in range(access["left"] + 1))

    async def observe(ctx):
        fetched = None
        async for (_, _, valid, ready, fetch, tag, answer, word, place, answer_tag, last) in ctx.tick().sample(
                dut.access.valid, dut.access.ready, dut.fetch.valid, dut.fetch.tag, dut.answer.valid, dut.answer.word,
                dut.answer.place, dut.answer.tag, dut.answer.last):
            if valid and ready:
                expect(taken[0])
                taken[0] += 1
            if fetched is not None:
                ctx.set(dut.store, {"word": 0, "mask": 0})
            fetched = None
            if fetch:
                number = by_tag[tag]
                assert accesses[number]["write"]
                fetched = stores[number]
                ctx.set(dut.store, {"word": fetched[0], "mask": fetched[1]})
                done[0] += 1
                span[1] = chip.cycle
            if answer:
                assert (place, word, bool(last)) == expected[answer_tag].popleft()
                done[0] += bool(last)
                span[0] = span[0] or chip.cycle
                span[1] = chip.cycle

    simulate(dut, until(lambda: done[0] == len(accesses), quiet=quiet), ticks=ticks, name="controller", background=(
        sdram_bench(dut.pins, chip, delay=delay), observe, feed(dut.access, deque(accesses), rng=rng, gap=gap)))
    assert not any(expected.values())
    for address, value in memory.items():
        assert word_at(chip.contents, address) == value
    return chip, span[1] - (span[0] or 0)


@pytest.mark.parametrize(("seed", "clock_mhz", "datasheet", "gap", "writes", "rows"), [
    (0, 100, "AS4C16M16SA-7", 0.0, 0.3, 3), (1, 125, "AS4C16M16SA-6", 0.2, 0.5, 8000),
    (2, 133, "MT48LC16M16A2-75", 0.0, 0.2, 2), (3, 142, "AS4C16M16SA-7", 0.9, 0.4, 2),
    (4, 80, "MT48LC16M16A2-75", 0.0, 1.0, 2), (5, 125, "AS4C16M16SA-7", 0.5, 0.1, 1),
    (6, 166, "AS4C16M16SA-6", 0.0, 0.3, 3)])
def test_random_accesses(seed, clock_mhz, datasheet, gap, writes, rows):
    rng = random.Random(seed)
    accesses, stores = random_accesses(rng, 250, writes=writes, rows=rows)
    timing = SdramTiming(PARTS[datasheet], clock_mhz=clock_mhz, power_up_ns=POWER_UP_NS)
    chip, _ = run(timing, accesses, stores, datasheet=datasheet, seed=seed, gap=gap)
    assert chip.commands["AUTO REFRESH"] >= 8


@pytest.mark.parametrize("delay", [1, 2])
def test_words_that_come_late(delay):
    accesses, stores = random_accesses(random.Random(delay), 60, writes=0.3, rows=2)
    timing = SdramTiming(SLOWEST, clock_mhz=125, power_up_ns=POWER_UP_NS)
    run(timing, accesses, stores, datasheet="AS4C16M16SA-7", delay=delay)


def test_words_of_rows_follow_each_other_without_a_gap():
    accesses, stores = random_accesses(random.Random(0), 100, writes=0, rows=1, sequential=True)
    timing = SdramTiming(SLOWEST, clock_mhz=133, power_up_ns=POWER_UP_NS)
    chip, cycles = run(timing, accesses, stores, datasheet="MT48LC16M16A2-75")
    refreshes = chip.commands["AUTO REFRESH"]
    # Each refresh costs the closing of rows, itself and the opening of one.
    assert refreshes > 10
    assert 2 * 16 * len(accesses) - 2 <= cycles <= 2 * 16 * len(accesses) + 30 * (refreshes - 8) + 20


def test_rows_are_opened_while_words_of_others_move():
    """Lines of 8 words, each in another row of the next bank, keep the data lines busy."""
    accesses = [{"write": 0, "address": number * 7 << 10 | number % 4 << 8, "left": 7, "place": 0, "tag": number}
                for number in range(100)]
    timing = SdramTiming(SLOWEST, clock_mhz=133, power_up_ns=POWER_UP_NS)
    chip, cycles = run(timing, accesses, {}, datasheet="MT48LC16M16A2-75")
    assert chip.commands["ACTIVE"] >= 100
    assert cycles <= 2 * 8 * len(accesses) + 30 * (chip.commands["AUTO REFRESH"] - 8) + 20


@pytest.mark.parametrize(("name", "rule"), [
    ("rp", "tRP"), ("rfc", "tRFC"), ("write_to_precharge", "tWR"), ("read_to_write", "contention")])
def test_a_distance_too_short_would_be_noticed(name, rule):
    accesses, stores = random_accesses(random.Random(0), 60, writes=0.5, rows=3)
    timing = SdramTiming(SLOWEST, clock_mhz=125, power_up_ns=POWER_UP_NS)
    setattr(timing, name, getattr(timing, name) - 1)
    with pytest.raises(SdramViolation, match=f"^{rule}: "):
        run(timing, accesses, stores, datasheet="MT48LC16M16A2-75")


def test_a_latency_too_short_would_be_noticed():
    timing = SdramTiming(SLOWEST, clock_mhz=125, power_up_ns=POWER_UP_NS)
    timing.cas_latency = 2
    with pytest.raises(SdramViolation, match=r"^tCK: all banks, cycle \d+: CAS latency 2 needs 10 ns"):
        run(timing, [{"write": 0, "address": 0, "left": 0, "place": 0, "tag": 0}], {}, datasheet="AS4C16M16SA-7")
