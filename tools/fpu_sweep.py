"""What is measured for the characterisation, and the running of it."""

import statistics
import threading
from collections import defaultdict
from concurrent.futures import ThreadPoolExecutor, as_completed
from contextlib import contextmanager
from dataclasses import dataclass

from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn, TimeRemainingColumn

from boards import ecp5
from fpu import FloatFormat, Rounding

from .fpu_error import measure_error
from .fpu_operators import OPERATORS, Entry

__all__ = ["DEFAULT_FORMAT", "FORMATS", "Point", "measure", "peer_points", "sweep"]

DEFAULT_FORMAT = FloatFormat(7, 16)
FORMATS = tuple(map(FloatFormat.parse, (
    "5.8", "5.10", "6.12", "7.14", "7.16", "7.20", "8.23")))
#: Latencies beyond the default that are measured too.
BEYOND = 2


@dataclass(frozen=True, kw_only=True)
class Point:
    """One operator to measure, on one speed grade."""

    entry: Entry
    fmt: FloatFormat
    latency: int
    rounding: Rounding = Rounding.NEAREST_EVEN
    grade: int = 6

    @property
    def is_default(self):
        """Whether this is what the operator's class builds when only told the format."""
        return self.rounding is Rounding.NEAREST_EVEN and self.latency == self.entry.default_latency(self.fmt)

    @property
    def title(self):
        """Name for messages."""
        return f"{self.entry.name} {self.fmt}, latency {self.latency}, {self.rounding.value}"

    def design(self):
        """What :func:`boards.ecp5.place` takes."""
        return ecp5.design_of(self.entry.build(self.fmt, latency=self.latency, rounding=self.rounding),
                              name=self.title)


def _latencies(default):
    """The first few, a handful between them and the default, and one beyond."""
    spacing = max(2, default // 8 * 2)
    return sorted({0, 1, *range(2, default, spacing), default, default + BEYOND})


def sweep(entry):
    """Points of an operator: latencies, grades, formats, roundings, each varied from the default alone."""
    default = entry.default_latency(DEFAULT_FORMAT)
    points = [Point(entry=entry, fmt=DEFAULT_FORMAT, latency=latency) for latency in _latencies(default)]
    points += [Point(entry=entry, fmt=DEFAULT_FORMAT, latency=latency, grade=8) for latency in (0, default)]
    for fmt in FORMATS:
        try:
            points.append(Point(entry=entry, fmt=fmt, latency=entry.default_latency(fmt)))
        except ValueError:
            # It cannot be had in this format.
            if fmt == DEFAULT_FORMAT:
                raise
    points += [Point(entry=entry, fmt=DEFAULT_FORMAT, latency=default, rounding=rounding)
               for rounding in entry.roundings]
    return list(dict.fromkeys(points))


def peer_points(peers):
    """Points of ours to be put beside peers."""
    points = []
    for peer in peers:
        entry = OPERATORS[peer.operator]
        latency = entry.default_latency(peer.format) if peer.beside_latency is None else peer.beside_latency
        points.append(Point(entry=entry, fmt=peer.format, latency=latency))
    return list(dict.fromkeys(points))


def measure(points, peers, *, seeds, jobs, console):
    """Rows of results of points and of peers.

    Parameters
    ----------
    points : list of Point
    peers : list of Peer
    seeds : list of int
        Of the placer.
    jobs : int
        Runs at a time.
    console : rich.console.Console
        For progress.

    Raises
    ------
    ToolError
        If a tool is missing or fails.
    """
    with _progress(console) as progress:
        subjects = [*((point.design(), point.grade) for point in progress.track(points, description="elaborating")),
                    *((peer.design(), 6) for peer in peers)]
        _place_all(subjects, seeds, jobs, progress, console)
        errors = {}
        keys = dict.fromkeys((point.entry.name, point.fmt, point.rounding) for point in points)
        for key in progress.track(keys, description="measuring errors"):
            name, fmt, rounding = key
            errors[key] = measure_error(OPERATORS[name], fmt, rounding=rounding)
    figures = [_figures([ecp5.place(design, grade=grade, seed=seed) for seed in seeds]) for design, grade in subjects]
    return ([_row(point, found, errors[point.entry.name, point.fmt, point.rounding])
             for point, found in zip(points, figures, strict=False)],
            [_peer_row(peer, found) for peer, found in zip(peers, figures[len(points):], strict=True)])


@contextmanager
def _progress(console):
    with Progress(TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn(), TimeElapsedColumn(),
                  TimeRemainingColumn(), console=console, disable=not console.is_terminal,
                  speed_estimate_period=600) as progress:
        yield progress


def _place_all(subjects, seeds, jobs, progress, console):
    """Make all results known; runs of one design are one after another, so that it is synthesised once."""
    missing = defaultdict(list)
    designs = {}
    for design, grade in subjects:
        for seed in seeds:
            if not ecp5.is_placed(design, grade=grade, seed=seed):
                designs[design.folder] = design
                missing[design.folder].append((grade, seed))
    total = sum(map(len, missing.values()))
    task = progress.add_task("place and route", total=total)
    stopped = threading.Event()
    done = 0

    def run(folder):
        for grade, seed in missing[folder]:
            if stopped.is_set():
                break
            ecp5.place(designs[folder], grade=grade, seed=seed)
            progress.advance(task)
        return folder

    with ThreadPoolExecutor(jobs) as pool:
        futures = [pool.submit(run, folder) for folder in missing]
        try:
            for future in as_completed(futures):
                done += len(missing[future.result()])
                if not console.is_terminal:
                    console.print(f"{done} of {total} runs: {designs[future.result()].name}", markup=False,
                                  soft_wrap=True)
        except BaseException:
            stopped.set()
            raise


def _figures(placements):
    first, clocks = placements[0], [placement.fmax_mhz for placement in placements]
    return {"lut": first.lut, "ff": first.ff, "dsp": first.dsp, "ebr": first.ebr,
            "fmax_median_mhz": round(statistics.median(clocks), 1), "fmax_worst_mhz": round(min(clocks), 1)}


def _row(point, figures, error):
    return {"operator": point.entry.name, "format": str(point.fmt), "grade": point.grade, "latency": point.latency,
            "default": point.is_default, "rounding": point.rounding.value, **figures,
            "max_ulp": error and round(error.max, 4), "mean_ulp": error and round(error.mean, 4),
            "error_samples": error and error.samples}


def _peer_row(peer, figures):
    return {"name": peer.name, "source": peer.source, "operator": peer.operator, "format": str(peer.format),
            "grade": 6, "latency": peer.latency, "retimed": peer.retime, "cycles_per_result": peer.cycles_per_result,
            **figures, "note": peer.note}
