"""A frame of full shading by the model: every packet's program, over all cores."""

from dataclasses import replace

import numba
import numpy as np

from rtl.microcode import NUM_REGISTERS, constant_numbers
from rtl.ray_generation import packet_order
from rtl.shader_program import RAY_KINDS, ray_kind, shader_program, stack_words
from rtl.srgb import bright_bytes, dark_bytes, linear_colors

from ..frame import Frame
from ..scene.image import SceneImage
from .compiled import compiled
from .model import camera_rows
from .packet import COUNTS, SAME_ORIGIN, trace_packet
from .shader import INSTRUCTION_FIELDS, SHADER_COUNTS, STOPPED_AT_TRACE, encoded_byte, run_ray

__all__ = ["program_arrays", "render_full"]

#: Logarithm of the offset against self-intersection, in units in the last place: of −2 to 4 what draws the built-in
#: scenes best, as a ray does not meet the triangle that it starts on. Golden, where it is next to nothing, has 3.
OFFSET_LOG2 = 1

_TRACES = len(SHADER_COUNTS) + len(RAY_KINDS)
_A, _X, _SELECT0, _BIT = (INSTRUCTION_FIELDS.index(name) for name in ("a", "x", "select0", "bit"))
_TRIANGLE_STACK, _SHADER_STACK = 1, 2


def program_arrays(program, fmt):
    """A program as the interpreter takes it.

    Returns
    -------
    instructions : int64[n, 16]
    kinds : int64[n]
        See :func:`~sim.model.shader.run_ray`.
    floats : float64[64, 3]
    integers : int64[64, 3]
        Registers and constants, all zero but for the literals.
    """
    def value(instruction, name):
        if name.startswith("select"):
            return instruction["select"][int(name[-1])]
        field = instruction[name]
        return int(getattr(field, "value", field))

    instructions = np.array([[value(instruction, name) for name in INSTRUCTION_FIELDS]
                             for instruction in program.instructions], np.int64)
    kinds = np.full(len(instructions), -1, np.int64)
    for label, place in program.labels.items():
        if (kind := ray_kind(label)) is not None:
            kinds[place] = len(SHADER_COUNTS) + kind
    floats, integers = np.zeros((64, 3)), np.zeros((64, 3), np.int64)
    first = constant_numbers["eye"] + 1
    for number, literal in enumerate(program.literals):
        if isinstance(literal[0], int):
            integers[first + number] = literal
        else:
            floats[first + number] = fmt.quantize(literal)
            integers[first + number] = fmt.encode(literal)
    return instructions, kinds, floats, integers


