"""``dynrt board``: a board simulated at its pins, for dynrt load and dynrt view."""

from pathlib import Path

import click
from rich.console import Console

from boards.catalog import BOARDS
from sim.host.tty import PseudoTerminal
from sim.machine.board_bench import SimulatedBoard
from sim.machine.dvi_receiver import DviError

from .animation import save_picture
from .board_options import board_argument, board_chip, chip_option
from .engines import progress_on
from .errors import Failure, check_folders, clear_errors, written_whole

__all__ = ["simulated"]

#: Cycles between two looks at the cable
_STRIDE = 4000


@click.command("board")
@board_argument
@chip_option
@click.option("--screen", type=click.Path(dir_okay=False, path_type=Path), help="PNG to write after each picture: what "
              "a monitor at the board's connector shows, decoded from its signals")
@click.option("--pictures", type=click.IntRange(1), help="End after so many pictures  [default: run until Ctrl-C]")
def simulated(board, parameters, screen, pictures):
    """Simulate BOARD at its pins: serial cable, SDRAM, monitor. Prints the port that dynrt load --port takes.

    It goes at a ten-thousandth of a real one's speed, but its cable takes a byte in 40 cycles. Give dynrt load the
    same --board and --chip, and --timeout 60.
    """
    chosen = BOARDS[board]
    check_folders(screen)
    console = Console(stderr=True, highlight=False)
    with clear_errors():
        with progress_on(console, "compiling the board") as progress:
            simulation = SimulatedBoard(board_chip(chosen, parameters), clock_mhz=chosen.clock_mhz, mode=chosen.mode,
                                        scale=chosen.scale, progress=progress)
        terminal = PseudoTerminal()
        click.echo(terminal.path)
        try:
            _run(simulation, terminal, screen, pictures, console)
        finally:
            terminal.close()
            simulation.close()


def _run(simulation, terminal, screen, pictures, console):
    drawn, was_drawing = 0, False
    while pictures is None or drawn < pictures:
        terminal.serve(simulation, seconds=0)
        terminal.send(simulation.run(_STRIDE))
        if was_drawing and simulation.is_ready:
            drawn += 1
            console.print(f"picture {drawn}: shown in cycle {simulation.cycle:,}")
            if screen is not None:
                _photograph(simulation, screen, console)
            was_drawing = False
        was_drawing |= simulation.is_drawing


def _photograph(simulation, path, console):
    try:
        frame, = simulation.screen(1)
    except DviError as error:
        raise Failure(f"the monitor: {error}") from error
    with written_whole(path) as whole:
        save_picture(whole, frame.picture)
    height, width = frame.picture.shape[:2]
    console.print(f"{path}: {width}x{height}, as the monitor shows it", markup=False, soft_wrap=True)
