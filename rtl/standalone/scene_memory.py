"""A part of a scene in block RAM."""

from amaranth.hdl import Module, Signal
from amaranth.lib import memory, stream, wiring
from amaranth.lib.wiring import In, Out

__all__ = ["SceneMemory"]


class SceneMemory(wiring.Component):
    """Line ``l`` has the words from l · ``line_words`` on.

    Latency is 3 cycles from a request to the first word, throughput a word a cycle.

    Parameters
    ----------
    words : list of int
        32 bits each; behind them are zeros, as a line may reach past the last item.
    line_words : int
        Of a line.
    line_width : int
        Bits of a line's number.

    Members
    -------
    request : stream of line numbers
    data : stream of words, which nobody may refuse

    Raises
    ------
    ValueError
        If a line has no words.
    """

    def __init__(self, words, *, line_words, line_width):
        if line_words < 1:
            raise ValueError(f"a line has {line_words} words; it must have one at least")
        self._line_words = line_words
        num_lines = max(-(-len(words) // line_words), 1)
        # Tools know no memory of a single word.
        self._words = [*words, *[0] * (max(num_lines * line_words, 2) - len(words))]
        super().__init__({
            "request": In(stream.Signature(line_width)),
            "data": Out(stream.Signature(32, always_ready=True)),
        })

    def elaborate(self, platform):
        m = Module()
        m.submodules.rows = rows = memory.Memory(shape=32, depth=len(self._words), init=self._words,
                                                 attrs={"ram_style": "block"})
        read = rows.read_port()
        address, left = Signal(range(len(self._words)), reset_less=True), Signal(range(self._line_words + 1))
        first = Signal(len(address))
        has_word, word = Signal(), Signal(32, reset_less=True)
        # Not as a product, for which there would be a multiplier.
        m.d.comb += [
            first.eq(sum(self.request.payload << bit for bit in range(self._line_words.bit_length())
                         if self._line_words >> bit & 1)),
            self.request.ready.eq(left <= 1), read.addr.eq(address), self.data.payload.eq(word),
        ]
        m.d.sync += [has_word.eq(left != 0), self.data.valid.eq(has_word), word.eq(read.data)]
        with m.If(self.request.ready):
            m.d.sync += left.eq(0)
            with m.If(self.request.valid):
                m.d.sync += [address.eq(first), left.eq(self._line_words)]
        with m.Else():
            m.d.sync += [address.eq(address + 1), left.eq(left - 1)]
        return m
