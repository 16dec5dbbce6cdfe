"""All ports of a memory at once, against a plain dictionary."""

import random
from collections import deque

import pytest

from rtl.sdram.memory import SdramMemory
from rtl.sdram.timing import SLOWEST, SdramTiming
from sim.machine.sdram_chip import DATASHEETS, SdramChip, sdram_bench
from tests.bench import drain, feed, simulate, steady, until

POWER_UP_NS = 1_000
#: Words that may be on their way to the chip
_NUM_WRITES = 40


class Reference:
    """The chip's words, and what is under way.

    Nobody reads what is being written, and nobody writes what is read, or what another one is writing.
    """

    def __init__(self, rng):
        self._rng = rng
        self.words = {}
        self._written = deque(maxlen=_NUM_WRITES)
        self._read = {}

    def fill(self, chip, first, count):
        for address in range(first, first + count):
            value = self._rng.getrandbits(32)
            self.words[address] = value
            place = address >> 8 & 3, address >> 10, address % 256 << 1
            chip.contents[place] = value & 0xFFFF
            chip.contents[*place[:2], place[2] + 1] = value >> 16

    def begin(self, addresses):
        """The words of a line that is going to be read, or None if it must not be now."""
        if any(address == written for address in addresses for _, written in self._written):
            return None
        for address in addresses:
            self._read[address] = self._read.get(address, 0) + 1
        return [self.words.get(address, 0) for address in addresses]

    def end(self, address):
        self._read[address] -= 1

    def write(self, writer, address, word, mask):
        if self._read.get(address) or any(address == written and other != writer for other, written in self._written):
            return False
        keep = sum(0xFF << 8 * byte for byte in range(4) if not mask >> byte & 1)
        self.words[address] = self.words.get(address, 0) & keep | word & ~keep
        self._written.append((writer, address))
        return True


@pytest.mark.parametrize(("seed", "readers", "num_writers", "display", "gap", "span"), [
    (0, {"nodes": (4, 19), "matrices": (9, 18), "shading": (7, 18)}, 2, True, 0.0, 1 << 12),
    (1, {"nodes": (2, 20), "lists": (4, 19), "matrices": (9, 18), "textures": (16, 17)}, 1, True, 0.4, 1 << 20),
    (2, {"host": (1, 23)}, 1, False, 0.1, 1 << 8), (3, {"matrices": (9, 10)}, 0, False, 0.0, 1 << 12),
    (4, {}, 0, True, 0.2, 1 << 12)])
def test_every_port_gets_its_words_in_order(seed, readers, num_writers, display, gap, span):
    rng = random.Random(seed)
    timing = SdramTiming(SLOWEST, clock_mhz=120, power_up_ns=POWER_UP_NS)
    chip = SdramChip(DATASHEETS["AS4C16M16SA-7"], period=1000 / 120, power_up=POWER_UP_NS)
    reference = Reference(rng)
    dut = SdramMemory(timing=timing, readers=readers, num_writers=num_writers, display=display, num_slots=4)
    num_lines, num_words, num_frames = 60, 150, 4
    # Regions overlap, so that all ports meet in the same rows.
    bases = {name: rng.randrange(span >> 5) for name in readers}
    left = dict.fromkeys(readers, num_lines)
    requests = {name: deque() for name in readers}
    expected = {name: deque() for name in readers}
    writes, writes_left = [deque() for _ in range(num_writers)], [num_words] * num_writers
    frame_base, frame_lines = (1 << 21) // 16, 3
    shown = deque()
    if not num_writers:
        reference.fill(chip, 0, 600)
    if display:
        reference.fill(chip, frame_base * 16, frame_lines * 16)
        shown.extend([reference.words[frame_base * 16 + word] for word in range(frame_lines * 16)] * num_frames)
    frames = deque([{"base": frame_base, "lines": frame_lines - 1}] * num_frames)

    async def ask(ctx):
        for name in readers:
            ctx.set(getattr(dut, f"{name}_base"), bases[name])
        while True:
            for name, (words, line_width) in readers.items():
                if left[name] and len(requests[name]) < 2 and rng.random() >= gap:
                    line = rng.randrange(min(span // words, 1 << line_width))
                    addresses = [(bases[name] * 16 + line * words + word) % (1 << 23) for word in range(words)]
                    values = reference.begin(addresses)
                    if values is not None:
                        expected[name].extend(zip(addresses, values, strict=True))
                        requests[name].append(line)
                        left[name] -= 1
            for number in range(num_writers):
                if writes_left[number] and not writes[number] and rng.random() < 0.3:
                    address, word, mask = rng.randrange(span), rng.getrandbits(32), rng.choice([15, 15, 3, 9, 0])
                    if reference.write(number, address, word, mask):
                        writes[number].append({"address": address, "word": word, "mask": mask})
                        writes_left[number] -= 1
            await ctx.tick()

    def receive(name):
        def take(word):
            address, value = expected[name].popleft()
            assert word == value, f"{name}: word {address}"
            reference.end(address)
        return take

    def show(word):
        assert word == shown.popleft(), "another word on the display"

    def finished():
        return not any((*left.values(), *expected.values(), *writes_left, *writes, shown))

    background = [sdram_bench(dut.pins, chip), ask]
    for name in readers:
        background += [feed(getattr(dut, f"{name}_request"), requests[name], rng=rng, gap=gap),
                       drain(getattr(dut, f"{name}_data"), receive(name))]
    background += [feed(port, queue, rng=rng, gap=gap) for port, queue in zip(dut.write, writes, strict=True)] \
        if num_writers else []
    if display:
        background += [feed(dut.display_frame, frames, rng=rng, gap=gap), steady(dut.display_word),
                       drain(dut.display_word, show, rng=rng, gap=0.5)]
    simulate(dut, until(finished, quiet=300), ticks=100_000, name="memory", background=background)
    if num_writers:
        for address, value in reference.words.items():
            place = address >> 8 & 3, address >> 10, address % 256 << 1
            got = chip.contents.get(place, 0) | chip.contents.get((*place[:2], place[2] + 1), 0) << 16
            assert got == value, f"word {address}"


@pytest.mark.parametrize("words", [1, 4, 8])
def test_latency_of_a_line_alone(words):
    """From a request to its first word, with its bank closed or another row open, in whichever cycle of a slot."""
    timing = SdramTiming(SLOWEST, clock_mhz=125, power_up_ns=POWER_UP_NS)
    chip = SdramChip(DATASHEETS["AS4C16M16SA-7"], period=8, power_up=POWER_UP_NS)
    dut = SdramMemory(timing=timing, readers={"a": (words, 18)})
    waits = []

    async def ask(ctx):
        while not ctx.get(dut.ready):
            await ctx.tick()
        for line in range(12):
            # Another row of another bank
            ctx.set(dut.a_request.payload, line * 1000)
            ctx.set(dut.a_request.valid, 1)
            await ctx.tick()
            ctx.set(dut.a_request.valid, 0)
            wait = 1
            while not ctx.get(dut.a_data.valid):
                await ctx.tick()
                wait += 1
            waits.append(wait)
            await ctx.tick().repeat(60 + line)

    simulate(dut, ask, ticks=5000, name="memory", background=(sdram_bench(dut.pins, chip),))
    more = 2 * (words - 1)
    # A refresh may come in between once.
    *usual, _ = sorted(waits)
    assert 26 + more <= usual[0] <= usual[-1] <= 31 + more, waits
