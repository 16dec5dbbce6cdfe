"""A scene goes where the chip looks for it, and the driver's errors say what is wrong."""

import numpy as np
import pytest

from rtl.config import ChipConfig
from rtl.host.protocol import LinkCount
from rtl.memory_ports import memory_ports
from rtl.sdram.commands import MAX_WORDS
from rtl.top_map import TopMap
from sim.host import Board, Driver, LinkError
from sim.host.loader import Loader
from sim.machine.machine import camera_words
from sim.scene import load_scene
from sim.scene.compile import CompiledScene, compile_scene

from .test_driver import Direct

CONFIG = ChipConfig(num_threads=4)
SIZE = 32, 16


class DrawingBoard(Board):
    """A board of Python that draws a picture of one colour a row into the frame that is not shown."""

    def __init__(self, config=CONFIG, *, num_words=1 << 20, busy=0, identity=None):
        self.map = TopMap(config)
        self.shown, self.busy, self.identity = 0, busy, identity
        super().__init__(num_words=num_words, num_registers=len(self.map.registers), values=self.read,
                         num_guarded=self.map.num_guarded)

    def value(self, name):
        return self.registers[self.map.registers.index(name)]

    def read(self):
        self.busy = max(0, self.busy - 1)
        own = {"identity": self.map.identity if self.identity is None else self.identity,
               "status": int(not self.busy) | self.shown << 2, "frames": 7, "late": 0}
        return [own[name] if name in own else 1000 + number for number, name in enumerate(self.map.values)]

    def _execute(self, kind, words, again):
        before = self.starts
        answer = super()._execute(kind, words, again)
        if self.starts > before:
            base = MAX_WORDS * self.value(f"frame{1 - self.shown}_base")
            size = self.value("size")
            for row in range(size >> 16):
                self.memory.update({base + 1024 * row + x: row << 16 | x for x in range(size & 0xFFFF)})
            self.shown ^= 1
            self.busy = 3
        return answer


def loader(board, config=CONFIG):
    port = Direct(board)
    return Loader(Driver(port, clock=port.clock), config, size=SIZE, sleep=lambda seconds: None)


def image_of(scene, config=CONFIG):
    return compile_scene(scene, fmt=config.fmt, stack_depth=config.stack_depth)


def test_an_image_is_where_the_bases_say():
    board, scene = DrawingBoard(), load_scene("room")
    image = image_of(scene)
    loader(board).load(image)
    ends = [0]
    for name, (line_words, _) in memory_ports(CONFIG).items():
        words = np.ravel(getattr(image, name))
        base = MAX_WORDS * board.value(f"{name}_base")
        assert [board.memory.get(base + place, 0) for place in range(words.size)] == words.tolist()
        assert base >= ends[-1], "memories lie over each other"
        ends.append(base + words.size + line_words)
    # The frames lie before them.
    assert MAX_WORDS * board.value("nodes_base") >= MAX_WORDS * board.value("frame1_base") + 1024 * SIZE[1]


def test_pictures_are_drawn_and_read_in_turn():
    board, scene = DrawingBoard(busy=5), load_scene("room")
    image, camera = image_of(scene), scene.default_camera()
    link = loader(board)
    link.load(image)
    for number in range(1, 4):
        link.start(image, camera, background=(1, 2, 3))
        counters = link.wait()
        assert counters["cycles"] == 1000 + board.map.values.index("cycles")
        assert board.starts == number
        assert board.value("background") == 0x010203
        assert board.value("root") == image.root
        assert [board.value(f"camera{word}") for word in range(9)] == camera_words(image, camera, SIZE[0]).tolist()
        y, x = np.mgrid[:SIZE[1], :SIZE[0]]
        assert np.array_equal(link.picture(), np.stack([y, 0 * x, x], axis=-1))
    assert link.screen_counts() == (7, 0)
    link.test_picture(True)
    assert board.value("options") == 1


def test_updates_change_what_they_say_alone():
    scene = load_scene("walk")
    compiled = CompiledScene(scene, fmt=CONFIG.fmt, stack_depth=CONFIG.stack_depth)
    camera = scene.default_camera()
    board = DrawingBoard()
    link = loader(board)
    image = compiled.image(scene, eye=camera.eye, slot=0)
    link.load(image)
    update = compiled.update(scene.at_time(1.0), slot=1, eye=camera.eye)
    link.update(update.ahead)
    link.update(update.between)
    following = image.updated(update)
    for name in memory_ports(CONFIG):
        words, base = np.ravel(getattr(following, name)), MAX_WORDS * board.value(f"{name}_base")
        assert [board.memory.get(base + place, 0) for place in range(words.size)] == words.tolist()


def test_what_cannot_be():
    with pytest.raises(LinkError, match=r"^the board has another chip than this; give --chip the file that was written "
                                        r"beside its bitstream$"):
        loader(DrawingBoard(identity=5))
    with pytest.raises(LinkError, match=r"^the board has another chip"):
        loader(DrawingBoard(ChipConfig(num_threads=5)))
    board = DrawingBoard(num_words=40_000)
    link = loader(board)
    with pytest.raises(LinkError, match=r"^the scene has [\d,]+ bytes and its two frames 131,072; the board's memory "
                                        r"has 160,000: use a smaller scene, or its objects as instances$"):
        link.load(image_of(load_scene("room")))
    assert not board.memory
    with pytest.raises(LinkError, match=r"^the board has not been ready for 60 seconds; reset it$"):
        loader(DrawingBoard(busy=1 << 30))
    with pytest.raises(LinkError, match=r"^pictures of 2000x16: a frame has up to 1024 pixels a side$"):
        Loader(None, CONFIG, size=(2000, 16))


def test_counts_lie_between_registers_and_values():
    assert len(LinkCount) == 4
    assert TopMap(CONFIG).values[:4] == ("identity", "status", "frames", "late")
