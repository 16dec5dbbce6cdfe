"""From a line's number to the accesses that fetch it."""

from amaranth.hdl import Cat, Const, Module, Mux, Signal
from amaranth.lib import data, stream, wiring
from amaranth.lib.wiring import In, Out

from ..queue import Queue
from .commands import MAX_WORDS, PLACE_WIDTH

__all__ = ["BASE_WORDS", "LinePort", "piece_layout"]

#: Bases are counted in so many words.
BASE_WORDS = MAX_WORDS


def piece_layout(chip):
    """What one access fetches of a line: ``left`` + 1 words, the line's from ``place`` on.

    A line has one piece, or a ``second`` one in the next row; ``split`` tells that it has.
    """
    return data.StructLayout({"address": chip.word_width, "left": PLACE_WIDTH, "place": PLACE_WIDTH, "second": 1,
                              "split": 1})


class LinePort(wiring.Component):
    """Line ``l`` of a region has the words from ``base`` · 16 + l · ``words`` on.

    Latency is 2 cycles, 3 for lines that may lie in two rows; throughput a piece a cycle.

    Parameters
    ----------
    chip : :class:`~.timing.SdramChip`
        Whose rows no access may leave.
    words : int
        32-bit words of a line, 1…16.
    line_width : int
        Bits of a line's number. What lies behind the end of the memory is at its beginning.

    Members
    -------
    base : where the region begins, in units of :data:`BASE_WORDS`; changes only while no line is under way
    request : stream of line numbers
    piece : stream of pieces

    Raises
    ------
    ValueError
        If a line has no words or too many.
    """

    def __init__(self, *, chip, words, line_width):
        if not 1 <= words <= MAX_WORDS:
            raise ValueError(f"a line has {words} words; it must have from 1 to {MAX_WORDS}")
        self._chip = chip
        self._words = words
        super().__init__({
            "base": In(chip.word_width - PLACE_WIDTH),
            "request": In(stream.Signature(line_width)),
            "piece": Out(stream.Signature(piece_layout(chip))),
        })

    def elaborate(self, platform):
        m = Module()
        width = self._chip.word_width
        # Who asks does not wait within a cycle for who takes.
        m.submodules.offsets = offsets = Queue(width, depth=2)
        takes_offset = Signal()
        address, has_address, takes_address = Signal(width, reset_less=True), Signal(), Signal()
        multiple = Signal(width)
        # Not as a product, for which there would be a multiplier.
        m.d.comb += multiple.eq(sum(self.request.payload << bit for bit in range(PLACE_WIDTH + 1)
                                    if self._words >> bit & 1))
        m.d.comb += [
            offsets.i.payload.eq(multiple), offsets.i.valid.eq(self.request.valid),
            self.request.ready.eq(offsets.i.ready),
            takes_offset.eq(~has_address | takes_address), offsets.o.ready.eq(takes_offset),
        ]
        with m.If(takes_offset):
            m.d.sync += [has_address.eq(offsets.o.valid), address.eq((self.base << PLACE_WIDTH) + offsets.o.payload)]
        # Aligned lines lie in one row.
        if self._words.bit_count() == 1:
            m.d.comb += [self.piece.valid.eq(has_address), takes_address.eq(self.piece.ready),
                         self.piece.payload.address.eq(address), self.piece.payload.left.eq(self._words - 1)]
        else:
            self._split(m, address, has_address, takes_address)
        return m
        return m

    def _split(self, m, address, has_address, takes_address):
        piece, has_piece = Signal(piece_layout(self._chip), reset_less=True), Signal()
        column_width = self._chip.column_width - 1
        column, row = address[:column_width], piece.address[column_width:]
        split, again, following = Signal(), Signal(), Signal(self._chip.word_width)
        m.d.comb += [
            self.piece.valid.eq(has_piece), self.piece.payload.eq(piece),
            split.eq(column > self._chip.row_words - self._words),
            again.eq(piece.split & ~piece.second),
            takes_address.eq(~has_piece | self.piece.ready & ~again),
            following.eq(Cat(Const(0, column_width), row + 1)),
        ]
        with m.If(takes_address):
            m.d.sync += [
                has_piece.eq(has_address), piece.address.eq(address), piece.place.eq(0), piece.second.eq(0),
                piece.split.eq(split),
                # To the end of the row
                piece.left.eq(Mux(split, ~column[:PLACE_WIDTH], self._words - 1)),
            ]
        with m.Elif(self.piece.ready):
            m.d.sync += [piece.address.eq(following), piece.place.eq(piece.left + 1), piece.second.eq(1),
                         piece.left.eq(self._words - 2 - piece.left)]
