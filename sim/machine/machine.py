"""A picture by the simulated chip."""

import time

import numpy as np

from rtl.memory_ports import cache_names, memory_ports
from rtl.ray_generation import packet_order
from rtl.write_out import pixel_layout

from ..frame import Frame
from ..model.model import camera_rows
from ..scene.triangles import pack_fields
from .bench import Bench

__all__ = ["camera_words", "decode_pixels", "draw_frame", "load_image", "memory_words", "render_rtl", "report_of"]

_UNITS = ("traversal", "list", "transformation", "intersection", "shader")


def camera_words(image, camera, width):
    """The chip's camera registers, as 32-bit words."""
    rows = camera_rows(image, camera, width)
    origin_first = np.concatenate([rows[3:], rows[:3]])
    return pack_fields(image.fmt.encode(origin_first).reshape(1, -1), image.fmt.width)[0]


#: Where the memories of full shading lie in an image, by the chip's names.
_FULL = {"shading": "records", "textures": "texels"}


def memory_words(image, name, config):
    """What a chip finds in its memory ``name``."""
    return getattr(image, name if config.shader is None else _FULL.get(name, name))


def _field(words, low, width):
    number, shift = divmod(low, 32)
    pair = words[..., number].astype(np.uint64)
    if number + 1 < words.shape[-1]:
        pair |= words[..., number + 1].astype(np.uint64) << np.uint64(32)
    return (pair >> np.uint64(shift) & np.uint64((1 << width) - 1)).astype(np.int64)


def decode_pixels(pixels, image, config):
    """The frame that the chip's pixels make."""
    layout = pixel_layout(fmt=config.fmt, index_width=config.index_width, coord_width=config.coord_width)
    hit = layout["hit"]

    def value(name):
        return _field(pixels, hit.offset + hit.shape[name].offset, hit.shape[name].width)

    height, width = pixels.shape[:2]
    frame = Frame.empty(width, height)
    is_hit = _field(pixels, layout["is_hit"].offset, 1) == 1
    triangle, instance = value("triangle")[is_hit], np.where(value("in_instance"), value("instance"), -1)[is_hit]
    frame.instance_id[is_hit], frame.prim_id[is_hit] = image.owners(triangle, instance)
    frame.t[is_hit], u, v = (image.fmt.decode(value(name)[is_hit]) for name in "tuv")
    frame.u[is_hit], frame.v[is_hit] = image.weights(triangle, u, v)
    color = _field(pixels, layout["color"].offset, 24)
    for channel, shift in enumerate((16, 8, 0)):
        frame.color[..., channel] = color >> shift & 255
    return frame


def report_of(counters, bytes_read, num_rays, rate, config):
    """What a simulated chip has to say of a picture; of units the mean of all pipelines."""
    cycles = counters["cycles"]
    num_pipelines = config.num_pipelines
    return dict(
        cycles=cycles, rays=num_rays, cycles_per_ray=cycles / num_rays, packets=counters["packets"],
        traces=counters["traces"],
        busy={unit: counters[f"busy_{unit}"] / cycles / num_pipelines / (config.num_shaders if unit == "shader" else 1)
              for unit in _UNITS if f"busy_{unit}" in counters},
        cache={name: {"hits": counters[f"hit_{name}"], "misses": counters[f"miss_{name}"]}
               for name in cache_names(config)},
        bytes=bytes_read, simulated_hz=rate)


def wave_window(begun, written, pixels, width, height):
    """The cycles from the begin of the first packet of ``pixels`` to the write-out of the last of them."""
    order = {place: number for number, place in enumerate(packet_order(width, height))}
    first = min(int(begun[order[x & ~1, y & ~1]]) for x, y in pixels)
    return first, max(int(written[y, x]) for x, y in pixels) + 2


def render_rtl(image, camera, width, height, *, config, background=(0, 0, 0), latency=4, jitter=0, seed=1,
               wave=None, cycles=None, pixels=(), progress=lambda text: None):
    """What the simulated chip draws.

    Parameters
    ----------
    image, camera, width, height, config, background
        As for :func:`~sim.model.model.render_model`.
    latency, jitter, seed
        Of the memories, see :class:`~sim.machine.bench.Bench`.
    wave : path, optional
        Where to write a waveform, VCD or FST by its name.
    cycles : (int, int), optional
        The cycles of the waveform; default all.
    pixels : list of (int, int)
        The waveform shall show just what happens to these, from the begin of their packets to write-out.
    progress : callable
        Is told what is being done.

    Returns
    -------
    Frame
        Of a chip with a shader it has colours only. Its report has cycles, counters, busy fractions, cache hits and
        misses, and bytes of each memory.

    Raises
    ------
    BuildError, SimulationError
        See :mod:`~sim.machine.build` and :mod:`~sim.machine.bench`.
    """
    trace = "" if wave is None else str(wave).rsplit(".", 1)[-1].lower()

    def draw(trace, path=None, window=None):
        with Bench(config, latency=latency, jitter=jitter, seed=seed, trace=trace, progress=progress) as bench:
            load_image(bench, image, config)
            if path is not None:
                first, last = window or (0, 1 << 62)
                bench.trace(path, first=first, last=last)
            progress("drawing")
            return draw_frame(bench, image, camera, width, height, config=config, background=background)

    if pixels:
        # Where in time a pixel is at work is known only afterwards; the second run is the same as the first.
        _, written, begun = draw(trace)
        cycles = wave_window(begun, written, pixels, width, height)
    return draw(trace, wave, cycles)[0]


def load_image(bench, image, config):
    """Puts an image into an open bench's memories."""
    for name in memory_ports(config):
        bench.load(name, memory_words(image, name, config))


def draw_frame(bench, image, camera, width, height, *, config, background=(0, 0, 0)):
    """What the chip of an open bench draws of the image in its memories.

    Returns
    -------
    frame : Frame
        As of :func:`render_rtl`.
    written, begun
        As of :meth:`~sim.machine.bench.Bench.draw`.
    """
    begin, cycle, read = time.perf_counter(), bench.cycle, bench.bytes_read
    red, green, blue = background
    raw, written, begun = bench.draw(camera=camera_words(image, camera, width), root=image.root, width=width,
                                     height=height, background=red << 16 | green << 8 | blue)
    rate = (bench.cycle - cycle) / (time.perf_counter() - begin)
    frame = decode_pixels(raw, image, config)
    bytes_read = {name: number - read[name] for name, number in bench.bytes_read.items()}
    frame.report.update(report_of(bench.counters, bytes_read, width * height, rate, config))
    return frame, written, begun
