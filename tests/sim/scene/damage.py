"""Damaged files of every format through their readers.

    python -m tests.sim.scene.damage --count 10000 --output docs/results/damage.json
"""

import random
import resource
import signal
import tempfile
import threading
import time
import warnings
from contextlib import contextmanager
from pathlib import Path

import click
import numpy as np

from sim.golden.tables import lamps, looks, surfaces
from sim.scene import SceneError, load_scene
from tools.results import earlier_results, json_text, write_texts

from .damage_files import FILES
from .damage_quake import QUAKE

__all__ = ["FORMATS", "shading_tables", "try_damage"]

#: Of each kind of damage: the scene to load, the damaged file, a function from a random generator to its bytes, and
#: what lies beside it.
FORMATS = FILES | {kind: (*form, {}) for kind, form in QUAKE.items()}
#: Seconds within which a file has to be read or refused, and after which it hangs.
_SLOW, _HANGS = 5, 60
# Bytes of address space within which all has to be read, the libraries' own among them.
_MEMORY = 3 << 30


def shading_tables(scene):
    """What the shader reads has numbers only."""
    for table in (looks(scene.materials), surfaces(scene), lamps(scene.lights)):
        for values in table:
            assert not np.isnan(values).any()


@contextmanager
def _alarm():
    """Ends what hangs, where a signal can."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return

    def hangs(*_):
        raise AssertionError(f"not read after {_HANGS} s")

    before = signal.signal(signal.SIGALRM, hangs)
    signal.alarm(_HANGS)
    try:
        yield
    finally:
        signal.alarm(0)
        signal.signal(signal.SIGALRM, before)


def try_damage(kind, count, folder):
    """``(read, refused, seconds of the slowest)`` of ``count`` damaged files of a kind.

    A failure is repeated by its number, which alone seeds it.

    Raises
    ------
    AssertionError
        If one is neither read nor refused by a message that names it, or takes longer than five seconds.
    """
    scene_name, file, make, beside = FORMATS[kind]
    for name, data in beside.items():
        (folder / name).write_bytes(data)
    num_read = num_refused = slowest = 0
    for number in range(count):
        (folder / file).write_bytes(make(random.Random(f"{kind} {number}")))
        begin, is_loaded = time.perf_counter(), False
        try:
            with _alarm():
                scene = load_scene(f"{folder}/{scene_name}")
                is_loaded = True
                scene.default_camera()
                shading_tables(scene)
                # Its motion may lead where nothing can be drawn.
                scene.at_time(0.5)
            num_read += 1
        except SceneError as error:
            if not is_loaded and not str(error).startswith(f"{folder}/{scene_name.split(':')[0]}"):
                raise AssertionError(f"{kind} {number}: the file is not named: {error}") from error
            num_refused += 1
        except Exception as error:
            raise AssertionError(f"{kind} {number}: {type(error).__name__}: {error}") from error
        seconds = time.perf_counter() - begin
        if seconds > _SLOW:
            raise AssertionError(f"{kind} {number}: took {seconds:.1f} s")
        slowest = max(slowest, seconds)
    return num_read, num_refused, slowest


@click.command()
@click.option("--count", type=click.IntRange(min=1), default=10_000, show_default=True, help="Files of each kind")
@click.option("--only", multiple=True, type=click.Choice(list(FORMATS)), help="Only this kind")
@click.option("--output", type=click.Path(dir_okay=False, path_type=Path),
              help="Where the figures go, beside those of other kinds that are there")
def main(count, only, output):
    """Read damaged files of each kind, and say how many were read, refused, and how long the slowest took."""
    warnings.simplefilter("ignore", RuntimeWarning)
    resource.setrlimit(resource.RLIMIT_AS, (_MEMORY, _MEMORY))
    with tempfile.TemporaryDirectory() as folder:
        for kind in only or FORMATS:
            num_read, num_refused, slowest = try_damage(kind, count, Path(folder))
            click.echo(f"{kind}: {num_read} read, {num_refused} refused, the slowest {slowest:.2f} s")
            if output is not None:
                kinds = earlier_results(output).get("kinds", {})
                kinds[kind] = {"files": count, "read": num_read, "refused": num_refused,
                               "slowest_seconds": round(slowest, 2)}
                write_texts({output: json_text({"memory_bytes": _MEMORY, "kinds": kinds})})


if __name__ == "__main__":
    main()
