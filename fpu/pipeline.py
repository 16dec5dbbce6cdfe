"""Where an operator's registers go."""

from types import SimpleNamespace

from amaranth.hdl import Signal

__all__ = ["Pipeline", "balance", "carry_delay", "depth_for", "digit_delay", "lut_delay",
           "stage_delay_at"]


# Of an ECP5 of speed grade 6, in ns, each with the routing before it.
_LUT_DELAY = 1.05
_CARRY_ENTRY_DELAY = 2.0
_CARRY_BIT_DELAY = 0.035
#: One net to all places of a carry chain.
_FAN_OUT_DELAY = 0.5
# Into and out of registers
_REGISTER_DELAY = 0.5
_DEFAULT_CLOCK_MHZ = 175


def stage_delay_at(clock_mhz):
    """What a clock leaves to logic between two registers, in ns."""
    return 1e3 / clock_mhz - _REGISTER_DELAY


def lut_delay(levels):
    """Delay in ns of four-input tables in a row."""
    return _LUT_DELAY * levels


def carry_delay(width):
    """Delay in ns of a carry chain, into it and out of it."""
    return _CARRY_ENTRY_DELAY + _CARRY_BIT_DELAY * width


def digit_delay(width):
    """Delay in ns of a digit of a recurrence: a carry chain whose last place decides what all of the next one do."""
    return carry_delay(width) + _FAN_OUT_DELAY


def balance(weights, *, latency):
    """Numbers of registers after each of a sequence of steps that make the slowest stage fastest.

    The last register is always at the output. Among equally fast placements the one with the least sum of squared
    stage delays is taken. Registers beyond one for each step follow the last step.

    Parameters
    ----------
    weights : sequence of float
        Delay of each step, in any unit.
    latency : int
        Registers to place.
    """
    num_stages = min(latency, len(weights))
    if not num_stages:
        return [0] * len(weights)
    # best[end] = (slowest stage, sum of squares, ends of the stages) for the steps before `end`
    best = {0: (0, 0, ())}
    for _ in range(num_stages):
        candidates = {}
        for start, (slowest, squares, ends) in best.items():
            stage = 0
            for end in range(start + 1, len(weights) + 1):
                stage += weights[end - 1]
                candidate = (max(slowest, stage), squares + stage ** 2, (*ends, end))
                candidates[end] = min(candidate, candidates.get(end, candidate))
        best = candidates
    *_, ends = best[len(weights)]
    registers = [int(step + 1 in ends) for step in range(len(weights))]
    registers[-1] += latency - num_stages
    return registers


def depth_for(weights, *, stage_delay=None):
    """Fewest registers, the last at the output, with which no stage of several steps is slower than ``stage_delay``.

    By default that is what a clock of 175 MHz leaves.
    """
    if stage_delay is None:
        stage_delay = stage_delay_at(_DEFAULT_CLOCK_MHZ)
    depth, stage = 1, 0
    for weight in weights:
        if stage and stage + weight > stage_delay:
            depth, stage = depth + 1, 0
        stage += weight
    return depth


class Pipeline:
    """Registers spread over the steps of an operator.

    Calling it ends a step: the step's results become named signals, through as many registers as :func:`balance`
    gives that step, none included; so the operator is written once for every latency.

    Parameters
    ----------
    m : Module
        Where the registers go.
    weights : dict from str to float
        Delay of each step, in ns, in the order in which they will be ended.
    latency : int
        Registers from the operands to the last step's results.
    """

    def __init__(self, m, *, weights, latency):
        self._m = m
        self._remaining = list(zip(weights, balance(list(weights.values()), latency=latency), strict=True))

    def registers_of_next(self, count):
        """Registers behind the next ``count`` steps to be ended, for what brings its own."""
        return sum(registers for _, registers in self._remaining[:count])

    def __call__(self, name, carried=None, /, **results):
        """End the step ``name``: its ``results``, and what is ``carried`` from before, as attributes."""
        expected, registers = self._remaining.pop(0)
        assert name == expected, f"Step {name!r} ended, {expected!r} expected"
        values = {**(vars(carried) if carried else {}), **results}
        return SimpleNamespace(**{field: self._register(f"{name}_{field}", value, registers)
                                  for field, value in values.items()})

    def _register(self, name, value, registers):
        shape = value.shape()
        if registers == 0:
            signal = Signal(shape, name=name)
            self._m.d.comb += signal.eq(value)
            return signal
        for _ in range(registers):
            signal = Signal(shape, name=name, reset_less=True)
            self._m.d.sync += signal.eq(value)
            value = signal
        return signal
