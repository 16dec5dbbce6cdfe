"""The golden picture: golden hits, shaded in float64."""

import numpy as np

from ..frame import Frame
from .tracer import render

__all__ = ["render_golden"]


def _srgb(linear):
    linear = np.clip(linear, 0.0, 1.0)
    return np.where(linear <= 0.0031308, 12.92 * linear, 1.055 * linear ** (1 / 2.4) - 0.055)


def render_golden(scene, camera, width, height, *, background=(0, 0, 0)):
    """What the chip is to draw: each surface's colour times |D·N|, at most 1.

    D is the camera's ray through the pixel, not normalised, N the unit normal of the triangle in the world.

    Returns
    -------
    Frame
    """
    _, directions = camera.rays(width, height)
    hits = render(scene, camera, width, height)
    frame = Frame.empty(width, height, background)
    frame.instance_id, frame.prim_id = hits.instance_id, hits.prim_id
    frame.t, frame.u, frame.v = hits.t, hits.u, hits.v
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
    return frame
