"""A scene on a board: its image in the SDRAM, its picture's registers, and the picture back."""

import time

import numpy as np

from rtl.host.protocol import LinkCount
from rtl.memory_ports import memory_ports
from rtl.memory_system import FRAME_STRIDE
from rtl.sdram.commands import MAX_WORDS
from rtl.top_map import TopMap

from ..machine.machine import camera_words, memory_words
from ..machine.moving import port_writes
from .driver import LinkError

__all__ = ["Loader"]

#: Bits of ``status``
_READY, _SHOWN = 1, 4
#: Values before the chip's counters
_NUM_OWN = 4
#: Words between two calls of ``progress``
_PIECE = 4096
#: Seconds between two looks at the status, and how many there are
_LOOK, _LOOKS = 0.002, 30_000


class Loader:
    """Loads scenes over a driver's link, which it opens, and starts pictures.

    Two frames lie at the beginning of the memory, then the chip's memories one behind the other.

    Parameters
    ----------
    driver : Driver
        To the board.
    config : ChipConfig
        What the board's chip is built with.
    size : (int, int)
        Width and height of pictures.
    sleep : callable
        Waits for so many seconds between two looks at whether a picture is done.
    progress : callable
        Is told bytes done and all bytes, as they are.

    Raises
    ------
    LinkError
        If the board does not answer or has another chip; by all methods, if the link fails for good.
    """

    def __init__(self, driver, config, *, size, sleep=time.sleep, progress=lambda done, total: None):
        self._driver = driver
        self._config = config
        self._map = TopMap(config)
        self._size = size
        self._sleep = sleep
        self._progress = progress
        width, height = size
        if max(width, height) > FRAME_STRIDE:
            raise LinkError(f"pictures of {width}x{height}: a frame has up to {FRAME_STRIDE} pixels a side")
        self._frame_words = height * FRAME_STRIDE
        driver.open()
        if driver.num_registers != len(self._map.registers) or self._value("identity") != self._map.identity:
            raise LinkError("the board has another chip than this; give --chip the file that was written beside its "
                            "bitstream")
        # Its memory may not have begun yet, or a picture may be under way that another host has started.
        self._wait()
        self._set("frame0_base", 0)
        self._set("frame1_base", self._frame_words // MAX_WORDS)
        self._set("size", width | height << 16)

    def load(self, image):
        """Writes an image where the chip finds it.

        Raises
        ------
        LinkError
            Also if there is no room; then nothing has been written.
        """
        places, first = {}, 2 * self._frame_words
        for name, (line_words, _) in memory_ports(self._config).items():
            words = np.ravel(memory_words(image, name, self._config))
            places[name] = first, words
            # A line may reach past the last item, and a base is a multiple of 16 words.
            first += -(-(words.size + line_words) // MAX_WORDS) * MAX_WORDS
        if first > self._driver.memory_words:
            raise LinkError(f"the scene has {4 * sum(words.size for _, words in places.values()):,} bytes and its two "
                            f"frames {8 * self._frame_words:,}; the board's memory has "
                            f"{4 * self._driver.memory_words:,}: use a smaller scene, or its objects as instances")
        self._places = {name: at for name, (at, _) in places.items()}
        total, done = 4 * sum(words.size for _, words in places.values()), 0
        for name, (at, words) in places.items():
            self._set(f"{name}_base", at // MAX_WORDS)
            for start in range(0, words.size, _PIECE):
                piece = words[start:start + _PIECE].tolist()
                self._driver.write(at + start, piece)
                done += 4 * len(piece)
                self._progress(done, total)

    def update(self, pieces):
        """Writes pieces of an update, which may be while a picture is drawn that does not need what they replace.

        Parameters
        ----------
        pieces : list of Piece
            Of a :class:`~sim.scene.slots.SceneUpdate`.
        """
        for name, first, words in port_writes(pieces):
            self._driver.write(self._places[name] + first, words.tolist())

    def start(self, image, camera, *, background=(0, 0, 0)):
        """Starts a picture of the image that is loaded, or of what it was updated to."""
        self._set("root", image.root)
        red, green, blue = background
        self._set("background", red << 16 | green << 8 | blue)
        for number, word in enumerate(camera_words(image, camera, self._size[0]).tolist()):
            self._set(f"camera{number}", word)
        self._driver.start()

    def wait(self):
        """Waits until the picture that was started is on the screen.

        Returns
        -------
        dict
            The chip's counters, by name.
        """
        self._wait()
        names = self._map.values[_NUM_OWN:]
        return dict(zip(names, self._values(names[0], len(names)), strict=True))

    def picture(self):
        """uint8[height, width, 3]: the picture that is shown, out of the board's memory."""
        width, height = self._size
        shown = self._value("status") & _SHOWN
        rows = []
        for row in range(height):
            rows.append(self._driver.read((self._frame_words if shown else 0) + row * FRAME_STRIDE, width))
            self._progress(4 * width * (row + 1), 4 * width * height)
        words = np.array(rows, np.uint32)
        return np.stack([words >> 16, words >> 8, words], axis=-1).astype(np.uint8)

    def _wait(self):
        """Until the board is ready."""
        for _ in range(_LOOKS):
            if self._value("status") & _READY:
                return
            self._sleep(_LOOK)
        raise LinkError(f"the board has not been ready for {_LOOKS * _LOOK:g} seconds; reset it")

    def test_picture(self, on):
        """Shows the test picture, or the frame again."""
        self._set("options", int(on))

    def screen_counts(self):
        """Frames that the screen has shown, and lines that were late, since reset."""
        return self._value("frames"), self._value("late")

    def _set(self, name, value):
        self._driver.set_register(self._map.registers.index(name), value)

    def _values(self, first, count):
        return self._driver.registers(len(self._map.registers) + len(LinkCount) + self._map.values.index(first), count)

    def _value(self, name):
        return self._values(name, 1)[0]
