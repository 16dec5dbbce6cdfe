"""A monitor: from the bits of a DVI cable to pictures."""

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

__all__ = ["DviError", "DviReceiver", "ReceivedFrame", "decode_byte", "unpacked"]

#: The four symbols that no byte has, by their two controls. As sent, first bit first: 0010101011 and so on.
_CONTROL_TEXT = ("0010101011", "1101010100", "0010101010", "1101010101")
_CONTROLS = {sum(int(bit) << place for place, bit in enumerate(text)): number
             for number, text in enumerate(_CONTROL_TEXT)}
_NAMES = ("blue", "green", "red")
#: Controls in a row by which a channel finds where symbols begin
_RUN = 12


class DviError(Exception):
    """What is received is not what the specification allows."""


def decode_byte(symbol):
    """The byte of a symbol: d₀ = q₀, dᵢ = qᵢ ⊕ qᵢ₋₁, or its inverse without q₈; all q inverted if q₉."""
    inverted, exclusive = symbol >> 9, symbol >> 8 & 1
    q = symbol & 255 ^ (255 if inverted else 0)
    d = q ^ q << 1 & 255
    return d if exclusive else d ^ 254


def unpacked(pairs):
    """Bits in the order sent, of pairs for four channels in each integer."""
    pairs = np.asarray(pairs, np.uint8)
    return np.stack([np.stack([pairs >> 2 * channel & 1, pairs >> 2 * channel + 1 & 1], axis=-1).ravel()
                     for channel in range(4)])


def _bytes_table():
    """Of each symbol, the byte if it has one that is coded as it must be, else −1."""
    table = np.full(1024, -1, np.int16)
    for symbol in range(1024):
        byte = decode_byte(symbol)
        ones = byte.bit_count()
        exclusive = ones < 4 or (ones == 4 and byte & 1)
        if bool(symbol >> 8 & 1) == bool(exclusive):
            table[symbol] = byte
    return table


_BYTES = _bytes_table()
_CONTROL = np.full(1024, -1, np.int8)
for _symbol, _number in _CONTROLS.items():
    _CONTROL[_symbol] = _number
#: Ones more than zeros, in the eight bits of data and in all ten
_EXCESS8 = np.array([2 * (symbol & 255).bit_count() - 8 for symbol in range(1024)])
_EXCESS10 = np.array([2 * symbol.bit_count() - 10 for symbol in range(1024)])


@dataclass(eq=False)
class ReceivedFrame:
    """A whole frame as a monitor sees it; times as in :class:`~rtl.video.mode.VideoMode`.

    Parameters
    ----------
    picture : uint8[height, width, 3]
        Red, green, blue.
    times : dict from str to int
        ``width, h_front, h_sync, h_back, height, v_front, v_sync, v_back``.
    h_positive, v_positive : bool
        Whether sync pulses are high, which are the shorter part.
    """

    picture: np.ndarray
    times: dict
    h_positive: bool
    v_positive: bool


