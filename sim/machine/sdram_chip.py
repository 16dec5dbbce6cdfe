"""An SDRAM chip that refuses what its datasheet forbids.

It knows nothing of any controller. Times are the datasheets' own: Alliance Memory, *AS4C16M16SA-C&I*, rev. 3.0, March
2015, table 16 (electrical characteristics and recommended AC operating conditions); Micron, *256Mb: x4, x8, x16 SDRAM*,
MT48LC16M16A2, table of AC characteristics, speed grade -75.
"""

from collections import deque
from dataclasses import dataclass

__all__ = ["DATASHEETS", "Datasheet", "SdramChip", "SdramViolation", "sdram_bench"]


class SdramViolation(AssertionError):
    """A command that the chip does not take; the message names rule, bank and cycle."""


@dataclass(frozen=True, kw_only=True)
class Datasheet:
    """Times in ns, by their names in datasheets; ``tck`` is the shortest period by CAS latency."""

    tck: dict
    trcd: float
    trp: float
    tras: float
    tras_max: float
    trc: float
    trrd: float
    twr: float
    trfc: float
    tmrd: float
    power_up: float = 200_000
    refresh_period: float = 64_000_000
    rows: int = 8192
    columns: int = 512
    banks: int = 4
    init_refreshes: int = 2


#: By part and speed grade.
DATASHEETS = {
    "AS4C16M16SA-6": Datasheet(tck={2: 10.0, 3: 6.0}, trcd=18, trp=18, tras=42, tras_max=120_000, trc=60, trrd=12,
                               twr=12, trfc=60, tmrd=12),
    "AS4C16M16SA-7": Datasheet(tck={2: 10.0, 3: 7.0}, trcd=21, trp=21, tras=42, tras_max=120_000, trc=63, trrd=14,
                               twr=14, trfc=63, tmrd=14),
    "MT48LC16M16A2-75": Datasheet(tck={2: 10.0, 3: 7.5}, trcd=20, trp=20, tras=44, tras_max=120_000, trc=66, trrd=15,
                                  twr=15, trfc=66, tmrd=15, power_up=100_000),
}
#: Refreshes that may be owed before one counts as missing.
_OWED = 8
#: What is on the data lines when nobody drives them.
_NOTHING = 0x5A5A
_LONG_AGO = -1 << 60
_NAMES = {0b000: "LOAD MODE REGISTER", 0b001: "AUTO REFRESH", 0b010: "PRECHARGE", 0b011: "ACTIVE", 0b100: "WRITE",
          0b101: "READ", 0b110: "BURST TERMINATE"}


class _Bank:
    def __init__(self):
        self.row = None
        self.activated = self.precharged = self.written = _LONG_AGO


