"""The controller of one SDRAM: accesses in, commands out, words back."""

from amaranth.hdl import Assert, Cat, Const, Module, Mux, Signal
from amaranth.lib import data, stream, wiring
from amaranth.lib.wiring import In, Out

from fpu import Delay

from ..least_recent import LeastRecent, selected
from .bank import Bank, column_layout
from .commands import Command, access_layout, answer_layout, pins_signature
from .direction import Direction
from .upkeep import Upkeep

__all__ = ["Controller", "store_layout"]

#: Cycles from a word's command at the outputs of the banks to the pins.
_TO_PINS = 2


def store_layout():
    """A word to be written, and which of its bytes are."""
    return data.StructLayout({"word": 32, "mask": 4})


class Controller(wiring.Component):
    """Does the accesses of each bank in order, and those of different banks as it suits the chip.

    As §3.1 of the paper has it, switching of rows is avoided and hidden: rows stay open, and while words of one bank
    move, rows of the others are closed and opened. Each word takes a column command and two cycles, 32 bits in bursts
    of two columns, so that every other cycle is free for a row's command and words can follow each other without a
    gap. An access that has begun goes on before others in open rows; the bank served least recently comes next. No
    access waits for ever: see :class:`~rtl.least_recent.LeastRecent`, :class:`~.direction.Direction` and
    :class:`~.upkeep.Upkeep`.

    Throughput is a word in two cycles; for latency see :class:`~.memory.SdramMemory`.

    Parameters
    ----------
    timing : :class:`~.timing.SdramTiming`
        The chip and the clock.
    tag_width : int
        Bits of what tells one access from another.
    depth : int
        Accesses that wait for each bank.
    input_delay : int
        Cycles by which a board's clock and pins delay what comes from the chip.

    Members
    -------
    access : stream of accesses, see :func:`~.commands.access_layout`
    room : for each bank whether it has room for three accesses more than those taken until the last cycle but one, so
        that what chooses among accesses can do so a while before it offers one
    fetch : the tag of a word that is written now
    store : that word, in the next cycle
    answer : a word that was read
    ready : the chip has been initialised
    idle : nothing is under way
    pins : to the chip, see :func:`~.commands.pins_signature`
    """

    def __init__(self, *, timing, tag_width, depth=8, input_delay=0):
        self._timing = timing
        self._tag_width = tag_width
        self._depth = depth
        self._input_delay = input_delay
        chip = timing.chip
        super().__init__({
            "access": In(stream.Signature(access_layout(chip, tag_width=tag_width))),
            "room": Out(1 << chip.bank_width, init=-1),
            "fetch": Out(data.StructLayout({"valid": 1, "tag": tag_width})),
            "store": In(store_layout()),
            "answer": Out(answer_layout(tag_width=tag_width)),
            "ready": Out(1),
            "idle": Out(1),
            "pins": Out(pins_signature(chip)),
        })

    def elaborate(self, platform):
        m = Module()
        timing, chip = self._timing, self._timing.chip
        second = Signal()
        m.d.sync += second.eq(~second)
        m.submodules.upkeep = upkeep = Upkeep(timing=timing)
        m.submodules.direction = direction = Direction(timing=timing)
        banks = [Bank(timing=timing, tag_width=self._tag_width, depth=self._depth) for _ in range(1 << chip.bank_width)]
        for number, bank in enumerate(banks):
            m.submodules[f"bank{number}"] = bank
            m.d.comb += [bank.second.eq(second), bank.hold.eq(upkeep.hold), bank.writing.eq(direction.writing),
                         bank.column_allowed.eq(direction.allowed)]
        m.d.comb += [
            upkeep.second.eq(second),
            upkeep.may_close.eq(Cat(bank.may_close for bank in banks).all()),
            direction.second.eq(second),
            direction.has_read.eq(Cat(bank.has_read for bank in banks).any()),
            direction.has_write.eq(Cat(bank.has_write for bank in banks).any()),
            self.ready.eq(upkeep.ready),
        ]
        self._accept(m, banks)
        column, is_column = self._choose(m, second, banks, upkeep)
        self._move(m, column, is_column, banks)
        m.d.sync += Assert(~is_column | second, "a column in the wrong cycle")
        return m

    def _accept(self, m, banks):
        chip = self._timing.chip
        low, high = chip.column_width - 1, chip.column_width - 1 + chip.bank_width
        address = self.access.payload.address
        bank_number = address[low:high]
        m.d.comb += [self.room.eq(Cat(bank.room for bank in banks)),
                     self.access.ready.eq(Cat(bank.access.ready for bank in banks).bit_select(bank_number, 1))]
        for number, bank in enumerate(banks):
            m.d.comb += [
                *(getattr(bank.access.payload, name).eq(getattr(self.access.payload, name))
                  for name in ("write", "left", "place", "tag")),
                bank.access.payload.row.eq(address[high:]),
                bank.access.payload.column.eq(address[:low]),
                bank.access.valid.eq(self.access.valid & (bank_number == number)),
            ]

    def _choose(self, m, second, banks, upkeep):
        """Grants bids; the row's command goes to the pins, the column's is returned as the banks put it out."""
        timing, chip = self._timing, self._timing.chip
        m.submodules.columns = columns = LeastRecent(num_bidders=len(banks))
        m.submodules.rows = rows = LeastRecent(num_bidders=len(banks))
        finishing, rows_allowed = Signal(len(banks)), Signal(init=1)
        m.d.comb += [
            columns.bid.eq(Cat(bank.column_bid for bank in banks)),
            finishing.eq(Cat(bank.finishing for bank in banks)),
            columns.served.eq(Mux(second, columns.grant & finishing, 0)),
            rows.bid.eq(Mux(rows_allowed, Cat(bank.row_bid for bank in banks), 0)),
            rows.served.eq(Mux(second, rows.grant, 0)),
        ]
        closes = Signal()
        m.d.comb += closes.eq(second & (upkeep.command == Command.PRECHARGE))
        column_granted, row_granted = Signal(len(banks)), Signal(len(banks))
        opens = Signal(len(banks))
        m.d.sync += [column_granted.eq(0), row_granted.eq(0)]
        with m.If(second):
            m.d.sync += [column_granted.eq(columns.grant), row_granted.eq(rows.grant),
                         opens.eq(rows.grant & ~Cat(bank.closing for bank in banks))]
        for number, bank in enumerate(banks):
            m.d.comb += [bank.column_granted.eq(columns.grant[number]), bank.row_granted.eq(rows.grant[number]),
                         bank.close.eq(closes)]
        if timing.rrd > 1:
            left = Signal(range(timing.rrd))
            m.d.comb += rows_allowed.eq(left == 0)
            with m.If(second):
                m.d.sync += left.eq(Mux(rows.grant.any(), timing.rrd - 1, Mux(left == 0, 0, left - 1)))

        # In the first cycle of the next slot, the row's command is put together.
        pins = self.pins
        command, a = Signal(Command, init=Command.NOP), Signal(chip.row_width)
        row_command, row_a = Signal(Command, init=Command.NOP), Signal(chip.row_width)
        row_bank = Signal(chip.bank_width)
        m.d.sync += [command.eq(upkeep.command), a.eq(upkeep.a)]
        m.d.sync += [
            row_command.eq(Mux(opens.any(), Command.ACTIVATE, Mux(row_granted.any(), Command.PRECHARGE, command))),
            row_a.eq(selected([(opens[number], bank.row) for number, bank in enumerate(banks)]) | a),
            row_bank.eq(selected([(granted, Const(number, chip.bank_width))
                                   for number, granted in enumerate(row_granted)])),
        ]
        column = Signal(column_layout(chip, tag_width=self._tag_width), reset_less=True)
        column_bank, is_column = Signal(chip.bank_width), Signal()
        m.d.sync += [
            column.eq(selected([(granted, bank.column.as_value())
                                 for granted, bank in zip(column_granted, banks, strict=True)])),
            column_bank.eq(selected([(granted, Const(number, chip.bank_width))
                                      for number, granted in enumerate(column_granted)])),
            is_column.eq(column_granted.any()),
        ]
        # The row's command is at the pins in the first cycle of a slot, the column's in the second.
        last_column, last_bank, was_column = Signal.like(column), Signal.like(column_bank), Signal()
        levels = Signal(3, init=Command.NOP.value)
        m.d.comb += Cat(pins.we_n, pins.cas_n, pins.ras_n).eq(levels)
        m.d.sync += [last_column.eq(column), last_bank.eq(column_bank), was_column.eq(is_column)]
        with m.If(second):
            m.d.sync += [levels.eq(row_command), pins.a.eq(row_a), pins.ba.eq(row_bank)]
        with m.Else():
            m.d.sync += [levels.eq(Mux(was_column, Mux(last_column.write, Command.WRITE, Command.READ), Command.NOP)),
                         pins.a.eq(last_column.column << 1), pins.ba.eq(last_bank)]
        # In a reset it stays as it is: low, the chip would go to sleep.
        awake = Signal(reset_less=True)
        m.d.sync += [awake.eq(1), pins.cs_n.eq(0)]
        m.d.comb += pins.cke.eq(awake)
        return column, is_column

    def _move(self, m, column, is_column, banks):
        """Words go to the pins with their commands, and come from them CAS latency cycles later."""
        pins = self.pins
        writes = Signal()
        half, low_mask, high_half, high_mask = Signal(16), Signal(2), Signal(16), Signal(2)
        m.d.comb += [self.fetch.valid.eq(is_column & column.write), self.fetch.tag.eq(column.tag)]
        m.d.sync += writes.eq(self.fetch.valid)
        # First the lower half, with the command; then the higher.
        m.d.comb += [half.eq(self.store.word[:16]), low_mask.eq(self.store.mask[:2])]
        m.d.sync += [high_half.eq(self.store.word[16:]), high_mask.eq(self.store.mask[2:])]
        was_writing = Signal()
        m.d.sync += [was_writing.eq(writes), pins.dq_oe.eq(writes | was_writing)]
        with m.If(writes):
            m.d.sync += [pins.dq_o.eq(half), pins.dqm.eq(~low_mask)]
        with m.Else():
            m.d.sync += [pins.dq_o.eq(high_half), pins.dqm.eq(Mux(was_writing, ~high_mask, 0))]
        with m.If(~self.ready):
            m.d.sync += pins.dqm.eq(0b11)

        # The input register takes the lower half so many cycles after the column left the banks' outputs.
        delay = _TO_PINS + self._timing.cas_latency + self._input_delay
        m.submodules.coming = coming = Delay(column.shape(), cycles=delay + 2)
        valid = Signal(delay + 2)
        m.d.comb += coming.i.eq(column)
        m.d.sync += valid.eq(Cat(is_column & ~column.write, valid))
        lower, sampled = Signal(16, reset_less=True), Signal(16, reset_less=True)
        m.d.sync += [sampled.eq(pins.dq_i), lower.eq(sampled)]
        m.d.comb += [
            self.answer.valid.eq(valid[-1]),
            *(getattr(self.answer, name).eq(getattr(coming.o, name)) for name in ("place", "tag", "last")),
            self.answer.word.eq(Cat(lower, sampled)),
            self.idle.eq(Cat(bank.idle for bank in banks).all() & ~valid.any() & ~writes & ~was_writing),
        ]
