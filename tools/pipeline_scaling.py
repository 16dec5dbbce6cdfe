"""The same lit room drawn by chips of many sizes."""

from dataclasses import replace

from sim.machine import render_rtl
from sim.model import render_full
from sim.scene import load_scene

from .pipeline_demos import DEMO_CHIP, DEPTH, LATENCY, prepared

__all__ = ["SCALING_SIZE", "cache_rows", "scaling_rows"]

SCALING_SIZE = 96, 72
#: Threads, pipelines, shaders of each, and whether with shadows.
SCALING = (*((threads, 1, 2, True) for threads in (1, 4, 16, 32, 64)), *((64, count, 2, True) for count in (2, 3, 4)),
           *((64, 1, count, shadows) for count in (1, 2, 4) for shadows in (True, False)))
#: Lines of the shading and of the texture cache; two are as good as none.
CACHES = ((128, 256), (2, 256), (128, 2), (2, 2), (32, 64), (512, 1024))
_CACHES_DEMO, _CACHES_SIZE, _CACHES_LATENCY = "mirror-room", (128, 96), 20


def _lit(needs):
    return replace(DEMO_CHIP, shader=replace(needs, depth=0))


def scaling_rows(console):
    """Rows of chips with so many threads, pipelines and shaders."""
    scene = load_scene("room")
    camera = scene.default_camera()
    image = prepared(scene, camera)
    # A chip without shadows is not what the scene needs, but what it is asked for here.
    images = {shadows: replace(image, needs=replace(image.needs, shadows=shadows)) for shadows in (True, False)}
    models = {shadows: render_full(asked, camera, *SCALING_SIZE, config=_lit(asked.needs))
              for shadows, asked in images.items()}
    rows = []
    for threads, pipelines, shaders, shadows in dict.fromkeys(SCALING):
        asked, model = images[shadows], models[shadows]
        config = replace(_lit(asked.needs), num_threads=threads, num_pipelines=pipelines, num_shaders=shaders)
        drawn = render_rtl(asked, camera, *SCALING_SIZE, config=config, latency=LATENCY)
        kinds = model.report["ray_kinds"]
        rows.append({"threads": threads, "pipelines": pipelines, "shaders": shaders, "shadows": shadows,
                     "cycles": drawn.report["cycles"], "rays": sum(kinds.values()), "shadow_rays": kinds["shadow"],
                     "rtl_wrong_pixels": int((drawn.color != model.color).any(axis=-1).sum()),
                     "busy": {unit: round(part, 3) for unit, part in drawn.report["busy"].items()},
                     "port_busy": {memory: round(count / 4 / drawn.report["cycles"], 3)
                                   for memory, count in drawn.report["bytes"].items()}})
        console.print(f"{threads} threads, {pipelines} pipelines, {shaders} shaders"
                      f"{'' if shadows else ', primary rays alone'}: {drawn.report['cycles']:,} cycles",
                      highlight=False)
    return rows


def cache_rows(console):
    """Rows of chips with shading and texture caches of so many lines, on a demo with textures and mirrors."""
    scene = load_scene(_CACHES_DEMO)
    camera = scene.default_camera()
    image, rows = prepared(scene, camera), []
    for shading, texture in CACHES:
        config = replace(DEMO_CHIP, shader=replace(image.needs, depth=DEPTH), shading_lines=shading,
                         texture_lines=texture)
        report = render_rtl(image, camera, *_CACHES_SIZE, config=config, latency=_CACHES_LATENCY).report
        rows.append({"shading_lines": shading, "texture_lines": texture, "latency": _CACHES_LATENCY,
                     "cycles": report["cycles"],
                     **{f"{name}_hit_rate": round(report["cache"][name]["hits"]
                                                  / max(sum(report["cache"][name].values()), 1), 4)
                        for name in ("shading", "textures")},
                     **{f"{name}_bytes": report["bytes"][name] for name in ("shading", "textures")}})
        console.print(f"caches of {shading} and {texture} lines: {report['cycles']:,} cycles", highlight=False)
    return rows
