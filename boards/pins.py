"""A board's FPGA, from its clock's pin to its screen's."""

from dataclasses import dataclass

from amaranth.hdl import Cat, ClockDomain, Elaboratable, Module
from amaranth.lib import io

from rtl.standalone.standalone_top import StandaloneTop
from rtl.top import Top

from .pll import Clock, Pll

__all__ = ["BUILT_IN_SCALE_LOG2", "SDRAM_LEAD_NS", "BoardPins", "BuiltInScene"]

#: Of a picture in block RAM, the logarithm of how many pixels of the screen one of its is a side: 128×96 of 1024×768
BUILT_IN_SCALE_LOG2 = 3
#: By how much the SDRAM's clock is ahead of the controller's. Both go out through the same kind of register and pin. So
#: a command is at the pins a period less this before the clock that takes it, 3 ns at 125 MHz where 1.5 is needed, and
#: 5 ns behind it, where 0.8 is. A word that the chip drives is there 5.4 ns after its clock at the latest, and 2.7 ns
#: into the next; with 3 to 6 ns from the clock's register out and the data's pin in, the next but one finds it.
SDRAM_LEAD_NS = 5
#: Members of :func:`~rtl.sdram.commands.pins_signature` by the names of amaranth-boards, whose ports turn what is low
#: when active.
_OUTPUTS = {"clk_en": "cke", "cs": "cs_n", "ras": "ras_n", "cas": "cas_n", "we": "we_n", "ba": "ba", "a": "a",
            "dqm": "dqm"}
_NUM_COLORS = 3


@dataclass(frozen=True, kw_only=True, eq=False)
class BuiltInScene:
    """A scene in a bitstream, see :class:`~rtl.standalone.standalone_top.StandaloneTop`.

    Parameters
    ----------
    memories, cameras, root, background
        As there.
    """

    memories: dict
    cameras: list
    root: int
    background: int


class BoardPins(Elaboratable):
    """A :class:`~rtl.top.Top` behind the pins of a board, or a chip with its scene, behind those of a screen.

    Parameters
    ----------
    board : :class:`~.board.Board`
    config : :class:`~rtl.config.ChipConfig`
        The chip.
    clock_mhz : float
        Of chip and SDRAM.
    scene : BuiltInScene, optional
        What is drawn, without host and SDRAM.

    Attributes
    ----------
    clocks : dict from str to float
        MHz of each domain, as the PLLs make them.

    Raises
    ------
    ValueError
        If the clock cannot be made, is too fast for the SDRAM, or does not make the serial port's rate.
    """

    def __init__(self, board, *, config, clock_mhz, scene=None):
        self._board = board
        self._scene = scene
        pixel_mhz = board.mode.pixel_mhz
        self._chip_clocks = [Clock(domain="sync", mhz=clock_mhz, global_reset=True)]
        if scene is None:
            self._chip_clocks.append(Clock(domain="sdram", mhz=clock_mhz, lag_ns=-SDRAM_LEAD_NS, reset=False))
        self._screen_clocks = [Clock(domain="shift", mhz=5 * pixel_mhz), Clock(domain="pixel", mhz=pixel_mhz)]
        self._plls = [Pll(board.oscillator_mhz, clocks) for clocks in (self._chip_clocks, self._screen_clocks)]
        self.clocks = {clock.domain: mhz for pll, clocks in zip(self._plls, self._all_clocks, strict=True)
                       for clock, mhz in zip(clocks, pll.plan.mhz, strict=True)}
        exact = self.clocks["sync"]
        if scene is None:
            self._top = Top(config, timing=board.timing(exact), mode=board.mode, scale=board.scale,
                            divisor=board.divisor(exact))
        else:
            self._top = StandaloneTop(config, memories=scene.memories, cameras=scene.cameras, root=scene.root,
                                      background=scene.background, mode=board.mode, scale_log2=BUILT_IN_SCALE_LOG2)

    @property
    def _all_clocks(self):
        return self._chip_clocks, self._screen_clocks

    def elaborate(self, platform):
        m = Module()
        m.submodules.oscillator = oscillator = io.Buffer("i", platform.request(platform.default_clk, dir="-"))
        for number, (pll, clocks) in enumerate(zip(self._plls, self._all_clocks, strict=True)):
            m.submodules[f"pll{number}"] = pll
            m.d.comb += pll.clock.eq(oscillator.i)
            m.domains += [ClockDomain(clock.domain, reset_less=not clock.reset) for clock in clocks]
        # By this name what is reported of parts finds them, see boards.packing.
        m.submodules.component = top = self._top
        if self._scene is None:
            self._serial(m, platform, top)
            self._sdram(m, platform, top.pins)
        self._screen(m, platform, top.pairs)
        for number, lamp in enumerate(top.lamps):
            m.submodules[f"lamp{number}"] = buffer = io.Buffer("o", platform.request("led", number, dir="-"))
            m.d.comb += buffer.o.eq(lamp)
        return m

    def _serial(self, m, platform, top):
        serial = platform.request("uart", 0, dir="-")
        m.submodules.rx = rx = io.Buffer("i", serial.rx)
        m.submodules.tx = tx = io.Buffer("o", serial.tx)
        m.d.comb += [top.rx.eq(rx.i), tx.o.eq(top.tx)]
        # Where a bridge's output has to be let through
        if ("uart_tx_enable", 0) in platform.resources:
            m.submodules.enable = enable = io.Buffer("o", platform.request("uart_tx_enable", 0, dir="-"))
            m.d.comb += enable.o.eq(1)

    def _sdram(self, m, platform, pins):
        ports = platform.request("sdram", 0, dir="-")
        m.submodules.sdram_clock = clock = io.DDRBuffer("o", ports.clk, o_domain="sdram")
        m.d.comb += [clock.o[0].eq(-1), clock.o[1].eq(0)]
        for name, pin in _OUTPUTS.items():
            m.submodules[f"sdram_{pin}"] = buffer = io.FFBuffer("o", getattr(ports, name))
            value = getattr(pins, pin)
            m.d.comb += buffer.o.eq(~value if pin.endswith("_n") else value)
        m.submodules.sdram_dq = words = io.FFBuffer("io", ports.dq)
        m.d.comb += [words.o.eq(pins.dq_o), words.oe.eq(pins.dq_oe), pins.dq_i.eq(words.i)]

    def _screen(self, m, platform, pairs):
        ports = platform.request("hdmi", 0, dir="-")
        m.submodules.colors = colors = io.DDRBuffer("o", ports.d, o_domain="shift")
        m.submodules.screen_clock = clock = io.DDRBuffer("o", ports.clk, o_domain="shift")
        for half in range(2):
            m.d.comb += [colors.o[half].eq(Cat(pairs[channel][half] for channel in range(_NUM_COLORS))),
                         clock.o[half].eq(pairs[_NUM_COLORS][half])]
