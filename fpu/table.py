"""Functions of a significand by a table of straight lines."""

from types import SimpleNamespace

import numpy as np
from amaranth.hdl import Cat, Const

from .chain import ChainBit, carry_chain
from .pipeline import carry_delay
from .product import multiply_exactly, product_delays
from .rom import Rom

__all__ = ["LineTable"]

_WORD_WIDTH = 36
# Into the block RAM, through its output register, and away from it to a multiplier block.
_READ_DELAYS = {"read": 3.0, "out": 4.0, "move": 3.0}


class LineTable:
    """A falling function with values from ½ to 1, as straight lines whose values and slopes are in one block RAM.

    Of each line, slope and value are those that make its largest error least; what the error is, is known from trying
    all points.

    Parameters
    ----------
    function : callable
        Of an array of float64.
    points : array of float64
        Where it is wanted: as many for each line, both powers of two.
    num_lines : int
        How many lines, up to 512.
    value_width : int
        Bits of the result, all behind the point.

    Attributes
    ----------
    values : array of int
        The result at each point, in units of 2^-value_width.
    max_error : float
        Largest distance between a result and the function.
    """

    def __init__(self, function, points, *, num_lines, value_width):
        self.value_width = value_width
        exact = function(points).reshape(num_lines, -1) * 2.0 ** value_width
        steps = np.arange(exact.shape[1])
        self.offset_width = (len(steps) - 1).bit_length()
        falls = (exact[:, :1] - exact[:, -1:]) / max(1, len(steps) - 1)
        self._slope_width = _WORD_WIDTH - value_width if self.offset_width else 0
        # Units of a slope below those of the result, so that the steepest fits.
        self._drop = self._slope_width - int(np.ceil(np.log2(falls.max() * 1.001))) if self.offset_width else 0
        slopes = np.rint(falls * 2.0 ** self._drop).astype(np.int64)
        fallen = slopes * steps >> self._drop
        error = exact + fallen
        starts = np.rint((error.max(1, keepdims=True) + error.min(1, keepdims=True)) / 2).astype(np.int64)
        starts = np.minimum(starts, (1 << value_width) - 1)
        self.values = (starts - fallen).ravel()
        self.max_error = np.abs(self.values * 2.0 ** -value_width - function(points)).max()
        self._words = (slopes << value_width | starts).ravel().tolist()

    def delays(self, name):
        """Delays of the steps of :meth:`look_up`."""
        delays = {f"{name}_{stage}": delay for stage, delay in _READ_DELAYS.items()}
        if self.offset_width:
            delays |= product_delays(f"{name}_slope", self._slope_width, self.offset_width)
            delays[f"{name}_line"] = carry_delay(self.value_width)
        return delays

    def look_up(self, m, step, name, line, offset, **carried):
        """What is ``carried`` through the steps, and as ``value`` the result at point ``offset`` of ``line``."""
        m.submodules[name] = rom = Rom(self._words, width=self.value_width + self._slope_width,
                                       cycles=step.registers_of_next(len(_READ_DELAYS)))
        m.d.comb += rom.address.eq(line)
        s = SimpleNamespace(offset=offset, **carried)
        for stage in _READ_DELAYS:
            s = step(f"{name}_{stage}", s)
        start, slope = rom.data[:self.value_width], rom.data[self.value_width:]
        if not self.offset_width:
            return SimpleNamespace(**vars(s), value=start)
        s = multiply_exactly(m, step, f"{name}_slope", (slope, s.offset), start=start,
                             **{field: value for field, value in vars(s).items() if field != "offset"})
        fallen = Cat(s.products[0][self._drop:], Const(0, self.value_width))[:self.value_width]
        value = carry_chain(m, f"{name}_value", (ChainBit.CARRY, Const(1, 1), 0, 0),
                            (ChainBit.SUBTRACT, s.start, fallen, 0))[1:]
        kept = {field: kept for field, kept in vars(s).items() if field not in ("start", "products")}
        return step(f"{name}_line", value=value, **kept)
