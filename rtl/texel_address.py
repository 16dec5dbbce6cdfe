"""From texture coordinates to the numbers of texels, by their bits alone."""

from amaranth.hdl import Cat, Const, Module, Mux, Signal, signed
from amaranth.lib import data, wiring
from amaranth.lib.wiring import In, Out

from fpu import Delay

__all__ = ["MAX_SIDE_LOG2", "PLACE_WIDTH", "WEIGHT_BITS", "TexelAddress", "TexturePlace", "texture_members"]

#: Binary logarithm of the longest side.
MAX_SIDE_LOG2 = 12
#: Fraction bits of a place between texels, and so of a texel's weight along an axis.
WEIGHT_BITS = 8
#: Bits of a place.
PLACE_WIDTH = MAX_SIDE_LOG2 + WEIGHT_BITS


def texture_members(*, base_width):
    """Shapes of what is to be known of a texture: its first word, a multiple of 4, its sides, how it is looked at."""
    return {"base": base_width, "log2_width": 4, "log2_height": 4, "filtered": 1, "folded": 1}


def _texels_of(log2_side):
    """Bits that the number of a texel within a side has."""
    return Cat(log2_side > bit for bit in range(MAX_SIDE_LOG2))


class TexturePlace(wiring.Component):
    """Where a coordinate is on a texture's side, in 1/256 of a texel from its edge; one a clock.

    place = ⌊2^8 · 2^log2_side · frac(c)⌋ with frac(c) = c − ⌊c⌋, exactly; cutting frac(c) to 24 bits before changes
    nothing. A map that is ``folded`` does not repeat: frac(c) is c itself, but 0 below 0, and from 1 on what is just
    below 1, place 2^8 · 2^log2_side − 1. Of infinities frac(c) is 0.

    Parameters
    ----------
    fmt : :class:`~fpu.FloatFormat`
        Format of coordinates.

    Members
    -------
    coordinate : c
    log2_side : binary logarithm of the side's texels, up to 12
    folded : the texture does not repeat
    place : the result, ``latency`` cycles later
    """

    latency = 5

    def __init__(self, *, fmt):
        self._fmt = fmt
        super().__init__({"coordinate": In(fmt), "log2_side": In(4), "folded": In(1), "place": Out(PLACE_WIDTH)})

    def elaborate(self, platform):
        m = Module()
        fmt, a = self._fmt, self.coordinate
        width = fmt.sig_width + PLACE_WIDTH
        num_levels = (width - 1).bit_length()
        span = max(fmt.bias, fmt.exp_inf - fmt.bias, 1 << num_levels) + PLACE_WIDTH
        m.submodules.beside = beside = Delay(data.StructLayout({"log2_side": 4, "folded": 1, "negative": 1}),
                                             cycles=self.latency - 1)
        m.d.comb += [
            beside.i.log2_side.eq(self.log2_side),
            beside.i.folded.eq(self.folded),
            beside.i.negative.eq(a.sign),
        ]

        # The significand goes left from wholly behind the point; what leaves on the left are whole repeats.
        distance = Signal(signed(span.bit_length() + 1), reset_less=True)
        window = Signal(width, reset_less=True)
        is_zero, is_over = Signal(reset_less=True), Signal(reset_less=True)
        m.d.sync += [
            distance.eq(a.exp + self.log2_side + (WEIGHT_BITS + 1 - fmt.bias)),
            window.eq(Cat(a.frac, Const(1, 1))),
            is_zero.eq((a.exp == 0) | a.exp.all()),
            is_over.eq((a.exp >= fmt.bias) & ~a.exp.all()),
        ]
        # Of what is wholly behind the last place nothing but a rest is left, and nothing of what is all repeats.
        gone = {"whole": is_zero | (distance < 0) | (distance >> num_levels).any(),
                "rest": ~is_zero & (distance < 0), "over": is_over}
        m.submodules.aside = aside = Delay(data.StructLayout(dict.fromkeys(gone, 1)), cycles=2)
        m.d.comb += [aside.i[name].eq(value) for name, value in gone.items()]

        half = num_levels // 2
        amount = distance
        for number, levels in enumerate((range(half), range(half, num_levels))):
            for level in levels:
                shifted = Signal(width, name=f"shifted{level}")
                m.d.comb += shifted.eq(Mux(amount[level], window << (1 << level), window))
                window = shifted
            following = Signal(width, name=f"window{number}", reset_less=True)
            remaining = Signal(num_levels, name=f"remaining{number}", reset_less=True)
            m.d.sync += [following.eq(window), remaining.eq(amount)]
            window, amount = following, remaining

        whole = Signal(PLACE_WIDTH, reset_less=True)
        rest, over = Signal(reset_less=True), Signal(reset_less=True)
        m.d.sync += [
            whole.eq(Mux(aside.o.whole, 0, window[fmt.sig_width:])),
            rest.eq(Mux(aside.o.whole, aside.o.rest, window[:fmt.sig_width].any())),
            over.eq(aside.o.over),
        ]

        within, rounded_down = Signal(PLACE_WIDTH), Signal(PLACE_WIDTH)
        place = Signal(PLACE_WIDTH, reset_less=True)
        negative = beside.o.negative
        m.d.comb += [
            within.eq(Cat(Const(1, 1).replicate(WEIGHT_BITS), _texels_of(beside.o.log2_side))),
            rounded_down.eq((whole ^ negative.replicate(PLACE_WIDTH)) + (negative & ~rest)),
            self.place.eq(place),
        ]
        m.d.sync += place.eq(rounded_down & within)
        with m.If(beside.o.folded & (negative | over)):
            m.d.sync += place.eq(Mux(negative, 0, within))
        return m


