"""Where words wait that come back out of order."""

from amaranth.hdl import Cat, Const, Module, Mux, Signal
from amaranth.lib import data, stream, wiring
from amaranth.lib.wiring import In, Out
from amaranth.utils import ceil_log2

from ..block_memory import BlockMemory
from ..least_recent import LeastRecent, selected
from .commands import MAX_WORDS, PLACE_WIDTH, answer_layout

__all__ = ["ReturnBuffer", "tag_layout"]


def tag_layout(*, num_ports, num_slots):
    """Whose an access is: a piece of the line in a slot of a port."""
    return data.StructLayout({"second": 1, "slot": max(ceil_log2(num_slots), 1), "port": max(ceil_log2(num_ports), 1)})


class ReturnBuffer(wiring.Component):
    """Collects the words of lines, and gives each port its lines whole and in order.

    A port has slots, of which it takes one for each line when it asks for its first piece. A line that is there, with
    all that the port has asked for before, leaves at a word a cycle, one line at a time: twice as fast as words come.
    The first leaves 6 cycles after the last has come, if there is no other before.

    Parameters
    ----------
    words : list of int
        Words of a line, for each port.
    slots : list of int
        Lines that each port may have asked for, powers of two.

    Members
    -------
    has_slot, slot : for each port: one is free, and which one the next line takes
    asked : for each port: a piece is asked for, of one or two
    answer : a word comes
    data : array of streams of words
    idle : no line is waited for
    """

    def __init__(self, *, words, slots):
        self._words = words
        self._slots = slots
        self._tag = tag_layout(num_ports=len(words), num_slots=max(slots))
        asked = data.StructLayout({"valid": 1, "second": 1, "split": 1})
        super().__init__({
            "has_slot": Out(1, init=1).array(len(words)),
            "slot": Out(range(max(slots))).array(len(words)),
            "asked": In(asked).array(len(words)),
            "answer": In(answer_layout(tag_width=self._tag.size)),
            "data": Out(stream.Signature(32, always_ready=True)).array(len(words)),
            "idle": Out(1),
        })

    def elaborate(self, platform):
        m = Module()
        num_ports, num_slots = len(self._words), max(self._slots)
        tag = Signal(self._tag)
        m.submodules.storage = storage = BlockMemory(32, depth=num_ports * num_slots * MAX_WORDS)
        m.d.comb += [
            tag.eq(self.answer.tag),
            storage.write.valid.eq(self.answer.valid),
            storage.write.address.eq(Cat(self.answer.place, tag.slot if num_slots > 1 else Const(0, 0), tag.port)),
            storage.write.data.eq(self.answer.word),
        ]

        is_done = Signal(num_ports)
        starts, ends, reader = Signal(num_ports), Signal(), Signal(num_ports)
        firsts, levels = [], []
        for port in range(num_ports):
            first, level = self._keep_account(m, port, tag, is_done, starts[port], ends & reader[port])
            firsts.append(first)
            levels.append(level)
        m.d.comb += self.idle.eq(~Cat(levels).any())

        m.submodules.turns = turns = LeastRecent(num_bidders=num_ports)
        reading, started, chosen = Signal(), Signal(), Signal(num_ports)
        # A line's words that are left, and whether it is the last one's turn, which is known before.
        left, is_last = Signal(PLACE_WIDTH), Signal()
        place, number, slot = Signal(PLACE_WIDTH), Signal(range(num_ports)), Signal(range(num_slots))
        m.d.comb += [
            ends.eq(reading & is_last),
            # Whose line has just been started has not seen yet whether there is another one.
            turns.bid.eq(is_done & ~chosen & ~Mux(started, reader, 0)),
            turns.served.eq(starts),
            starts.eq(Mux(reading & ~ends, 0, chosen)),
            storage.address.eq(Cat(place, slot if num_slots > 1 else Const(0, 0), number)),
            storage.reading.eq(reading),
        ]
        m.d.sync += [started.eq(starts.any()), place.eq(place + 1), left.eq(left - 1),
                     is_last.eq(left == 1)]
        with m.If(~chosen.any() | starts.any()):
            m.d.sync += chosen.eq(turns.grant)
        with m.If(starts.any()):
            m.d.sync += [
                reading.eq(1),
                reader.eq(starts),
                place.eq(0),
                is_last.eq(Cat(chosen[port] for port, words in enumerate(self._words) if words == 1).any()),
                left.eq(selected([(chosen[port], Const(words - 1, PLACE_WIDTH))
                                  for port, words in enumerate(self._words)])),
                number.eq(selected([(chosen[port], Const(port, len(number))) for port in range(num_ports)])),
                slot.eq(selected([(chosen[port], first) for port, first in enumerate(firsts)])),
            ]
        with m.Elif(ends):
            m.d.sync += reading.eq(0)

        read = [Mux(reading, reader, 0)]
        for cycle in range(storage.latency):
            read.append(Signal(num_ports, name=f"read_{cycle}"))
            m.d.sync += read[-1].eq(read[-2])
        for port, target in enumerate(self.data):
            m.d.comb += [target.valid.eq(read[-1][port]), target.payload.eq(storage.data)]
        return m

    def _keep_account(self, m, port, tag, is_done, starts, ends):
        """The slots of one port: which is the first to leave, and how many are taken."""
        num_slots, asked = self._slots[port], self.asked[port]
        first = Signal(range(num_slots), name=f"first_{port}")
        taken, waiting = (Signal(range(num_slots + 1), name=f"{name}_{port}") for name in ("taken", "waiting"))
        missing = Signal(data.ArrayLayout(2, num_slots), name=f"missing_{port}")
        begins, whole = Signal(name=f"begins_{port}"), Signal(name=f"whole_{port}")
        m.d.comb += [
            begins.eq(asked.valid & ~asked.second),
            whole.eq(asked.valid & (asked.second | ~asked.split)),
        ]
        # One that leaves now is free a cycle later.
        m.d.sync += [self.has_slot[port].eq(taken + begins != num_slots), taken.eq(taken + begins - ends),
                     waiting.eq(waiting + begins - starts),
                     is_done[port].eq((waiting != 0) & ~missing[first].any())]
        for slot in range(num_slots):
            for piece in range(2):
                with m.If(self.answer.valid & self.answer.last & (tag.port == port) & (tag.slot == slot)
                          & (tag.second == piece)):
                    m.d.sync += missing[slot][piece].eq(0)
            with m.If(begins & (self.slot[port] == slot)):
                m.d.sync += missing[slot].eq(Cat(1, asked.split))
        if num_slots > 1:
            with m.If(whole):
                m.d.sync += self.slot[port].eq((self.slot[port] + 1)[:ceil_log2(num_slots)])
            with m.If(starts):
                m.d.sync += first.eq(first + 1)
        return first, taken
