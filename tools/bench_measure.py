"""One picture of the paper's tables, drawn by the simulated chip and counted by its model."""

import fcntl
import hashlib
import io
import threading
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np
from PIL import Image

from sim.cache import cache_directory
from sim.golden import psnr, render_golden
from sim.machine import chip_library, render_rtl
from sim.model import render_full, render_model
from sim.scene import Light
from sim.scene.compile import CompiledScene
from sim.scene.table3 import TABLE3

from .bench_chips import SHADINGS, chip_digest

__all__ = ["BenchJob", "measure", "plainly_lit"]

_DARK = Light("directional", color=(0.0, 0.0, 0.0), direction=(0.0, 0.0, -1.0))


@dataclass(frozen=True, kw_only=True)
class BenchJob:
    """A picture to measure; what it needs to be done on any machine that has the same scenes.

    Parameters
    ----------
    scene : str
        Of :data:`~sim.scene.table3.TABLE3`.
    folder : str or None
        Of scenes.
    chip : str
        Its name in the row.
    config : ChipConfig
        Without what its shading adds.
    latency : int
        Of its memories, in cycles.
    size : (int, int)
        In pixels.
    shading : str
        Of :data:`~tools.bench_chips.SHADINGS`.
    earlier : dict or None
        The row of an earlier run, which is returned if chip and memory's content are still the same.
    """

    scene: str
    folder: str | None
    chip: str
    config: object
    latency: int
    size: tuple
    shading: str = "simple"
    earlier: dict | None = None

    @property
    def key(self):
        """Which row it makes."""
        return self.scene, self.chip, tuple(self.size), self.shading


def plainly_lit(scene):
    """The scene as the paper's Table 3 shades: textures and no more, everything opaque and equally bright."""
    materials = [replace(material, alpha_mode="opaque", reflection=0.0, transmission=0.0, specular=0.0, fresnel=False,
                         emission=(0.0, 0.0, 0.0)) for material in scene.materials]
    meshes = [replace(mesh, normals=None) for mesh in scene.meshes]
    return replace(scene, meshes=meshes, materials=materials, lights=[_DARK], ambient=(1.0, 1.0, 1.0), sky=None)


class _Prepared:
    """A scene ready to be measured, and golden's pictures of it."""

    def __init__(self, scene, folder, shading, fmt, stack_depth):
        self.loaded, self._shading, self._golden = TABLE3[scene].load(folder), shading, {}
        if shading == "textured":
            self.loaded = replace(self.loaded, scene=plainly_lit(self.loaded.scene))
        self.compiled = CompiledScene(self.loaded.scene, fmt=fmt, stack_depth=stack_depth)
        self.image = self.compiled.image(self.loaded.scene, eye=self.loaded.camera.eye, is_full=shading == "textured")

    def golden(self, size):
        if size not in self._golden:
            self._golden[size] = render_golden(self.loaded.scene, self.loaded.camera, *size, depth=0,
                                               shading="full" if self._shading == "textured" else "simple")
        return self._golden[size]


# Some take gigabytes.
_prepared = lru_cache(maxsize=1)(_Prepared)
# A worker of a cluster may have several threads; the model uses all cores by itself.
_one_at_a_time = threading.Lock()


def _digest(job, config, camera, image):
    """Of all that the chip's figures depend on."""
    content = hashlib.sha256(repr((chip_digest(config, latency=job.latency), job.size, image.root,
                                   [np.asarray(part).tolist() for part in vars(camera).values()
                                    if not isinstance(part, str)])).encode())
    for name in ("nodes", "lists", "matrices", "shading", "records", "texels"):
        memory = getattr(image, name)
        content.update(b"" if memory is None else np.ascontiguousarray(memory))
    return content.hexdigest()[:16]


def _compile_once(config):
    """Compiles the chip, unless another process on this machine does; then waits for it."""
    folder = cache_directory()
    folder.mkdir(parents=True, exist_ok=True)
    with open(folder / "bench.lock", "w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        chip_library(config)


def _part(count):
    return count["hits"] / max(count["hits"] + count["misses"], 1)


def measure(job):
    """Measure a picture.

    Returns
    -------
    row : dict
        All that is measured, which is the same on every machine, and ``simulated_hz``.
    picture : bytes or None
        PNG; None if the earlier row still stands.

    Raises
    ------
    SceneError, OverflowError, BuildError, SimulationError
        See :mod:`sim.scene`, :mod:`sim.model` and :mod:`sim.machine`.
    """
    with _one_at_a_time:
        return _measure(job)


def _measure(job):
    config = SHADINGS[job.shading](job.config)
    ready = _prepared(job.scene, job.folder, job.shading, config.fmt, config.stack_depth)
    image, camera = ready.image, ready.loaded.camera
    digest = _digest(job, config, camera, image)
    if job.earlier and job.earlier.get("digest") == digest:
        return job.earlier, None
    if config.shader is not None:
        # Neither normals of instances nor shadows are seen where all is equally bright.
        image = replace(image, needs=config.shader)
    _compile_once(config)
    frame = render_rtl(image, camera, *job.size, config=config, latency=job.latency)
    render = render_model if config.shader is None else render_full
    model = render(image, camera, *job.size, config=config)
    wrong = frame.differs(model) if config.shader is None else (frame.color != model.color).any(axis=-1)
    return _row(job, config, ready, digest, frame, model, int(wrong.sum())), _png(frame.color)


def _row(job, config, ready, digest, frame, model, wrong):
    loaded, golden, report, counts, rays = (
        ready.loaded, ready.golden(job.size), frame.report, model.report["counts"], job.size[0] * job.size[1])
    per_port = {name: number / rays for name, number in report["bytes"].items()}
    return {
        "scene": job.scene, "real": loaded.is_real, "triangles": loaded.scene.num_triangles,
        "objects": len(loaded.scene.instances), "chip": job.chip, "shading": job.shading, "size": list(job.size),
        "threads": config.num_threads, "pipelines": config.num_pipelines, "latency": job.latency,
        "flattened": ready.compiled.is_flat, "cycles": report["cycles"], "cycles_per_ray": report["cycles_per_ray"],
        "busy": report["busy"], "hit": {name: _part(count) for name, count in report["cache"].items()},
        "bytes_per_ray": sum(per_port.values()), "bytes_per_ray_by_port": per_port,
        "steps_per_ray": counts["steps"] / rays, "leaves_per_ray": counts["leaves"] / rays,
        "entries_per_ray": counts["entries"] / rays, "instances_per_ray": counts["instances"] / rays,
        "transformations_per_ray": (counts["transformed_vectors"] + counts.get("shader_vectors", 0)) / rays,
        "instructions_per_ray": counts.get("instructions", 0) / rays,
        "tests_per_ray": counts["triangle_tests"] / rays, "stack_entries": counts["stack_depth"],
        "wrong_pixels_vs_model": wrong, "wrong_pixels_vs_golden": int(model.differs_in_surface(golden).sum()),
        "psnr_vs_golden": psnr(frame.color, golden.color), "simulated_hz": report["simulated_hz"], "digest": digest}


def _png(color):
    file = io.BytesIO()
    Image.fromarray(color).save(file, "PNG", optimize=True)
    return file.getvalue()
