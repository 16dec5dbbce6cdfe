"""``dynrt cracks``: rays at the edges of real meshes, by the million, through the chip's model."""

import click
import numpy as np
from rich.console import Console
from rich.progress import MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn

from rtl.config import ChipConfig
from sim.scene import load_scene
from sim.stability.real import KINDS, Count, SceneEdges

from .errors import BadInput, clear_errors
from .options import FORMAT, docs_option, scenes_option
from .page import check_places, filled_page, markdown_table
from .results import code_version, earlier_results, json_text, write_texts

__all__ = ["MESHES", "cracks"]

#: By name, where they are in the folder of scenes.
MESHES = {
    "bunny": "classic/stanford-bunny.obj", "teapot": "classic/teapot.obj",
    "quake3-oa_dm5": "openarena/quake3-oa_dm5.pk3", "sarge": "openarena/players.pk3:sarge",
    "gargoyle": "openarena/players.pk3:gargoyle", "conference": "conference/conference.obj"}
_BATCH = 1 << 19
#: What an answer depends on.
_CODE = tuple(f"{folder}/**/*.py" for folder in (
    "fpu", "rtl", "sim/model", "sim/scene", "sim/stability", "sim/methods", "sim/golden"))


def _table(results):
    return markdown_table(
        ["mesh", "triangles", "shared edges", "rays at", "rays", "cracks", "phantoms", "distance", "odd"],
        [[row["mesh"], f"{row['triangles']:,}", f"{row['edges']:,}", row["kind"],
          *(f"{row[name]:,}" for name in ("rays", "cracks", "phantoms", "distances", "odd"))]
         for row in results.get("rows", [])])


PARTS = {"cracks": _table}


@click.command()
@scenes_option
@docs_option("Where accuracy.md is, and results/cracks.json goes")
@click.option("--only", type=click.Choice(list(MESHES)), multiple=True, metavar="MESH",
              help=f"Measure this mesh, keep the others: {', '.join(MESHES)}  [default: all]")
@click.option("--rays", type=click.IntRange(16), default=100_000_000, show_default=True,
              help="Rays in all, as many at each mesh and kind of place")
@click.option("--format", "fmt", type=FORMAT, default="7.16", show_default=True,
              help="Float format, EXPONENT.FRACTION")
def cracks(scenes, docs, only, rays, fmt):
    """Aim rays at edges, vertices and silhouettes of real meshes, and count those that slip through.

    The chip is the default one's model with its kd-tree, truth is float64. What has been measured with the same code is
    not measured again.
    """
    console = Console(stderr=True, highlight=False)
    page, path = docs / "accuracy.md", docs / "results" / "cracks.json"
    share = -(-rays // (len(MESHES) * len(KINDS)))
    version = code_version(*_CODE, what=(str(fmt), share))
    with clear_errors():
        # Before the long work
        check_places(page, PARTS)
        earlier = earlier_results(path)
        if only and earlier.get("format", str(fmt)) != str(fmt):
            raise BadInput(f"{path}: has results of format {earlier['format']}, which cannot stand beside those of "
                           f"{fmt}; leave out --only, or name another folder with --docs")
        known = {(row["mesh"], row["kind"]): row for row in earlier.get("rows", [])
                 if earlier.get("format") == str(fmt)}
        chosen = [name for name in MESHES if not only or name in only]
        with Progress(TextColumn("{task.description}"), *Progress.get_default_columns()[1:3], MofNCompleteColumn(),
                      TimeElapsedColumn(), console=console) as progress:
            task = progress.add_task("", total=len(chosen) * len(KINDS))
            for name in chosen:
                missing = [kind for kind in KINDS if known.get((name, kind), {}).get("version") != version]
                progress.update(task, description=name, advance=len(KINDS) - len(missing))
                edges = _edges(scenes / MESHES[name], fmt) if missing else None
                for kind in missing:
                    count = _count(edges, kind, share)
                    known[name, kind] = {"mesh": name, "triangles": edges.num_triangles, "edges": edges.num_edges,
                                         "kind": kind, **vars(count), "version": version}
                    rows = [known[place] for place in ((mesh, what) for mesh in MESHES for what in KINDS)
                            if place in known]
                    # Kept after each: this takes a while, and may be stopped.
                    path.parent.mkdir(exist_ok=True)
                    write_texts({path: json_text({"format": str(fmt), "edge_tolerance": ChipConfig().edge_tolerance,
                                                  "rows": rows})})
                    progress.advance(task)
        results = earlier_results(path)
        write_texts({page: filled_page(page, PARTS, results)})
    total = sum((Count(*(row[name] for name in Count.__dataclass_fields__)) for row in results["rows"]), Count())
    console.print(f"{total.rays:,} rays, {total.cracks:,} cracks, {total.phantoms:,} phantoms")


def _edges(path, fmt):
    try:
        return SceneEdges(load_scene(path), fmt=fmt)
    except ValueError as error:
        raise BadInput(f"{path}: {error}, so there is nothing to aim at; take a mesh whose triangles share "
                       "vertices") from error


def _count(edges, kind, share):
    """Batches until there are ``share`` rays; none if the mesh has nothing of the kind."""
    rng, total = np.random.default_rng([17, KINDS.index(kind)]), Count()
    while total.rays < share:
        some = edges.measure(kind, min(_BATCH, 2 * (share - total.rays) + 64), rng)
        if not some.rays:
            break
        total += some
    return total
