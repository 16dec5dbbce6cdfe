"""Words on their way into the memory."""

from amaranth.hdl import Module, Signal
from amaranth.lib import data, memory, stream, wiring
from amaranth.lib.wiring import In, Out

from ..queue import Queue
from .controller import store_layout

__all__ = ["SLOT_WIDTH", "WritePort", "write_layout"]

SLOT_WIDTH = 4


def write_layout(chip):
    """A word to be written to ``address``, of which those bytes change whose ``mask`` bits are set."""
    return data.StructLayout({"address": chip.word_width, "word": 32, "mask": 4})


class WritePort(wiring.Component):
    """Keeps up to 16 words until the controller fetches them, and asks for them in batches.

    Turning the data lines round costs the time of three words, so it waits until there are several, but not for long;
    then they are urgent until all are taken, as a single word has less of the memory than others' lines.

    Parameters
    ----------
    chip : :class:`~.timing.SdramChip`
        For the width of addresses.
    batch : int
        Words that are worth beginning with.
    patience : int
        Cycles after which fewer are enough.

    Members
    -------
    i : stream of words to write
    request : stream of what to ask the controller for: addresses, and the slots by which it fetches
    urgent : they should be taken soon
    fetch, store : to and from the controller
    idle : everything taken has been fetched
    """

    def __init__(self, *, chip, batch=8, patience=64):
        self._chip = chip
        self._batch = batch
        self._patience = patience
        request = data.StructLayout({"address": chip.word_width, "slot": SLOT_WIDTH})
        super().__init__({
            "i": In(stream.Signature(write_layout(chip))),
            "request": Out(stream.Signature(request)),
            "urgent": Out(1),
            "fetch": In(data.StructLayout({"valid": 1, "tag": SLOT_WIDTH})),
            "store": Out(store_layout()),
            "idle": Out(1),
        })

    def elaborate(self, platform):
        m = Module()
        num_slots = 1 << SLOT_WIDTH
        m.submodules.addresses = addresses = Queue(self._chip.word_width, depth=num_slots, always_ready=True)
        m.submodules.words = words = memory.Memory(shape=store_layout(), depth=num_slots, init=[])
        write, read = words.write_port(), words.read_port(domain="comb")
        following, first = Signal(SLOT_WIDTH), Signal(SLOT_WIDTH)
        busy, has_slot = Signal(num_slots), Signal(init=1)
        accepted = Signal()
        m.d.comb += [
            self.i.ready.eq(has_slot),
            accepted.eq(self.i.valid & self.i.ready),
            addresses.i.valid.eq(accepted),
            addresses.i.payload.eq(self.i.payload.address),
            write.en.eq(accepted), write.addr.eq(following),
            write.data.word.eq(self.i.payload.word), write.data.mask.eq(self.i.payload.mask),
            read.addr.eq(self.fetch.tag),
            self.idle.eq(~busy.any()),
        ]
        # A slot that is fetched now is found a cycle later.
        m.d.sync += [has_slot.eq(~busy.bit_select((following + accepted)[:SLOT_WIDTH], 1)), self.store.eq(read.data)]
        with m.If(self.fetch.valid):
            m.d.sync += busy.bit_select(self.fetch.tag, 1).eq(0)
        with m.If(accepted):
            m.d.sync += [busy.bit_select(following, 1).eq(1), following.eq(following + 1)]

        flushing = Signal()
        patience = Signal(range(self._patience + 1), init=self._patience)
        m.d.comb += [
            self.request.valid.eq(addresses.o.valid & flushing),
            self.urgent.eq(flushing),
            self.request.payload.address.eq(addresses.o.payload),
            self.request.payload.slot.eq(first),
            addresses.o.ready.eq(self.request.ready & flushing),
        ]
        with m.If(self.request.valid & self.request.ready):
            m.d.sync += first.eq(first + 1)
        with m.If(~addresses.o.valid):
            m.d.sync += [flushing.eq(0), patience.eq(self._patience)]
        with m.Elif((addresses.level >= self._batch) | (patience == 0)):
            m.d.sync += flushing.eq(1)
        with m.Else():
            m.d.sync += patience.eq(patience - 1)
        return m