class SdramChip:
    """A 16-bit SDRAM, stepped edge by edge of its clock.

    Bursts of 1, 2, 4 and 8 columns, cut short by the next column command, are modelled, and byte masks; automatic
    precharge, BURST TERMINATE, full-page bursts, power-down and self-refresh are not, and refused.

    Parameters
    ----------
    datasheet : Datasheet
        Its times.
    period : float
        Of its clock, in ns.
    power_up : float, optional
        Another time in ns than the datasheet's that it waits at power-up, for short simulations.

    Attributes
    ----------
    cycle : int
        Edges so far.
    commands : dict from str to int
        How often each was given.
    contents : dict from (int, int, int) to int
        Halfwords by bank, row and column.
    data_cycles : int
        Edges at which data were on the lines.
    """

    def __init__(self, datasheet, *, period, power_up=None):
        self._sheet = datasheet
        self._period = period
        self._power_up = datasheet.power_up if power_up is None else power_up
        self._banks = [_Bank() for _ in range(datasheet.banks)]
        self._activated = self._refreshed = self._mode_set = _LONG_AGO
        self._latency = self._burst = None
        self._closed_at_all = False
        self._init_refreshes = 0
        self._refreshes = deque(maxlen=datasheet.rows)
        self._refresh_due = None
        self._reads = {}
        self._write = None
        self._mask = 0
        self._drove = False
        self.cycle = 0
        self.commands = dict.fromkeys(_NAMES.values(), 0)
        self.contents = {}
        self.data_cycles = 0
        if period < min(datasheet.tck.values()):
            raise SdramViolation(f"tCK: a period of {period:g} ns is too short; at least {min(datasheet.tck.values())}")

    def _refuse(self, rule, bank, why):
        where = "all banks" if bank is None else f"bank {bank}"
        raise SdramViolation(f"{rule}: {where}, cycle {self.cycle}: {why}")

    def _wait(self, rule, bank, since, least, what):
        elapsed = (self.cycle - since) * self._period
        if elapsed < least - 1e-6:
            self._refuse(rule, bank, f"{what} after {elapsed:g} ns; at least {least:g}")

    def edge(self, *, cke, cs_n, ras_n, cas_n, we_n, ba, a, dqm, dq=None):
        """One rising edge: the levels of the pins, ``dq`` None if the controller does not drive it.

        Returns
        -------
        int or None
            What the chip drives until the next edge, where it is to be sampled.

        Raises
        ------
        SdramViolation
            If the command is not allowed now, the data lines are driven from both sides, or a refresh is missing.
        """
        ready = self._mode_set != _LONG_AGO
        if ready and not cke:
            self._refuse("CKE", None, "low; power-down is not modelled")
        drives = self._reads.pop(self.cycle, None) is not None
        if dq is not None and drives:
            self._refuse("contention", None, "chip and controller drive the data lines")
        if dq is not None and self._drove:
            self._refuse("contention", None, "the controller drives the data lines while the chip is letting go (tHZ)")
        self._drove = drives
        if self._refresh_due is not None and self.cycle * self._period > self._refresh_due:
            self._refuse("tREF", None, f"{_OWED} refreshes are owed")
        command = ras_n << 2 | cas_n << 1 | we_n
        if not cs_n and cke and command != 0b111:
            self._obey(command, ba, a)
        self.data_cycles += drives or self._write is not None
        self._store(dqm, dq)
        self.cycle += 1
        return self._output(dqm)

    def _output(self, dqm):
        """What is sampled at the next edge; a mask takes two cycles to reach it."""
        mask, self._mask = self._mask, dqm
        value = self._reads.get(self.cycle)
        if value is None:
            return None
        keep = 0xFF * (not mask & 1) | 0xFF00 * (not mask & 2)
        return value[1] & keep | _NOTHING & ~keep

    def _store(self, dqm, dq):
        if self._write is None:
            return
        number, column, left = self._write
        if dqm != 3:
            if dq is None:
                self._refuse("data", number, "a word is written that nobody drives")
            place = number, self._banks[number].row, column
            keep = 0xFF * (dqm & 1) | 0xFF00 * (dqm >> 1 & 1)
            self.contents[place] = self.contents.get(place, 0) & keep | dq & ~keep & 0xFFFF
        self._banks[number].written = self.cycle
        following = column & -self._burst | column + 1 & self._burst - 1
        self._write = (number, following, left - 1) if left else None

    def _obey(self, command, number, a):
        self.commands[_NAMES[command]] += 1
        ready = self._mode_set != _LONG_AGO and self._init_refreshes >= self._sheet.init_refreshes
        if self.cycle * self._period < self._power_up - 1e-6:
            self._refuse("power-up", None, f"{_NAMES[command]} after {self.cycle * self._period:g} ns; "
                                           f"at least {self._power_up:g}")
        if not self._closed_at_all and not (command == 0b010 and a >> 10 & 1):
            self._refuse("initialization", None, f"{_NAMES[command]} before all banks were precharged")
        if not ready and command in (0b011, 0b100, 0b101):
            self._refuse("initialization", number, f"{_NAMES[command]} before "
                         f"{self._sheet.init_refreshes} refreshes and the mode")
        self._wait("tRFC", number, self._refreshed, self._sheet.trfc, _NAMES[command])
        self._wait("tMRD", number, self._mode_set, self._sheet.tmrd, _NAMES[command])
        {0b000: self._set_mode, 0b001: self._refresh, 0b010: self._precharge, 0b011: self._activate,
         0b100: self._begin_write, 0b101: self._begin_read, 0b110: self._terminate}[command](number, a)

    def _all_idle(self, what):
        for number, bank in enumerate(self._banks):
            if bank.row is not None:
                self._refuse("state", number, f"{what} while row {bank.row} is open")
            self._wait("tRP", number, bank.precharged, self._sheet.trp, what)
            self._wait("tRC", number, bank.activated, self._sheet.trc, what)

    def _set_mode(self, number, a):
        self._all_idle("LOAD MODE REGISTER")
        burst, latency = a & 7, a >> 4 & 7
        if number or burst > 3 or a & 8 or latency not in self._sheet.tck or a >> 7:
            self._refuse("mode", None, f"0x{a:x} for bank address {number} is reserved or not modelled")
        if self._period < self._sheet.tck[latency] - 1e-6:
            self._refuse("tCK", None, f"CAS latency {latency} needs {self._sheet.tck[latency]:g} ns")
        self._burst, self._latency, self._mode_set = 1 << burst, latency, self.cycle

    def _refresh(self, number, a):
        self._all_idle("AUTO REFRESH")
        now, interval = self.cycle * self._period, self._sheet.refresh_period / self._sheet.rows
        if len(self._refreshes) == self._sheet.rows and now - self._refreshes[0] > self._sheet.refresh_period:
            self._refuse("tREF", None, f"the last {self._sheet.rows} refreshes took {now - self._refreshes[0]:g} ns")
        self._refreshes.append(now)
        self._refreshed = self.cycle
        self._init_refreshes += 1
        due = now if self._refresh_due is None else self._refresh_due - _OWED * interval
        self._refresh_due = min(due + interval, now + _OWED * interval) + _OWED * interval

    def _precharge(self, number, a):
        self._closed_at_all |= a >> 10 & 1
        for each in range(len(self._banks)) if a >> 10 & 1 else (number,):
            self._close(each)

    def _close(self, number):
        bank = self._banks[number]
        if bank.row is not None:
            self._wait("tRAS", number, bank.activated, self._sheet.tras, "PRECHARGE")
            if (self.cycle - bank.activated) * self._period > self._sheet.tras_max:
                self._refuse("tRAS max", number, f"row {bank.row} was open for longer than {self._sheet.tras_max:g} ns")
            if self._write is not None and self._write[0] == number:
                self._refuse("tWR", number, "PRECHARGE before the burst is written")
            self._wait("tWR", number, bank.written, self._sheet.twr, "PRECHARGE")
            self._cut(self.cycle, number)
        bank.row, bank.precharged = None, self.cycle

    def _activate(self, number, a):
        bank = self._banks[number]
        if bank.row is not None:
            self._refuse("state", number, f"ACTIVE while row {bank.row} is open")
        self._wait("tRP", number, bank.precharged, self._sheet.trp, "ACTIVE")
        self._wait("tRC", number, bank.activated, self._sheet.trc, "ACTIVE")
        self._wait("tRRD", number, self._activated, self._sheet.trrd, "ACTIVE")
        bank.row, bank.activated, self._activated = a, self.cycle, self.cycle

    def _column(self, number, a, what):
        bank = self._banks[number]
        if bank.row is None:
            self._refuse("state", number, f"{what} while no row is open")
        if a >> 10 & 1:
            self._refuse("state", number, f"{what} with automatic precharge, which is not modelled")
        self._wait("tRCD", number, bank.activated, self._sheet.trcd, what)
        return bank.row, a & self._sheet.columns - 1

    def _begin_read(self, number, a):
        row, column = self._column(number, a, "READ")
        # Writing ends at once, and reading when the new words come.
        self._write = None
        self._cut(self.cycle, None)
        for beat in range(self._burst):
            place = column & -self._burst | column + beat & self._burst - 1
            self._reads[self.cycle + self._latency + beat] = number, self.contents.get((number, row, place), 0)

    def _begin_write(self, number, a):
        _, column = self._column(number, a, "WRITE")
        if self._reads:
            self._refuse("contention", number, "WRITE while words are still to come")
        self._write = number, column, self._burst - 1

    def _terminate(self, number, a):
        self._refuse("state", None, "BURST TERMINATE is not modelled")

    def _cut(self, cycle, number):
        """Words of reads begun before, of one bank or all, no longer come CAS latency cycles after ``cycle``."""
        if self._latency is not None:
            self._reads = {at: value for at, value in self._reads.items()
                           if at < cycle + self._latency or number not in (None, value[0])}


def sdram_bench(pins, chip, *, delay=0):
    """Background testbench that connects a chip to a controller's pins, see :func:`~rtl.sdram.commands.pins_signature`.

    Command and data that registers put out are sampled at the next edge; what the chip drives is late by ``delay``
    cycles.
    """
    async def testbench(ctx):
        late = deque([None] * delay)
        sampled = (pins.cke, pins.cs_n, pins.ras_n, pins.cas_n, pins.we_n, pins.ba, pins.a, pins.dqm, pins.dq_o,
                   pins.dq_oe)
        async for _, _, cke, cs_n, ras_n, cas_n, we_n, ba, a, dqm, dq_o, dq_oe in ctx.tick().sample(*sampled):
            driven = chip.edge(cke=cke, cs_n=cs_n, ras_n=ras_n, cas_n=cas_n, we_n=we_n, ba=ba, a=a, dqm=dqm,
                               dq=dq_o if dq_oe else None)
            late.append(driven)
            driven = late.popleft()
            ctx.set(pins.dq_i, _NOTHING if driven is None else driven)
    return testbench