class TexelAddress(wiring.Component):
    """Number in memory of one of the four texels round a place; one a clock.

    Of place p in 1/256 texel, numbers count from i = (p − 128) >> 8 when filtered: corner 0 is texel (i, j), 1 is
    (i + 1, j), 2 and 3 are those below. Otherwise there is only corner 0, texel (p >> 8, q >> 8). Beyond an edge a
    texture goes on with the opposite edge; if it is ``folded``, with the same edge mirrored about its middle: texel
    (−1, j) is (0, N − 1 − j). Modulo N that is all bits of both numbers inverted; beyond two edges, it is done twice.

    Texel (i, j) of W × H is word base + 4 ((j >> 1) (max(W, 2) >> 1) + (i >> 1)) + 2 (j & 1) + (i & 1).

    Parameters
    ----------
    index_width : int
        Bits of a texel's number in memory.

    Members
    -------
    x, y : places along both sides
    corner : which texel
    texture : ``{"base", "log2_width", "log2_height", "filtered", "folded"}``; sides of a folded one are equal
    index : the texel's number, ``latency`` cycles later
    """

    latency = 5

    def __init__(self, *, index_width):
        super().__init__({
            "x": In(PLACE_WIDTH), "y": In(PLACE_WIDTH), "corner": In(2),
            "texture": In(data.StructLayout(texture_members(base_width=index_width))), "index": Out(index_width),
        })

    def elaborate(self, platform):
        m = Module()
        block_width = len(self.index) - 2

        def stage(number, **fields):
            """Registers for all that is looked at from here on: of each field its width and its value."""
            layout = data.StructLayout({name: width for name, (width, _) in fields.items()})
            registers = Signal(layout, name=f"stage{number}", reset_less=True)
            m.d.sync += [registers[name].eq(value) for name, (_, value) in fields.items()]
            return registers

        # One bit more than a texel's number has tells what is beyond either edge.
        numbers = []
        for name, place, further in (("i", self.x, self.corner[0]), ("j", self.y, self.corner[1])):
            number = Signal(MAX_SIDE_LOG2 + 1, name=f"number_{name}")
            is_far = place[WEIGHT_BITS - 1]
            before, after = Signal(name=f"before_{name}"), Signal(name=f"after_{name}")
            m.d.comb += [
                before.eq(self.texture.filtered & ~further & ~is_far),
                after.eq(self.texture.filtered & further & is_far),
                number.eq(place[WEIGHT_BITS:] + Cat(before | after, before.replicate(MAX_SIDE_LOG2))),
            ]
            numbers.append(number)
        s = stage(1, i=(MAX_SIDE_LOG2 + 1, numbers[0]), j=(MAX_SIDE_LOG2 + 1, numbers[1]),
                  base=(block_width, self.texture.base[2:]), log2_width=(4, self.texture.log2_width),
                  log2_height=(4, self.texture.log2_height), folded=(1, self.texture.folded))

        within, beyond = {}, {}
        for name, log2_side in (("i", s.log2_width), ("j", s.log2_height)):
            within[name] = Signal(MAX_SIDE_LOG2, name=f"within_{name}")
            beyond[name] = Signal(name=f"beyond_{name}")
            m.d.comb += [
                within[name].eq(_texels_of(log2_side)),
                beyond[name].eq((s[name] & ~Cat(within[name], Const(0, 1))).any()),
            ]
        s = stage(2, i=(MAX_SIDE_LOG2, s.i & within["i"]), j=(MAX_SIDE_LOG2, s.j & within["j"]),
                  mirrored=(1, s.folded & (beyond["i"] ^ beyond["j"])), within_i=(MAX_SIDE_LOG2, within["i"]),
                  within_j=(MAX_SIDE_LOG2, within["j"]), base=(block_width, s.base), log2_width=(4, s.log2_width))

        mirrored = s.mirrored.replicate(MAX_SIDE_LOG2)
        s = stage(3, i=(MAX_SIDE_LOG2, (s.i ^ mirrored) & s.within_i), j=(MAX_SIDE_LOG2, (s.j ^ mirrored) & s.within_j),
                  base=(block_width, s.base), log2_blocks=(4, Mux(s.log2_width == 0, 0, s.log2_width - 1)))

        # A row has a power of two of blocks: a block's number within it fills in the row's zeros.
        s = stage(4, block=(2 * MAX_SIDE_LOG2 - 2, s.j[1:] << s.log2_blocks | s.i[1:]), texel=(2, Cat(s.i[0], s.j[0])),
                  base=(block_width, s.base))
        s = stage(5, texel=(2, s.texel), block=(block_width, s.base + s.block))
        m.d.comb += self.index.eq(Cat(s.texel, s.block))
        return m
