"""Tables in block RAM."""

from amaranth.hdl import Cat, ClockSignal, Const, Instance, Module, Signal
from amaranth.lib import memory, wiring
from amaranth.lib.wiring import In, Out

__all__ = ["Rom"]

_HALF_WIDTH = 18
_DEPTH = 512


class Rom(wiring.Component):
    """data(t) = contents[address(t - cycles)].

    One block RAM. Toolchains infer it, but those for ECP5 leave its output register unused, and then the way out of it
    takes a whole clock of 170 MHz; so from two cycles on it is instantiated there, both its ports for reading.

    Parameters
    ----------
    contents : sequence of int
        Up to 512 words.
    width : int
        Bits of a word, up to 36.
    cycles : int
        Registers from the address to the data; without any, the table is logic.

    Members
    -------
    address : In(range(len(contents)))
        Which word.
    data : Out(width)
        The word, ``cycles`` later.

    Raises
    ------
    ValueError
        If there are more words than 512, or they are wider than 36 bits.
    """

    def __init__(self, contents, *, width, cycles):
        self.contents = tuple(contents)
        self.cycles = cycles
        if len(self.contents) > _DEPTH or width > 2 * _HALF_WIDTH:
            raise ValueError(f"A table may have {_DEPTH} words of {2 * _HALF_WIDTH} bits, not {len(self.contents)} of "
                             f"{width}")
        super().__init__({"address": In(range(len(self.contents))), "data": Out(width)})

    def elaborate(self, platform):
        m = Module()
        data, cycles = Signal.like(self.data), self.cycles
        if getattr(platform, "device", "").startswith("LFE5") and cycles >= 2:
            m.submodules.block = self._block(data)
            cycles -= 2
        else:
            m.submodules.words = words = memory.Memory(shape=len(self.data), depth=len(self.contents),
                                                       init=self.contents)
            read = words.read_port(domain="sync" if cycles else "comb")
            m.d.comb += [read.addr.eq(self.address), data.eq(read.data)]
            cycles -= min(cycles, 1)
        for _ in range(cycles):
            following = Signal.like(data, name="registered", reset_less=True)
            m.d.sync += following.eq(data)
            data = following
        m.d.comb += self.data.eq(data)
        return m

    def _block(self, data):
        halves = [word >> _HALF_WIDTH * half & (1 << _HALF_WIDTH) - 1 for word in self.contents for half in range(2)]
        # Sixteen words of 18 bits a parameter, each in the lower bits of 20.
        ports = {f"p_INITVAL_{row:02X}": Const(
            sum(word << 20 * place for place, word in enumerate(halves[16 * row:16 * row + 16])), 320)
            for row in range(2 * _DEPTH // 16)}
        address = Cat(self.address, Const(0, 9))[:9]
        for half, port in enumerate("AB"):
            # The lowest four address bits are byte enables, which do not matter to reading.
            place = Cat(Const(0, 4), Const(half, 1), address)
            ports |= {f"i_AD{port}{bit}": place[bit] for bit in range(len(place))}
            ports |= {f"o_DO{port}{bit}": data[_HALF_WIDTH * half + bit]
                      for bit in range(min(_HALF_WIDTH, max(0, len(data) - _HALF_WIDTH * half)))}
            ports |= {f"i_CLK{port}": ClockSignal(), f"i_CE{port}": Const(1), f"i_OCE{port}": Const(1),
                      f"i_WE{port}": Const(0), f"i_RST{port}": Const(0), f"p_DATA_WIDTH_{port}": _HALF_WIDTH,
                      f"p_REGMODE_{port}": "OUTREG", f"p_WRITEMODE_{port}": "NORMAL", f"p_CSDECODE_{port}": "0b000"}
            ports |= {f"i_CS{port}{bit}": Const(0) for bit in range(3)}
        return Instance("DP16KD", p_RESETMODE="SYNC", p_GSR="DISABLED", **ports)
