"""How much work a ray is in each view of the scenes of the paper's tables, by the model."""

from sim.model import render_model
from sim.scene.compile import CompiledScene
from sim.scene.table3 import TABLE3

from .bench_chips import CHIPS

__all__ = ["VIEW_SIZE", "view_rows"]

VIEW_SIZE = 256, 192
_COUNTS = {"steps": "steps", "leaves": "leaves", "entries": "entries", "transformations": "transformed_vectors",
           "tests": "triangle_tests", "instances": "instances"}


def _rows(name, loaded):
    config, pixels = CHIPS["paper"].config, VIEW_SIZE[0] * VIEW_SIZE[1]
    compiled = CompiledScene(loaded.scene, fmt=config.fmt, stack_depth=config.stack_depth)
    for view, camera in enumerate(loaded.cameras):
        image = compiled.image(loaded.scene, eye=camera.eye)
        counts = render_model(image, camera, *VIEW_SIZE, config=config).report["counts"]
        yield {"scene": name, "real": loaded.is_real, "view": view,
               **{f"{what}_per_ray": counts[count] / pixels for what, count in _COUNTS.items()}}


def view_rows(folder, *, only, earlier, console):
    """Rows of all views, those of scenes not ``only`` as before.

    Raises
    ------
    SceneError
        If a scene is broken.
    """
    rows = [row for row in earlier if row["scene"] in TABLE3 and only and row["scene"] not in only]
    for name in only or TABLE3:
        loaded = TABLE3[name].load(folder)
        rows += _rows(name, loaded)
        console.print(f"{name}: {len(loaded.cameras)} views", highlight=False)
    return sorted(rows, key=lambda row: (list(TABLE3).index(row["scene"]), row["view"]))
