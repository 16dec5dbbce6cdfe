"""Embree on one core, given the rays that the chip has."""

import re
import time
from pathlib import Path

import numba
import numpy as np

from .errors import BadInput

__all__ = ["core_clock", "embree_row", "embree_scene", "embree_version", "peak_flops_per_cycle"]

#: Embree as it is driven here has no instances: more triangles than this do not go into the memory of a small machine.
MAX_TRIANGLES = 12_000_000
_REPEATS = 5
#: Single precision operations a cycle of one core: two units that multiply and add, of so many lanes.
_LANES = {"avx512f": 16, "fma": 8}
_SSE_FLOPS = 8
# Of the dependent multiplication and addition that the clock is measured by.
_CHAIN_CYCLES, _CHAIN_LENGTH = 4, 50_000_000


def _embreex():
    try:
        import embreex.mesh_construction
        import embreex.rtcore_scene
    except ImportError as error:
        raise BadInput("embreex, the software that is compared with, is not installed; run make setup, or pip install "
                       "'dynrt[bench]', or leave it out: dynrt bench --part simple --part textured --part sweeps "
                       "--part area") from error
    return embreex


def embree_version():
    """Version of the package that has Embree."""
    import importlib.metadata

    _embreex()
    return importlib.metadata.version("embreex")


def embree_scene(scene, *, eye=None, max_triangles=None):
    """Embree's scene with every instance's triangles in the world, and their number.

    Parameters
    ----------
    scene : Scene
    eye : array_like of 3 floats, optional
        The instances nearest to it go first, if not all triangles can be there.
    max_triangles : int, optional
        Whole instances are left out beyond that.

    Raises
    ------
    BadInput
        If there is no embreex.
    """
    embreex = _embreex()
    embree, order, number = embreex.rtcore_scene.EmbreeScene(), list(scene.instances), 0
    if eye is not None:
        order.sort(key=lambda placed: np.linalg.norm(placed.transform[:, 3] - eye))
    for placed in order:
        mesh = scene.meshes[placed.mesh]
        triangles = mesh.triangles[mesh.usable]
        if not len(triangles) or (max_triangles is not None and number + len(triangles) > max_triangles):
            continue
        world = placed.to_world(mesh.vertices[triangles])
        embreex.mesh_construction.TriangleMesh(embree, world.astype(np.float32))
        number += len(triangles)
    return embree, number


def embree_row(scene, camera, size):
    """How fast Embree is on a picture's primary rays, each alone, on one core: the best of five runs, in its own time.

    Returns
    -------
    dict
        ``embree_mrays`` in 10⁶ rays a second, ``embree_triangles``, ``embree_hits`` as a part of the rays, and
        ``embree_build_seconds``.
    """
    whole = sum(scene.meshes[placed.mesh].num_triangles for placed in scene.instances) <= MAX_TRIANGLES
    begin = time.perf_counter()
    embree, number = embree_scene(scene, eye=None if whole else camera.eye, max_triangles=MAX_TRIANGLES)
    origin, directions = camera.rays(*size)
    directions = np.ascontiguousarray(directions.reshape(-1, 3), np.float32)
    origins = np.ascontiguousarray(np.broadcast_to(origin, directions.shape), np.float32)
    # The first query also builds the hierarchy.
    found = embree.run(origins[:1], directions[:1], output=1)
    built, seconds = time.perf_counter() - begin, []
    for _ in range(_REPEATS):
        begin = time.thread_time()
        found = embree.run(origins, directions, output=1)
        seconds.append(time.thread_time() - begin)
    return {"embree_mrays": len(directions) / min(seconds) / 1e6, "embree_triangles": number,
            "embree_hits": float((found["primID"] >= 0).mean()), "embree_build_seconds": built}


@numba.njit
def _chain(length, factor, value):
    for _ in range(length):
        value = value * factor + factor
    return value


def core_clock():
    """Clock of a core that is at work, in MHz: from the time of a chain of 64-bit multiplications and additions, of
    which each waits for the one before, 3 + 1 cycles on the x86-64 cores of the last ten years."""
    factor = np.uint64(6364136223846793005)
    _chain(1, factor, factor)
    best = float("inf")
    for _ in range(_REPEATS):
        begin = time.thread_time()
        _chain(_CHAIN_LENGTH, factor, factor)
        best = min(best, time.thread_time() - begin)
    return _CHAIN_CYCLES * _CHAIN_LENGTH / best / 1e6


def peak_flops_per_cycle(cpuinfo=Path("/proc/cpuinfo")):
    """Most single precision operations a cycle of a core, assumed from what the CPU says it can: ``(number, why)``."""
    flags = re.search(r"^flags\s*: (.*)$", cpuinfo.read_text() if cpuinfo.exists() else "", re.MULTILINE)
    known = set(flags[1].split()) if flags else set()
    for name, lanes in _LANES.items():
        if name in known:
            return 4 * lanes, f"two units of {lanes} lanes that multiply and add ({name})"
    return _SSE_FLOPS, "an adder and a multiplier of four lanes (SSE)"
