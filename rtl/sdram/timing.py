"""The times of an SDRAM chip, in nanoseconds as its datasheet has them and in cycles of a clock."""

from dataclasses import dataclass, field
from math import ceil, floor

__all__ = ["AS4C16M16SA_6", "AS4C16M16SA_7", "MT48LC16M16A2_75", "SLOWEST", "SdramChip", "SdramTiming"]

#: Columns that one column command moves.
BURST = 2
#: A multiple of the clock's period that falls short by less is meant to be one.
_ROUNDING = 1e-9


@dataclass(frozen=True, kw_only=True)
class SdramChip:
    """What the datasheet of a single-data-rate SDRAM says: times in ns unless told otherwise.

    Parameters
    ----------
    t_rcd, t_rp : float
        From activating a row to its columns, from precharging a bank to the next row.
    t_ras, t_ras_max, t_rc : float
        How long a row stays open at least and at most, from one row of a bank to the next.
    t_rrd : float
        From a row of one bank to a row of another.
    t_wr : float
        From the last word written to precharging.
    t_rfc, t_mrd : float
        How long a refresh and setting the mode take.
    t_ck : dict from int to float
        Shortest clock period by CAS latency.
    t_refresh : float
        In which each of its rows is refreshed.
    t_power_up : float
        From a stable clock to the first command.
    num_init_refreshes : int
        Refreshes before it is used.
    row_width, bank_width, column_width : int
        Bits of its addresses; a column has 16 bits.
    """

    t_rcd: float
    t_rp: float
    t_ras: float
    t_rc: float
    t_rrd: float
    t_wr: float
    t_rfc: float
    t_mrd: float
    t_ck: dict = field(hash=False)
    t_ras_max: float = 100_000
    t_refresh: float = 64e6
    t_power_up: float = 200_000
    num_init_refreshes: int = 8
    row_width: int = 13
    bank_width: int = 2
    column_width: int = 9

    @property
    def word_width(self):
        """Bits of the number of a 32-bit word."""
        return self.row_width + self.bank_width + self.column_width - 1

    @property
    def row_words(self):
        """32-bit words of a row."""
        return 1 << self.column_width - 1


#: Alliance Memory, *AS4C16M16SA*, rev. 3.0, March 2015, table 16.
AS4C16M16SA_6 = SdramChip(t_rcd=18, t_rp=18, t_ras=42, t_rc=60, t_rrd=12, t_wr=12, t_rfc=60, t_mrd=12,
                          t_ck={2: 10, 3: 6})
AS4C16M16SA_7 = SdramChip(t_rcd=21, t_rp=21, t_ras=42, t_rc=63, t_rrd=14, t_wr=14, t_rfc=63, t_mrd=14,
                          t_ck={2: 10, 3: 7})
#: Micron, *256Mb: x4, x8, x16 SDRAM*, speed grade -75; setting the mode takes two cycles, 15 ns of its fastest clock.
MT48LC16M16A2_75 = SdramChip(t_rcd=20, t_rp=20, t_ras=44, t_rc=66, t_rrd=15, t_wr=15, t_rfc=66, t_mrd=15,
                             t_ck={2: 10, 3: 7.5})
#: Whatever of these a board has.
SLOWEST = SdramChip(t_rcd=21, t_rp=21, t_ras=44, t_rc=66, t_rrd=15, t_wr=15, t_rfc=66, t_mrd=15, t_ck={2: 10, 3: 7.5})


class SdramTiming:
    """The times of a chip at a clock, in cycles and in slots of two cycles.

    A command for a row may go out in the first cycle of a slot and one for a column in the second, so that a distance
    from row to column has an odd number of cycles and all others an even one.

    Parameters
    ----------
    chip : SdramChip
        Its times.
    clock_mhz : float
        The clock of chip and controller.
    power_up_ns : float, optional
        Another time than the chip's from power-up to the first command, for a simulation.

    Attributes
    ----------
    cas_latency : int
        Cycles from a read to its first column: the least that the chip allows at this clock.
    rcd, rp, ras, rc, rrd, rfc, mrd : int
        Slots from the command that begins a time to the first that may end it.
    read_to_precharge, write_to_precharge, read_to_write : int
        Likewise; from a write to a read it is one slot, as from each column to the next.
    refresh : int
        Slots from one refresh to the next.
    power_up : int
        Slots before the first command.

    Raises
    ------
    ValueError
        If the clock is faster than the chip, or so slow that refreshing takes all the time.
    """

    def __init__(self, chip=SLOWEST, *, clock_mhz, power_up_ns=None):
        self.chip = chip
        self.clock_mhz = clock_mhz
        allowed = [latency for latency, period in sorted(chip.t_ck.items()) if clock_mhz * period <= 1000 + _ROUNDING]
        if not allowed:
            raise ValueError(f"the clock is {clock_mhz:g} MHz; the SDRAM takes up to "
                             f"{1000 / min(chip.t_ck.values()):.4g}")
        self.cas_latency = allowed[0]
        self.rcd = max(ceil((self.cycles(chip.t_rcd) - 1) / 2), 1)
        self.rp, self.ras, self.rc, self.rrd, self.rfc = (
            self.slots(self.cycles(time)) for time in (chip.t_rp, chip.t_ras, chip.t_rc, chip.t_rrd, chip.t_rfc))
        self.mrd = self.slots(max(self.cycles(chip.t_mrd), 2))
        # From here on from the cycle of a column, the second of its slot, to that of a row, the first.
        self.read_to_precharge = self.slots(BURST + 1)
        self.write_to_precharge = self.slots(BURST - 1 + self.cycles(chip.t_wr) + 1)
        # One cycle in which nobody drives the data lines
        self.read_to_write = self.slots(self.cas_latency + BURST + 1)
        self.power_up = self.slots(self.cycles(chip.t_power_up if power_up_ns is None else power_up_ns))
        rows = 1 << chip.row_width
        # A slot less, so that one which comes late still has the others of its 64 ms in time.
        self.refresh = floor(chip.t_refresh * clock_mhz / 1000 / rows / 2 + _ROUNDING) - 1
        if self.refresh <= 2 * self.refresh_latest:
            raise ValueError(f"the clock is {clock_mhz:g} MHz; refreshing the SDRAM would take half of "
                             "the time or more")

    def cycles(self, time):
        """The cycles that ``time`` ns take."""
        return ceil(time * self.clock_mhz / 1000 - _ROUNDING)

    @staticmethod
    def slots(cycles):
        """The slots that so many cycles take."""
        return -(-cycles // 2)

    @property
    def refresh_latest(self):
        """Slots from when a refresh is due to when it is under way at the latest, see :class:`~.upkeep.Upkeep`."""
        return 3 + max(self.ras, self.read_to_precharge, self.write_to_precharge) + self.rp

    @property
    def megabytes(self):
        """Megabytes a second that the data lines carry if they are never idle."""
        return 2 * self.clock_mhz