@compiled()
def _shade_packet(tracing, offset_log2, one_bits, program, kinds, record_floats, record_integers, texels, tables,
                  constants, screen, mask, stack_size, colors, first_hits, first_owners, counts, shader_counts):
    """Runs the program for four rays.

    Returns
    -------
    int
        0, or which stack was too small.
    """
    arithmetic, params, root, nodes, splits, lists, matrices, mailbox_entries, stack_depth, tolerance = tracing
    # No program reads what it has not written: not-a-numbers would show.
    floats, integers = np.full((4, 64, 3), np.nan), np.full((4, 64, 3), -77, np.int64)
    stack_floats, stack_integers = np.empty((4, stack_size, 3)), np.empty((4, stack_size, 3), np.int64)
    pushed, pc = np.zeros((4, 1), np.int64), np.zeros(4, np.int64)
    origins, directions = np.zeros((4, 3)), np.zeros((4, 3))
    hits, owners = np.zeros((4, 4)), np.full((4, 2), -1, np.int64)
    limits, excluded, flags = np.zeros((4, 2)), np.zeros((4, 2), np.int64), np.zeros(4, np.int64)
    emitted = np.empty(3, np.int64)
    for ray in range(4):
        floats[ray, NUM_REGISTERS:] = constants[0][NUM_REGISTERS:]
        integers[ray, NUM_REGISTERS:] = constants[1][NUM_REGISTERS:]
        floats[ray, 0] = screen[ray]
    is_first = True
    while mask:
        traced = 0
        is_shared = True
        number = np.int64(-1)
        for ray in range(4):
            if not mask >> ray & 1:
                continue
            how, pc[ray] = run_ray(
                arithmetic, params, offset_log2, one_bits, program, kinds, (record_floats, record_integers), texels,
                tables[0], pc[ray], floats[ray], integers[ray],
                (stack_floats[ray], stack_integers[ray], pushed[ray]), hits[ray], owners[ray], origins[ray],
                directions[ray], emitted, shader_counts)
            if how == STOPPED_AT_TRACE:
                traced |= 1 << ray
                now = program[pc[ray]]
                limits[ray] = floats[ray, now[_A], :2]
                excluded[ray, 0] = integers[ray, now[_X], now[_SELECT0]]
                excluded[ray, 1] = integers[ray, now[_X], now[_SELECT0 + 1]]
                # Triangles outside of any instance are of instance −1 here.
                if excluded[ray, 1] == 0xFFFFFF:
                    excluded[ray, 1] = -1
                flags[ray] = now[_BIT]
                shared = integers[ray, now[_X], now[_SELECT0 + 2]]
                if not flags[ray] & SAME_ORIGIN or (number >= 0 and shared != number):
                    is_shared = False
                number = shared
                pc[ray] += 1
            elif how > STOPPED_AT_TRACE + 1:
                return _SHADER_STACK
            else:
                for lane in range(3):
                    colors[ray, lane] = encoded_byte(emitted[lane], tables[1], tables[2])
        mask = traced
        if mask:
            shader_counts[_TRACES] += 1
            if not trace_packet(arithmetic, params, root, nodes, splits, lists, matrices, mailbox_entries, stack_depth,
                                tolerance, origins, directions, mask, limits, excluded, flags, is_shared, hits, owners,
                                counts):
                return _TRIANGLE_STACK
            if is_first:
                first_hits[:], first_owners[:] = hits, owners
                is_first = False
    return 0


@compiled(parallel=True)
def _render(arithmetic, params, root, nodes, splits, lists, matrices, mailbox_entries, stack_depth, tolerance,
            offset_log2, one_bits, program, kinds, record_floats, record_integers, texels, linear, dark, bright, floats,
            integers, stack_size, packets, x, y, width, height, colors, hits, owners, counts, shader_counts, failures):
    for number in numba.prange(len(packets)):
        px, py = packets[number]
        screen, packet_colors = np.ones((4, 3)), np.zeros((4, 3), np.int64)
        packet_hits, packet_owners = np.empty((4, 4)), np.full((4, 2), -1, np.int64)
        mask = 0
        for ray in range(4):
            column, row = px + (ray & 1), py + (ray >> 1)
            if column < width and row < height:
                mask |= 1 << ray
                screen[ray, 0], screen[ray, 1] = x[column], y[row]
        failures[number] = _shade_packet(
            (arithmetic, params, root, nodes, splits, lists, matrices, mailbox_entries, stack_depth, tolerance),
            offset_log2, one_bits, program, kinds, record_floats, record_integers, texels, (linear, dark, bright),
            (floats, integers), screen, mask, stack_size, packet_colors, packet_hits, packet_owners, counts[number],
            shader_counts[number])
        for ray in range(4):
            if mask >> ray & 1:
                row, column = py + (ray >> 1), px + (ray & 1)
                hits[row, column] = packet_hits[ray]
                owners[row, column] = packet_owners[ray]
                for lane in range(3):
                    colors[row, column, lane] = packet_colors[ray, lane]


