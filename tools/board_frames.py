"""``dynrt board-frames``: frames a second of a board's chip, its scene in one SDRAM, on the paper's scenes."""

from dataclasses import replace

import click
from rich.console import Console

from boards.catalog import BOARDS
from sim.machine.sdram_bench import render_sdram
from sim.model import render_full
from sim.scene.compile import CompiledScene
from sim.scene.table3 import PAPER_MHZ, SIZE, TABLE3

from .bench_chips import SHADINGS, chip_digest
from .bench_measure import plainly_lit
from .board_options import board_argument
from .engines import progress_on
from .errors import BadInput, clear_errors
from .options import docs_option
from .page import check_places, filled_page, markdown_table
from .results import earlier_results, json_text, write_texts

__all__ = ["board_frames"]

#: Those of the paper's scenes whose frames a second are wanted of a board.
SCENES = ("Scene6", "Quake3", "Conference")
#: Of the paper's frames a second, at the board's clock; what else the SDRAM has to do takes the rest.
_PART = 0.8


def textured(config):
    """The board's chip with one shader that does textures and no more, as the paper's Table 3 shades."""
    return replace(SHADINGS["textured"](config), num_shaders=1)


def _row(name, folder, config, clock_mhz, digest, progress):
    loaded = TABLE3[name].load(folder)
    scene = plainly_lit(loaded.scene)
    compiled = CompiledScene(scene, fmt=config.fmt, stack_depth=config.stack_depth, index_width=config.index_width)
    image = replace(compiled.image(scene, eye=loaded.camera.eye, is_full=True), needs=config.shader)
    frame = render_sdram(image, loaded.camera, *SIZE, config=config, clock_mhz=clock_mhz, progress=progress)
    model = render_full(image, loaded.camera, *SIZE, config=config)
    report = frame.report
    return {"scene": name, "real": loaded.is_real, "size": list(SIZE), "cycles": report["cycles"],
            "cycles_per_ray": report["cycles_per_ray"], "busy": report["busy"],
            "hit": {port: count["hits"] / max(count["hits"] + count["misses"], 1)
                    for port, count in report["cache"].items()},
            "sdram_bytes_per_ray": report["sdram"]["bytes"] / (SIZE[0] * SIZE[1]),
            "sdram_busy": report["sdram"]["busy"],
            "wrong_pixels_vs_model": int((frame.color != model.color).any(axis=-1).sum()), "digest": digest}


def with_clock(row, mhz):
    """The row with frames a second at that clock, and those that are wanted at it."""
    return {**row, "mhz": mhz, "fps": 1e6 * mhz / row["cycles"],
            "wanted_fps": _PART * TABLE3[row["scene"]].paper.fps * mhz / PAPER_MHZ}


def _table(results):
    return markdown_table(
        ("scene", "cycles a ray", "frames a second", "wanted", "hits of nodes / lists / matrices, %",
         "busy: traversal / transformation / intersection, %", "bytes a ray of the SDRAM", "its data lines busy",
         "pixels that are not the model's"),
        [(row["scene"] + ("" if row["real"] else ", a stand-in"), f"{row['cycles_per_ray']:.1f}", f"{row['fps']:.1f}",
          f"{row['wanted_fps']:.1f}",
          " / ".join(f"{100 * row['hit'][port]:.0f}" for port in ("nodes", "lists", "matrices")),
          " / ".join(f"{100 * row['busy'][unit]:.0f}" for unit in ("traversal", "transformation", "intersection")),
          f"{row['sdram_bytes_per_ray']:.0f}", f"{100 * row['sdram_busy']:.0f} %", row["wrong_pixels_vs_model"])
         for row in results.get("rows", [])])


_PARTS = {"frames": _table}


@click.command("board-frames")
@board_argument
@click.option("--scenes", help="Folder of real scenes; without one, built-in ones stand for them")
@click.option("--only", type=click.Choice(SCENES), multiple=True, help="Only these scenes")
@docs_option("Where board.md and the results of dynrt build are")
def board_frames(board, scenes, only, docs):
    """Frames a second of BOARD's chip at the clock of its slowest seed: textured, 512x384, everything in its SDRAM.

    Fills the table of docs/board.md and docs/results/BOARD-frames.json; what has been measured of the same chip stays.
    """
    config = textured(BOARDS[board].config)
    with clear_errors():
        built = earlier_results(docs / "results" / f"{board}.json")
        if not built:
            raise BadInput(f"{docs / 'results' / f'{board}.json'}: is not there; run dynrt build {board} --docs {docs} "
                           "first")
        # The SDRAM's times are the more cycles the faster the clock: those of the bitstream's.
        mhz, clock_mhz = (built["clocks"]["chip"][each] for each in ("worst_mhz", "needed_mhz"))
        check_places(docs / "board.md", _PARTS)
        path = docs / "results" / f"{board}-frames.json"
        digest = chip_digest(config, latency=f"SDRAM at {clock_mhz} MHz")
        rows = {row["scene"]: row for row in earlier_results(path).get("rows", []) if row["digest"] == digest}
        with progress_on(Console(stderr=True, highlight=False), "frames") as progress:
            for name in SCENES:
                if name in (only or SCENES) and name not in rows:
                    progress(name)
                    rows[name] = _row(name, scenes, config, clock_mhz, digest, progress)
                results = {"board": board, "config": repr(config),
                           "rows": [with_clock(rows[each], mhz) for each in SCENES if each in rows]}
                write_texts({path: json_text(results), docs / "board.md": filled_page(docs / "board.md", _PARTS,
                                                                                      results)})
