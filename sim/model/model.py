"""A frame by the model: every packet, over all cores."""

import numba
import numpy as np

from rtl.ray_generation import packet_order
from rtl.write_out import INTENSITY_BITS

from ..frame import Frame
from ..scene.image import SceneImage
from .compiled import compiled
from .packet import COUNTS, VECTORS, trace_packet, transform

__all__ = ["camera_rows", "render_model"]


def camera_rows(image, camera, width):
    """float64[4, 3] in the image's format: the rows of the camera's map, and its origin.

    Directions are rows · (x, y, 1) with x and y in half pixels, to which the field of view is scaled here.
    """
    right, up, forward = camera.basis()
    half_pixel = np.tan(np.radians(camera.hfov_deg) / 2) / width
    columns = np.stack([right * half_pixel, up * half_pixel, forward], axis=1) * image.scale
    return image.fmt.quantize(np.concatenate([columns, [(camera.eye - image.center) * image.scale]]))


@compiled(parallel=True)
def _render(arithmetic, params, root, nodes, splits, lists, matrices, mailbox_entries, stack_depth, tolerance,
            camera, packets, x, y, width, height, hits, owners, counts, whole):
    for number in numba.prange(len(packets)):
        px, py = packets[number]
        matrix = np.zeros((4, 3))
        matrix[:3] = camera[:3]
        origins, directions, screen = np.empty((4, 3)), np.empty((4, 3)), np.ones(3)
        limits, excluded, flags = np.zeros((4, 2)), np.full((4, 2), -1, np.int64), np.zeros(4, np.int64)
        packet_hits = np.empty((4, 4))
        packet_owners = np.empty((4, 2), np.int64)
        mask = 0
        for ray in range(4):
            column, row = px + (ray & 1), py + (ray >> 1)
            if column < width and row < height:
                mask |= 1 << ray
                screen[0], screen[1] = x[column], y[row]
                origins[ray] = camera[3]
                directions[ray] = transform(arithmetic, params, matrix, screen, False)
                counts[number, VECTORS] += 1
        counts[number, VECTORS] += 1
        whole[number] = trace_packet(arithmetic, params, root, nodes, splits, lists, matrices, mailbox_entries,
                                     stack_depth, tolerance, origins, directions, mask, limits, excluded, flags,
                                     True, packet_hits, packet_owners, counts[number])
        for ray in range(4):
            if mask >> ray & 1:
                hits[py + (ray >> 1), px + (ray & 1)] = packet_hits[ray]
                owners[py + (ray >> 1), px + (ray & 1)] = packet_owners[ray]


def render_model(image: SceneImage, camera, width, height, *, config, background=(0, 0, 0)):
    """What the chip draws, bit for bit.

    Parameters
    ----------
    image : SceneImage
        The scene; its format is the chip's.
    camera : Camera
        The view.
    width, height : int
        Size of the picture in pixels.
    config : ChipConfig
        The chip, of which mailbox, stack, arithmetic and tolerance matter.
    background : tuple of int
        Colour of rays that hit nothing.

    Returns
    -------
    Frame
        Its report has the ``counts`` of :data:`~sim.model.packet.COUNTS`.

    Raises
    ------
    OverflowError
        If a packet needs more than the chip's traversal stack.
    """
    fmt = image.fmt
    packets = np.array(list(packet_order(width, height)), np.int64)
    # Exact wherever the format has bits enough for screen coordinates; else rounded as the chip's converter does.
    x = fmt.quantize(2.0 * np.arange(width) + 1 - width)
    y = fmt.quantize(height - 1 - 2.0 * np.arange(height))
    hits = np.zeros((height, width, 4))
    owners = np.empty((height, width, 2), np.int64)
    counts = np.zeros((len(packets), len(COUNTS)), np.int64)
    whole = np.zeros(len(packets), np.bool_)
    _render(config.arithmetic, fmt.params, image.root, image.nodes[:, 0].astype(np.int64), image.split_values(),
            image.lists.astype(np.int64), image.matrix_values(), config.mailbox_entries, config.stack_depth,
            config.edge_tolerance * 2.0**-fmt.frac_width, camera_rows(image, camera, width), packets, x, y, width,
            height, hits, owners, counts, whole)
    if not whole.all():
        x, y = packets[np.flatnonzero(~whole)[0]]
        raise OverflowError(f"the packet at pixel ({x}, {y}) needs more than the {config.stack_depth} stack entries "
                            "of the chip")
    frame = shade(image, hits, owners, background)
    sums = counts.sum(axis=0)
    sums[-1] = counts[:, -1].max(initial=0)
    frame.report["counts"] = dict(zip(COUNTS, sums.tolist(), strict=True))
    return frame


def shade(image, hits, owners, background):
    """The frame of raw hits: t, u, v, D′z and the numbers of triangle and instance on the chip."""
    height, width = owners.shape[:2]
    frame = Frame.empty(width, height, background)
    is_hit = owners[..., 0] >= 0
    triangle, instance = owners[is_hit].T
    frame.instance_id[is_hit], frame.prim_id[is_hit] = image.owners(triangle, instance)
    frame.t[is_hit], u, v, cosine = hits[is_hit].T
    frame.u[is_hit], frame.v[is_hit] = image.weights(triangle, u, v)
    one = 1 << INTENSITY_BITS
    intensity = np.minimum(np.abs(cosine) * one, one).astype(np.uint32)
    words = image.shading[triangle]
    for channel, shift in enumerate((16, 8, 0)):
        frame.color[is_hit, channel] = (words >> shift & 255) * intensity >> INTENSITY_BITS
    return frame
