"""A driver and the hardware, with wires between them, in Amaranth's simulator."""

import random
from collections import deque

import pytest
from amaranth.hdl import Module, ResetInserter, Signal
from amaranth.lib import wiring
from amaranth.sim import Simulator

from rtl.host.host_link import HostLink
from rtl.host.host_port import HostPort
from rtl.host.protocol import LinkCount, Reason
from rtl.sdram.memory import SdramMemory
from rtl.sdram.timing import SLOWEST, SdramTiming
from sim.host import BoardReset, Driver, Refused

DIVISOR = 4
PERIOD = 1e-8
NUM_WORDS = 64


class SimulatedLink:
    """A port with a :class:`HostLink` at its other end; seconds are the simulator's."""

    def __init__(self, *, seed):
        self.dut = HostLink(divisor=DIVISOR, word_width=6, num_words=NUM_WORDS, num_registers=2, num_values=1,
                            num_guarded=1)
        self.reset, self._rng = Signal(), random.Random(seed)
        self.memory, self.starts, self.resets = {}, 0, False
        self._levels, self._received, self._now = deque(), bytearray(), 0.0
        self._simulator = Simulator(ResetInserter(self.reset)(self.dut))
        self._simulator.add_clock(PERIOD)
        for testbench in (self._wire, self._listen, self._serve):
            self._simulator.add_testbench(testbench, background=True)

    async def _wire(self, ctx):
        while True:
            ctx.set(self.dut.rx, self._levels.popleft() if self._levels else 1)
            ctx.set(self.reset, self.resets)
            self.resets = False
            await ctx.tick()

    async def _listen(self, ctx):
        while True:
            while ctx.get(self.dut.tx):
                await ctx.tick()
            await ctx.tick().repeat(DIVISOR // 2)
            byte = 0
            for place in range(8):
                await ctx.tick().repeat(DIVISOR)
                byte |= ctx.get(self.dut.tx) << place
            await ctx.tick().repeat(DIVISOR)
            # A reset in the middle of a byte is seen as whatever it looks like.
            self._received.append(byte)

    async def _serve(self, ctx):
        dut, rng = self.dut, self._rng
        ctx.set(dut.ready, 1)
        ctx.set(dut.values[0], 0x12345678)
        write = dut.write.payload
        answers, hidden = deque(), 0
        while True:
            ctx.set(dut.write.ready, rng.random() < 0.5)
            ctx.set(dut.request.ready, not answers and rng.random() < 0.5)
            ctx.set(dut.data.valid, 0)
            if answers and rng.random() < 0.3:
                ctx.set(dut.data.valid, 1)
                ctx.set(dut.data.payload, answers.popleft())
            hidden = max(0, hidden - 1)
            ctx.set(dut.written, hidden == 0)
            if ctx.get(dut.write.valid) and ctx.get(dut.write.ready):
                self.memory[ctx.get(write.address)] = ctx.get(write.word)
                hidden = 20
            if ctx.get(dut.request.valid) and ctx.get(dut.request.ready):
                answers.append(self.memory.get(ctx.get(dut.request.payload), 0))
            self.starts += ctx.get(dut.start)
            await ctx.tick()

    def clock(self):
        return self._now

    def write(self, sent):
        for byte in sent:
            for bit in (0, *(byte >> place & 1 for place in range(8)), 1):
                self._levels.extend([bit] * DIVISOR)

    def read(self, seconds):
        deadline = self._now + seconds
        while not self._received and self._now < deadline:
            self.advance(40)
        received = bytes(self._received)
        self._received.clear()
        return received

    def advance(self, cycles):
        self._now += cycles * PERIOD
        self._simulator.run_until(self._now)


@pytest.fixture
def link():
    return SimulatedLink(seed=1)


def opened(link):
    driver = Driver(link, clock=link.clock, timeout=1e-4)
    driver.open()
    return driver


def test_a_driver_and_the_hardware(link):
    driver = opened(link)
    assert (driver.memory_words, driver.num_registers, driver.num_readable) == (NUM_WORDS, 2, 2 + len(LinkCount) + 1)
    words = [0xC0DBDCDD, 0, 0xFFFFFFFF, 0x01020304, 0xC0C0C0C0]
    driver.write(7, words)
    assert link.memory == dict(enumerate(words, start=7))
    assert driver.read(6, 7) == [0, *words, 0]
    driver.set_register(1, 0xABCD1234)
    driver.start()
    assert link.starts == 1
    with pytest.raises(Refused) as caught:
        driver.write(NUM_WORDS - 1, [1, 2])
    assert caught.value.reason == Reason.ADDRESS
    assert driver.registers(0, 7) == [0, 0xABCD1234, 7, 0, 0, 0, 0x12345678]
    assert driver.repeated == 0


def test_a_damaged_wire(link):
    driver = opened(link)
    rng = random.Random(4)
    words = {}
    for _ in range(12):
        address, word = rng.randrange(NUM_WORDS), rng.getrandbits(32)
        # Noise before the frame, which ends in the middle of a bit, or in the frame itself
        link._levels.extend([0] * rng.randrange(3) + [1] * rng.randrange(30))
        link.write(rng.randbytes(rng.randrange(4)))
        if rng.random() < 0.5:
            send = link.write

            def damaged(sent, send=send):
                link.write = send
                send(sent)
                link._levels[rng.randrange(len(link._levels))] ^= 1

            link.write = damaged
        driver.write(address, [word])
        words[address] = word
        assert link.memory == words


def upload_and_set(link, driver, words):
    """Writes words and sets a register: if the first was done before a reset, the second tells of it."""
    driver.write(10, words)
    assert [link.memory[10 + place] for place in range(len(words))] == words
    driver.set_register(1, 1)


def test_reset_at_any_moment(link):
    driver = opened(link)
    rng = random.Random(5)
    for _ in range(4):
        words = [rng.getrandbits(32) for _ in range(3)]
        before = dict(link.memory)
        cycles = rng.randrange(2000)
        send = link.write

        def write(sent, send=send, cycles=cycles):
            link.write = send
            send(sent)
            link.advance(cycles)
            link.resets = True

        link.write = write
        with pytest.raises(BoardReset):
            upload_and_set(link, driver, words)
        assert all(link.memory[address] in (before.get(address), words[address - 10]) for address in link.memory)
        driver.open()
        assert driver.registers(0, 2) == [0, 0]
        driver.write(10, words)
        assert driver.read(10, 3) == words


def test_it_fits_the_memory():
    """The ports are those of a memory on an SDRAM."""
    m = Module()
    chip = SLOWEST
    m.submodules.link = link = HostLink(divisor=42, word_width=chip.word_width)
    m.submodules.memory = memory = SdramMemory(timing=SdramTiming(chip, clock_mhz=125), num_writers=1,
                                               readers={"host": (1, chip.word_width)})
    wiring.connect(m, link.write, memory.write[0])
    wiring.connect(m, link.request, memory.host_request)
    wiring.connect(m, memory.host_data, link.data)
    Simulator(m)


def test_what_cannot_be_is_refused():
    with pytest.raises(ValueError, match=r"^65 words have no addresses of 6 bits$"):
        HostPort(word_width=6, num_words=65)
    with pytest.raises(ValueError, match=r"^265 registers, counts and values; a frame has 256 at most$"):
        HostPort(word_width=6, num_values=260)