def render_full(image: SceneImage, camera, width, height, *, config, depth=4):
    """What a chip with full shading draws, bit for bit.

    Parameters
    ----------
    image : SceneImage
        The scene, with the records of full shading.
    camera : Camera
        The view.
    width, height : int
        Size of the picture in pixels.
    config : ChipConfig
        The chip, of which mailbox, stack, arithmetic, tolerance, offset and shader matter; without a shader it gets the
        least that draws all that is in the scene.
    depth : int
        Generations of secondary rays, 0…16, of a chip without a shader.

    Returns
    -------
    Frame
        Its hits are those of primary rays. Its report has the ``counts`` of :data:`~sim.model.packet.COUNTS` and
        :data:`~sim.model.shader.SHADER_COUNTS`, ``ray_kinds``, the length of the ``program``, and ``packets_traced``.

    Raises
    ------
    ValueError
        If the features lack what the scene needs.
    OverflowError
        If a packet needs more than a stack holds.
    """
    features = config.shader or replace(image.needs, depth=depth)
    if missing := features.missing(image.needs):
        raise ValueError(f"the shader's program lacks what the scene needs: {', '.join(missing)}")
    fmt, program = image.fmt, shader_program(features=features)
    packets = np.array(list(packet_order(width, height)), np.int64)
    x = fmt.quantize(2.0 * np.arange(width) + 1 - width)
    y = fmt.quantize(height - 1 - 2.0 * np.arange(height))
    instructions, kinds, floats, integers = program_arrays(program, fmt)
    floats[NUM_REGISTERS + 1:NUM_REGISTERS + 5] = camera_rows(image, camera, width)
    linear, dark, bright = (np.array(table(), np.int64) for table in (linear_colors, dark_bytes, bright_bytes))
    colors = np.zeros((height, width, 3), np.uint8)
    hits, owners = np.zeros((height, width, 4)), np.empty((height, width, 2), np.int64)
    counts = np.zeros((len(packets), len(COUNTS)), np.int64)
    shader_counts = np.zeros((len(packets), _TRACES + 1), np.int64)
    failures = np.zeros(len(packets), np.int64)
    _render(config.arithmetic, fmt.params, image.root, image.nodes[:, 0].astype(np.int64), image.split_values(),
            image.lists.astype(np.int64), image.matrix_values(), config.mailbox_entries, config.stack_depth,
            config.edge_tolerance * 2.0**-fmt.frac_width, config.offset_log2, int(fmt.encode(1.0)), instructions, kinds,
            *image.record_lanes(), image.texels,
            linear, dark, bright, floats, integers, max(stack_words(features), 1), packets, x, y, width, height,
            colors, hits, owners, counts, shader_counts, failures)
    for failure, what in ((_TRIANGLE_STACK, f"the {config.stack_depth} traversal stack entries"),
                          (_SHADER_STACK, f"the {stack_words(features)} registers of a ray's stack")):
        if (failures == failure).any():
            x, y = packets[np.flatnonzero(failures == failure)[0]]
            raise OverflowError(f"the packet at pixel ({x}, {y}) needs more than {what}")
    frame = Frame.empty(width, height)
    frame.color[:] = colors
    is_hit = owners[..., 0] >= 0
    frame.instance_id[is_hit], frame.prim_id[is_hit] = image.owners(*owners[is_hit].T)
    frame.t[is_hit], u, v, _ = hits[is_hit].T
    frame.u[is_hit], frame.v[is_hit] = image.weights(owners[is_hit][:, 0], u, v)
    sums, most = counts.sum(axis=0), counts.max(axis=0, initial=0)
    sums[-1] = most[-1]
    shader_sums = shader_counts.sum(axis=0)
    shader_sums[2] = shader_counts[:, 2].max(initial=0)
    frame.report["counts"] = dict(zip((*COUNTS, *SHADER_COUNTS), [*sums.tolist(), *shader_sums.tolist()], strict=False))
    frame.report["ray_kinds"] = dict(zip(RAY_KINDS, shader_sums[len(SHADER_COUNTS):].tolist(), strict=False))
    frame.report["program"] = len(program.instructions)
    frame.report["packets_traced"] = int(shader_sums[_TRACES])
    return frame
