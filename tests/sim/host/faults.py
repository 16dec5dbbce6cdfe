"""A hundred thousand frames damaged on their way between driver and board, and what became of them."""

import random
import time
from pathlib import Path

import click

from sim.host import Board
from tests.sim.host.faulty_link import FAULTS, Session
from tools.results import earlier_results, json_text, write_texts

__all__ = ["campaign"]

_PERIOD = 20_000
_RATES = (0.05, 0.15, 0.3)


def boards(name, progress):
    """A board of Python, or the Verilated hardware."""
    if name == "model":
        return Board(values=Session.values, **Session.shape)
    from tests.rtl.host.verilated import VerilatedBoard

    return VerilatedBoard(values=Session.values(), progress=progress, **Session.shape)


def campaign(board, *, count, seed=1, progress=lambda text: None):
    """Counts of sessions in which so many frames were damaged; fails at the first thing that is wrong.

    Raises
    ------
    AssertionError
        If memory, registers or pictures started are not what the driver has reported.
    """
    sums = {"damaged": 0, "frames": 0, "commands": 0, "repeated": 0}
    faults, reported = dict.fromkeys([*FAULTS, "late"], 0), {}
    number = 0
    while sums["damaged"] < count:
        rate = _RATES[number % len(_RATES)]
        session = Session(board, random.Random(f"{seed} {number}"), rate=rate)
        session.run(0, damaged=min(_PERIOD, count - sums["damaged"]))
        sums["damaged"] += session.damaged
        sums["frames"] += session.link.frames
        sums["commands"] += sum(session.commands.values())
        sums["repeated"] += session.repeated
        for fault in faults:
            faults[fault] += session.link.faults[fault]
        for what, often in session.reported.items():
            reported[what] = reported.get(what, 0) + often
        number += 1
        progress(f"{sums['damaged']:,} of {sums['frames']:,} frames damaged, {sums['commands']:,} commands")
    return {**sums, "faults": faults, "reported": dict(sorted(reported.items())), "wrong": 0}


@click.command()
@click.option("--count", type=click.IntRange(1), default=100_000, show_default=True, help="Frames to damage.")
@click.option("--board", type=click.Choice(["model", "rtl"]), default="model", show_default=True)
@click.option("--seed", default=1, show_default=True)
@click.option("--output", type=click.Path(path_type=Path), default="docs/results/host_faults.json", show_default=True)
def main(count, board, seed, output):
    """Damage frames, and write what became of them, if nothing was wrong."""
    results = earlier_results(output)

    def progress(text):
        click.echo(text, err=True)

    begin = time.monotonic()
    found = campaign(boards(board, progress), count=count, seed=seed, progress=progress)
    results[board] = {**found, "seed": seed, "seconds": round(time.monotonic() - begin, 1)}
    write_texts({output: json_text(results)})
    click.echo(json_text(results[board]))


if __name__ == "__main__":
    main()
