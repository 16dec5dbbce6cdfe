"""Chips of many sizes on the scenes of the paper's tables."""

from dataclasses import replace

from .bench_chips import CHIPS
from .bench_measure import BenchJob

__all__ = ["CACHES", "PIPELINES", "SWEEP_SIZE", "THREADS", "sweep_jobs", "sweep_order"]

SWEEP_SIZE = 256, 192
THREADS = 1, 4, 16, 32, 64
PIPELINES = 1, 2, 3, 4
#: All three caches times so many lines, by a memory of so many cycles.
CACHES = tuple((2.0**log2, latency) for log2 in (-2, 0, 2, 4) for latency in (4, 20))
_SCENES = {"threads": ("Conference",), "pipelines": ("Conference",), "caches": ("Quake3", "Conference")}


def _chips():
    """``(sweep, name, config, latency)`` of each."""
    paper = CHIPS["paper"]
    for threads in THREADS:
        yield "threads", f"{threads} threads", replace(paper.config, num_threads=threads), paper.latency
    for pipelines in PIPELINES:
        yield "pipelines", f"{pipelines} pipelines", replace(paper.config, num_pipelines=pipelines), paper.latency
    for factor, latency in CACHES:
        lines = {name: int(factor * getattr(paper.config, name))
                 for name in ("node_lines", "list_lines", "matrix_lines")}
        yield "caches", f"caches ×{factor:g}, latency {latency}", replace(paper.config, **lines), latency


def sweep_order(row):
    """Where a row of a sweep stands; of a chip that there is no more, at the end."""
    names = [name for _, name, _, _ in _chips()]
    number = names.index(row["chip"]) if row["chip"] in names else len(names)
    return list(_SCENES).index(row["sweep"]) if row["sweep"] in _SCENES else len(_SCENES), row["scene"], number


def sweep_jobs(folder, *, only, earlier):
    """BenchJobs of the sweeps, each with the name of its sweep; rows of ``earlier`` by their keys."""
    jobs = []
    for sweep, name, config, latency in _chips():
        for scene in _SCENES[sweep]:
            if not only or scene in only:
                job = BenchJob(scene=scene, folder=folder, chip=name, config=config, latency=latency, size=SWEEP_SIZE)
                jobs.append((sweep, replace(job, earlier=earlier.get(job.key))))
    # A scene is read once for all chips.
    return sorted(jobs, key=lambda found: found[1].scene)
