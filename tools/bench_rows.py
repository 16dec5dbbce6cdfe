"""Rows as they are published: what was measured, beside the paper and beside Embree."""

from dataclasses import asdict

from sim.scene.table3 import PAPER_MHZ, SIZE, TABLE3

from .costs import COLUMNS, cost_tables

__all__ = ["efficiency_rows", "operators_of_pipeline", "published"]


def operators_of_pipeline():
    """Floating-point operators of a pipeline, each of which begins an operation a clock."""
    total = next(row for row in cost_tables()["table2"] if row["unit"] == "total")
    return sum(total[column] for column in COLUMNS)


def published(row, *, clock, embree):
    """A measured row with what follows from it.

    Parameters
    ----------
    row : dict
        See :func:`~tools.bench_measure.measure`.
    clock : (float, str)
        See :func:`~tools.bench_clock.built_clock`.
    embree : dict
        What :func:`~tools.bench_embree.embree_row` says, by scene.
    """
    paper, (mhz, source) = TABLE3[row["scene"]].paper, clock
    rays = row["size"][0] * row["size"][1]
    paper_fps = paper.fps_at(row["size"])
    paper_cycles = paper_fps and 1e6 * PAPER_MHZ / (paper_fps * rays)
    return {
        **row, "clock_mhz": mhz, "clock_source": source, "fps": 1e6 * mhz / row["cycles"],
        "fps_at_paper_clock": 1e6 * PAPER_MHZ / row["cycles"], "paper_fps": paper_fps,
        "paper_cycles_per_ray": paper_cycles,
        "cycles_ratio": paper_cycles and row["cycles_per_ray"] / paper_cycles,
        "mb_per_s": {name: number * mhz / row["cycles_per_ray"]
                     for name, number in row["bytes_per_ray_by_port"].items()},
        "paper": asdict(paper), "embree_mrays": embree.get(row["scene"], {}).get("embree_mrays")}


def efficiency_rows(rows, *, embree, cpu, operators):
    """What ours and Embree make of a clock and of an operation, for each row of the paper's chip at 512×384.

    Parameters
    ----------
    rows : list of dict
        Published.
    embree : dict
        By scene.
    cpu : dict
        ``clock_mhz`` and ``flops_per_cycle`` of a core.
    operators : int
        Of a pipeline.
    """
    found = []
    for row in rows:
        if (row["chip"], row["shading"], tuple(row["size"])) != ("paper", "simple", SIZE) or row["scene"] not in embree:
            continue
        theirs = embree[row["scene"]]
        ours, peer = 1 / row["cycles_per_ray"], theirs["embree_mrays"] / cpu["clock_mhz"]
        ours_per_flop, peer_per_flop = ours / (operators * row["pipelines"]), peer / cpu["flops_per_cycle"]
        found.append({
            "scene": row["scene"], "mrays": row["clock_mhz"] * ours, "mrays_at_paper_clock": PAPER_MHZ * ours,
            "embree_mrays": theirs["embree_mrays"], "embree_triangles": theirs["embree_triangles"],
            "rays_per_clock": ours, "embree_rays_per_clock": peer, "clocks_ratio": ours / peer,
            "rays_per_flop": ours_per_flop, "embree_rays_per_flop": peer_per_flop,
            "flops_ratio": ours_per_flop / peer_per_flop})
    return found
