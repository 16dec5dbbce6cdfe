"""Options and the common steps of commands that talk to a board."""

from contextlib import contextmanager
from dataclasses import dataclass
from functools import wraps

import click

from boards.board import Board
from boards.catalog import BOARDS
from rtl.config import ChipConfig
from sim.host import Driver, LinkError
from sim.host.loader import Loader
from sim.host.tty import SerialPort
from sim.scene import load_scene
from sim.scene.compile import CompiledScene

from .engines import Order
from .errors import Failure
from .options import CHIP, chip_config

__all__ = ["Link", "board_argument", "board_chip", "chip_option", "link_options", "linked", "prepared"]

board_argument = click.argument("board", type=click.Choice(list(BOARDS)))
chip_option = click.option("--chip", "parameters", type=CHIP, multiple=True, help="A parameter of the chip, see "
                           "rtl/config.py, or a file with them  [default: the board's own chip]")


def board_chip(board, parameters):
    """The chip that is asked for: a board's own, or one that ``--chip`` makes.

    Raises
    ------
    BadInput, UsageError
        See :func:`~.options.chip_config`.
    """
    return chip_config(None, parameters) if parameters else board.config


@dataclass(frozen=True, kw_only=True)
class Link:
    """What :func:`link_options` have asked for: a board with its chip, at a port."""

    board: Board
    config: ChipConfig
    port: str
    baud: int | None
    timeout: float


def link_options(command):
    """The options of a command that talks to a board, which it gets as ``link``."""
    @wraps(command)
    def run(board, parameters, port, baud, timeout, **others):
        board = BOARDS[board]
        return command(link=Link(board=board, config=board_chip(board, parameters), port=port, baud=baud,
                                 timeout=timeout), **others)

    for option in (
            click.option("--timeout", type=click.FloatRange(min=0.01), default=0.25, show_default=True,
                         help="Seconds for an answer; a simulated board takes longer"),
            click.option("--baud", type=click.IntRange(1), help="Rate of the serial port  [default: the board's]"),
            chip_option,
            click.option("--board", type=click.Choice(list(BOARDS)), default="ulx3s_85f", show_default=True),
            click.option("--port", required=True, help="Serial port of the board, such as /dev/ttyUSB0, or what "
                         "dynrt board has printed")):
        run = option(run)
    return run


@contextmanager
def linked(link, *, progress):
    """A :class:`~sim.host.loader.Loader` at the port; errors of the link become messages.

    Raises
    ------
    Failure
        If the link fails.
    """
    try:
        port = SerialPort(link.port, baud=link.baud or link.board.baud)
        try:
            yield Loader(Driver(port, timeout=link.timeout), link.config, size=link.board.size, progress=progress)
        finally:
            port.close()
    except LinkError as error:
        raise Failure(str(error)) from error


def prepared(scene, config, *, size, background):
    """A scene for a board's chip, and for pictures of a size.

    Returns
    -------
    scene : Scene
    compiled : CompiledScene
    order : Order
        By which the model draws the same.
    """
    loaded = load_scene(scene)
    order = Order(engine="model", size=size, config=config, background=background,
                  shading="simple" if config.shader is None else "full",
                  depth=0 if config.shader is None else config.shader.depth)
    compiled = CompiledScene(loaded, fmt=config.fmt, stack_depth=config.stack_depth, index_width=config.index_width)
    # Whether it can draw the scene is to be said before anything is sent.
    order.chip_for(compiled)
    return loaded, compiled, order
