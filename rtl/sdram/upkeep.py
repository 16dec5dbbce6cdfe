"""What keeps an SDRAM alive: its power-up sequence, and refreshes in time."""

from amaranth.hdl import Assert, Module, Signal
from amaranth.lib import enum, wiring
from amaranth.lib.wiring import In, Out

from .commands import ALL_BANKS, Command, mode_register

__all__ = ["Upkeep"]


class _State(enum.Enum):
    CLOSE = 0
    REFRESH = 1
    SET_MODE = 2
    RESUME = 3
    RUN = 4


class Upkeep(wiring.Component):
    """Initialises an SDRAM after reset, and refreshes it from then on.

    A refresh that is due stops all other commands at once and waits only for the open rows' shortest times, so that
    nothing that others do puts it off: it is under way ``timing.refresh_latest`` slots after it was due at the latest,
    which is asserted in simulation. Due is one every ``timing.refresh`` slots, however late the last one was.

    Parameters
    ----------
    timing : :class:`~.timing.SdramTiming`
        Distances of commands.

    Members
    -------
    second : this is the second cycle of a slot
    hold : no other command is to be asked for
    may_close : in the second cycle: all rows are closed or can be
    command, a : in the second cycle: what the chip is told, if it is not ``NOP``, instead of any other command
    ready : it has been initialised
    """

    def __init__(self, *, timing):
        self._timing = timing
        super().__init__({
            "second": In(1), "hold": Out(1, init=1), "may_close": In(1),
            "command": Out(Command, init=Command.NOP), "a": Out(timing.chip.row_width), "ready": Out(1),
        })

    def elaborate(self, platform):
        m = Module()
        timing = self._timing
        state = Signal(_State)
        wait = Signal(range(max(timing.power_up, timing.rfc, timing.rp, timing.mrd) + 1), init=timing.power_up)
        waits = Signal(init=1)
        refreshes = Signal(range(timing.chip.num_init_refreshes), init=timing.chip.num_init_refreshes - 1)
        until_due, due = Signal(range(timing.refresh), init=timing.refresh - 1), Signal()
        late = Signal(range(timing.refresh_latest + 1))

        def after(slots):
            """What follows comes ``slots`` later."""
            return [wait.eq(slots - 1), waits.eq(slots > 1)]

        with m.If(self.second):
            with m.If(until_due == 0):
                m.d.sync += [until_due.eq(timing.refresh - 1), due.eq(1)]
            with m.Else():
                m.d.sync += until_due.eq(until_due - 1)
            with m.If(waits):
                m.d.sync += [wait.eq(wait - 1), waits.eq(wait > 1)]
            with m.Else():
                with m.Switch(state):
                    with m.Case(_State.CLOSE):
                        with m.If(self.may_close):
                            m.d.comb += [self.command.eq(Command.PRECHARGE), self.a.eq(1 << ALL_BANKS)]
                            m.d.sync += [state.eq(_State.REFRESH), *after(timing.rp)]
                    with m.Case(_State.REFRESH):
                        m.d.comb += self.command.eq(Command.REFRESH)
                        m.d.sync += [due.eq(0), *after(timing.rfc)]
                        with m.If(self.ready):
                            m.d.sync += state.eq(_State.RESUME)
                        with m.Elif(refreshes == 0):
                            m.d.sync += state.eq(_State.SET_MODE)
                        with m.Else():
                            m.d.sync += refreshes.eq(refreshes - 1)
                    with m.Case(_State.SET_MODE):
                        m.d.comb += [self.command.eq(Command.MODE), self.a.eq(mode_register(timing.cas_latency))]
                        m.d.sync += [state.eq(_State.RESUME), *after(timing.mrd)]
                    with m.Case(_State.RESUME):
                        m.d.sync += [state.eq(_State.RUN), self.hold.eq(0), self.ready.eq(1)]
                    with m.Case(_State.RUN):
                        with m.If(due):
                            m.d.sync += [state.eq(_State.CLOSE), self.hold.eq(1)]
            with m.If(due & self.ready):
                m.d.sync += late.eq(late + 1)
            with m.Else():
                m.d.sync += late.eq(0)
        m.d.sync += Assert(late != timing.refresh_latest, "a refresh is late")
        return m