class DviReceiver:
    """Decodes what three channels and their clock have carried.

    It finds where symbols begin by the runs of controls between lines, in each channel by itself; checks that each byte
    is coded with the fewer transitions, and inverted as its channel's running disparity demands; that all three
    channels have pixels at the same times; and that all lines and frames have the same times.

    Parameters
    ----------
    bits : array of uint8[4, N]
        Of channels 0, 1, 2 and the clock, each bit in the order sent.

    Attributes
    ----------
    pixels : uint8[M, 3]
        Red, green and blue of each pixel clock, zeros where there is no pixel.
    active : bool[M]
        Whether there is one.
    h_sync, v_sync : uint8[M]
        Levels.
    max_disparity : int
        Largest running disparity of a channel, of either sign.

    Raises
    ------
    DviError
        At the first thing that is wrong, with where.
    """

    def __init__(self, bits):
        bits = np.asarray(bits, np.uint8)
        if bits.ndim != 2 or bits.shape[0] != 4:
            raise DviError(f"bits have the shape {bits.shape}; they must be of four channels")
        self._check_clock(bits[3])
        symbols, starts = zip(*(self._symbols(bits[channel], _NAMES[channel]) for channel in range(3)), strict=True)
        # Channels may be apart by less than half a symbol.
        first = max(starts)
        shifts = [(first - start + 5) // 10 for start in starts]
        count = min(len(each) - shift for each, shift in zip(symbols, shifts, strict=True))
        symbols = [each[shift:shift + count] for each, shift in zip(symbols, shifts, strict=True)]
        controls = [_CONTROL[each] for each in symbols]
        self.active = controls[0] < 0
        for channel in (1, 2):
            differs = np.flatnonzero((controls[channel] < 0) != self.active)
            if len(differs):
                raise DviError(f"{_NAMES[channel]}: has pixels at other times than blue, first at pixel clock "
                               f"{differs[0]}")
        self.max_disparity = max(self._check_disparity(each, name)
                                 for each, name in zip(symbols, _NAMES, strict=True))
        decoded = [_BYTES[each] for each in symbols]
        for channel, values in enumerate(decoded):
            wrong = np.flatnonzero(self.active & (values < 0))
            if len(wrong):
                raise DviError(f"{_NAMES[channel]}: symbol {symbols[channel][wrong[0]]:010b} at pixel clock {wrong[0]} "
                               "is coded with more transitions than needed")
        self.pixels = np.stack([decoded[2], decoded[1], decoded[0]], axis=-1)
        self.pixels[~self.active] = 0
        self.pixels = self.pixels.astype(np.uint8)
        # Syncs keep their levels while there are pixels.
        last = np.maximum.accumulate(np.where(self.active, -1, np.arange(count)))
        levels = np.where(last < 0, 0, controls[0][np.maximum(last, 0)])
        self.h_sync, self.v_sync = (levels & 1).astype(np.uint8), (levels >> 1 & 1).astype(np.uint8)

    @staticmethod
    def _check_clock(bits):
        rises = np.flatnonzero((bits[1:] == 1) & (bits[:-1] == 0))
        falls = np.flatnonzero((bits[1:] == 0) & (bits[:-1] == 1))
        if len(rises) < 2 or (np.diff(rises) != 10).any() or (np.diff(falls) != 10).any():
            raise DviError("clock: is not a clock of ten bits")

    @staticmethod
    def _symbols(bits, name):
        """Symbols from the first run of controls on, and the bit at which it begins."""
        windows = np.zeros(len(bits) - 9, np.int64)
        for place in range(10):
            windows |= bits[place:len(bits) - 9 + place].astype(np.int64) << place
        is_control = _CONTROL[windows] >= 0
        span = 10 * (_RUN - 1)
        run = is_control[:len(windows) - span].copy()
        for number in range(1, _RUN):
            run &= is_control[10 * number:len(windows) - span + 10 * number]
        found = np.flatnonzero(run)
        if not len(found):
            raise DviError(f"{name}: there is no run of {_RUN} controls, so nobody knows where symbols begin")
        return windows[found[0]::10], int(found[0])

    @staticmethod
    def _check_disparity(symbols, name):
        """Largest running disparity; each symbol must be inverted if, and only if, that balances its channel."""
        running, largest = 0, 0
        is_control = _CONTROL[symbols] >= 0
        excess8, excess10 = _EXCESS8[symbols].tolist(), _EXCESS10[symbols].tolist()
        for place, (symbol, control) in enumerate(zip(symbols.tolist(), is_control.tolist(), strict=True)):
            if control:
                running = 0
                continue
            sent = excess8[place]
            if running == 0 or sent == 0:
                right = (symbol >> 9 & 1) != (symbol >> 8 & 1)
            else:
                right = (sent > 0) != (running > 0)
            if not right:
                raise DviError(f"{name}: symbol {symbol:010b} at pixel clock {place} takes a disparity of {running} "
                               "the wrong way")
            running += excess10[place]
            largest = max(largest, abs(running))
        return largest

    def frames(self):
        """Whole frames, each from the first line after a vertical sync to the next one."""
        h_positive, v_positive = (self._polarity(level) for level in (self.h_sync, self.v_sync))
        h_pulse = (self.h_sync == 1) == h_positive
        v_pulse = (self.v_sync == 1) == v_positive
        lines = np.flatnonzero(h_pulse[1:] & ~h_pulse[:-1]) + 1
        v_begins = np.flatnonzero(v_pulse[1:] & ~v_pulse[:-1]) + 1
        frames = []
        for begin, end in pairwise(v_begins):
            inside = lines[(lines >= begin) & (lines <= end)]
            if not len(inside) or inside[0] != begin or inside[-1] != end:
                raise DviError(f"vertical sync at pixel clock {begin} does not begin with a horizontal one")
            frames.append(ReceivedFrame(*self._frame(inside, h_pulse, v_pulse), h_positive, v_positive))
        return frames

    @staticmethod
    def _polarity(level):
        """Whether pulses are high: they are the shorter part."""
        return bool(2 * int(level.sum()) < len(level))

    def _frame(self, lines, h_pulse, v_pulse):
        h_total = int(lines[1] - lines[0])
        if (np.diff(lines) != h_total).any():
            raise DviError(f"lines of a frame have {sorted(set(np.diff(lines).tolist()))} pixel clocks")
        area = slice(lines[0], lines[-1])
        active, pulse, vertical, pixels = (each[area].reshape(-1, h_total, *each.shape[1:])
                                           for each in (self.active, h_pulse, v_pulse, self.pixels))
        visible = active.any(axis=1)
        columns = active[visible]
        if not len(columns) or (columns != columns[0]).any() or (pulse != pulse[0]).any():
            raise DviError("lines of a frame have pixels or syncs at different times")

        # A line begins with its sync pulse here, a frame likewise.
        def spans(flags, what):
            edges = np.flatnonzero(np.diff(flags.astype(np.int8)))
            if len(edges) > 2:
                raise DviError(f"{what} come in several parts")
            return int(flags.argmax()), int(flags.sum())

        h_first, width = spans(columns[0], "pixels of a line")
        v_first, height = spans(visible, "visible lines of a frame")
        h_sync, v_sync = int(pulse[0].sum()), int(vertical.all(axis=1).sum())
        if (vertical.any(axis=1) != vertical.all(axis=1)).any():
            raise DviError("vertical sync changes within a line")
        times = {"width": width, "h_front": h_total - h_first - width, "h_sync": h_sync, "h_back": h_first - h_sync,
                 "height": height, "v_front": len(visible) - v_first - height, "v_sync": v_sync,
                 "v_back": v_first - v_sync}
        return pixels[v_first:v_first + height, h_first:h_first + width], times
