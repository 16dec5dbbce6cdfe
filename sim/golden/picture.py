"""The golden picture: golden hits, shaded in float64."""

import numpy as np

from ..frame import Frame
from .full import shade_full
from .tracer import render

__all__ = ["SHADINGS", "render_golden"]

#: What a picture can be shaded by: the chip's first shader, or all of docs/shading.md.
SHADINGS = ("simple", "full")


def _srgb(linear):
    linear = np.clip(linear, 0.0, 1.0)
    return np.where(linear <= 0.0031308, 12.92 * linear, 1.055 * linear ** (1 / 2.4) - 0.055)


def render_golden(scene, camera, width, height, *, background=(0, 0, 0), shading="simple", depth=4,
                  shift=(0.0, 0.0)):
    """What the chip is to draw.

    Simple shading is each surface's colour times |D·N|, at most 1, with D the camera's ray through the pixel, not
    normalised, and N the unit normal of the triangle in the world. Full shading follows docs/shading.md.

    Parameters
    ----------
    scene : Scene
    camera : Camera
    width, height : int
        Size of the picture, in pixels.
    background : tuple of int
        Colour where nothing is hit; full shading prefers the scene's sky.
    shading : str
        ``simple`` or ``full``.
    depth : int
        Of full shading: generations of secondary rays.
    shift : (float, float)
        Right and down, in pixels: where the rays go through instead of the pixels' centres.

    Returns
    -------
    Frame
        Its hits are those of primary rays, holes of textures included. That of full shading reports ``rays``, their
        number, and ``levels``, what became of each generation.
    """
    if shading not in SHADINGS:
        raise ValueError(f"shading is '{shading}'; it must be {' or '.join(SHADINGS)}")
    hits = render(scene, camera, width, height, shift=shift)
    frame = Frame.empty(width, height, background)
    frame.instance_id, frame.prim_id = hits.instance_id, hits.prim_id
    frame.t, frame.u, frame.v = hits.t, hits.u, hits.v
    origin, directions = camera.rays(width, height, shift=shift)
    if shading == "full":
        colors, levels = shade_full(scene, origin, directions, depth=depth, background=background)
        frame.color[:] = np.rint(255 * _srgb(colors))
        frame.report["rays"] = sum(level["rays"] + level["shadow"] for level in levels)
        frame.report["levels"] = levels
    else:
        _shade_simply(frame, scene, hits, directions)
    return frame


def _shade_simply(frame, scene, hits, directions):
    for number in np.unique(hits.instance_id[hits.is_hit]):
        placed = scene.instances[number]
        mesh = scene.meshes[placed.mesh]
        here = hits.instance_id == number
        corners = mesh.vertices[mesh.triangles[hits.prim_id[here]]] @ placed.transform[:, :3].T
        normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        normal /= np.linalg.norm(normal, axis=1, keepdims=True)
        cosine = np.minimum(np.abs((directions[here] * normal).sum(axis=1)), 1.0)
        colors = np.array([scene.materials[k].base_color for k in mesh.material_ids[hits.prim_id[here]]])
        frame.color[here] = np.floor(np.rint(255 * _srgb(colors)) * cosine[:, None])
