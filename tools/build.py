"""``dynrt build``: a board's bitstream, with its timing and area."""

from pathlib import Path

import click
from rich.console import Console

from boards.bitstream import board_design, pack_bitstream, route
from boards.catalog import BOARDS
from boards.design import synthesise
from boards.toolchain import versions

from .board_options import board_argument, board_chip, chip_option
from .board_page import board_page, check_board_page
from .build_report import built, missed, words
from .built_in import built_in_scene
from .chip_file import chip_text
from .engines import progress_on
from .errors import BadInput, Failure, clear_errors, written_whole
from .results import json_text, write_texts

__all__ = ["build"]


@click.command()
@board_argument
@chip_option
@click.option("--scene", help="Build a chip with this scene in its block RAM, which goes round it for ever on the "
              "screen, 128x96 pixels, without host and SDRAM")
@click.option("--clock", "clock_mhz", type=click.FloatRange(min=10), help="MHz of chip and SDRAM  [default: 50]")
@click.option("--seeds", type=click.IntRange(1), default=1, show_default=True, help="Placements to try; the fastest "
              "becomes the bitstream, the report has all")
@click.option("-o", "--output", type=click.Path(file_okay=False, path_type=Path), help="Folder to write BOARD.bit, "
              "chip.json and report.json to  [default: build/BOARD]")
@click.option("--docs", type=click.Path(exists=True, file_okay=False, path_type=Path), help="Keep the report in "
              "results/BOARD.json of this folder too, and fill the tables of its board.md")
def build(board, parameters, scene, clock_mhz, seeds, output, docs):
    """Build the bitstream of BOARD; fails if no placement is fast enough for its clocks.

    Synthesis of a full chip takes some minutes, a placement a quarter of an hour; what has been done is kept.
    """
    chosen = BOARDS[board]
    config = board_chip(chosen, parameters)
    if scene is not None and docs is not None:
        raise click.UsageError("--docs: the tables are of boards with host and SDRAM; leave --scene or --docs out")
    output = output or Path("build") / (board if scene is None else f"{board}-{Path(scene).stem}")
    console = Console(stderr=True, highlight=False)
    with clear_errors():
        if docs is not None:
            check_board_page(docs)
        target = clock_mhz or chosen.clock_mhz
        try:
            built_in = None if scene is None else built_in_scene(scene, config, mode=chosen.mode)
            design, clocks = board_design(chosen, config=config, clock_mhz=target, scene=built_in)
        except ValueError as error:
            raise BadInput(f"--clock: {error}") from error
        tools = versions()
        with progress_on(console, "synthesis") as progress:
            synthesise(design)
            routed = []
            for seed in range(1, seeds + 1):
                progress(f"place and route, seed {seed} of {seeds}")
                routed.append(route(chosen, design, seed=seed, clocks=clocks))
                console.print(words(routed[-1], clocks), markup=False, soft_wrap=True)
        report = built(chosen, config, clocks, routed, tools)
        try:
            output.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise BadInput(f"{output}: cannot be made: {error.strerror}") from error
        write_texts({output / "report.json": json_text(report), output / "chip.json": chip_text(config)})
        if docs is not None:
            write_texts({docs / "results" / f"{board}.json": json_text(report),
                         docs / "board.md": board_page(docs, report)})
        if failed := missed(routed, clocks):
            raise Failure(f"{board}: {failed}; report.json has its slowest path. Ask for a slower --clock, or for more "
                          "--seeds")
        best = max((each for each in routed if not each.too_slow(clocks)), key=lambda each: each.mhz["sync"])
        with written_whole(output / f"{board}.bit") as path:
            path.write_bytes(pack_bitstream(chosen, design, seed=best.seed, clocks=clocks))
        then = f", then dynrt load SCENE --port ... --chip {output / 'chip.json'}" if scene is None else ""
        console.print(f"{output / f'{board}.bit'}: seed {best.seed}, the chip at {clocks['sync']:g} MHz; load it with "
                      f"openFPGALoader{then}", markup=False, soft_wrap=True)
