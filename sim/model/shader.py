"""The shader's instructions, a ray at a time (see :mod:`rtl.microcode`)."""

import math

import numpy as np

from fpu.reciprocal_square_root import reciprocal_square_root
from rtl.microcode import NO_TRIANGLE, Condition, Lane, Mode, Op, Store

from .compiled import compiled
from .packet import transform
from .texture import sample_texture

__all__ = ["INSTRUCTION_FIELDS", "SHADER_COUNTS", "STOPPED_AT_TRACE", "encoded_byte", "run_ray"]

#: Columns of a program as int64[n, 16].
INSTRUCTION_FIELDS = ("op", "mode", "condition", "store", "bit", "mask", "dst", "a", "b", "c", "x", "select0",
                      "select1", "select2", "negate", "target")
(_OP, _MODE, _CONDITION, _STORE, _BIT, _MASK, _DST, _A, _B, _C, _X, _SELECT0, _, _, _NEGATE, _TARGET) = range(16)

#: What the shader's work is counted in, before the kinds of rays; of the stack it is the maximum.
SHADER_COUNTS = ("instructions", "shader_vectors", "shader_stack")
_INSTRUCTIONS, _VECTORS, _STACK = range(3)

#: How :func:`run_ray` ends.
STOPPED_AT_TRACE, _EMITTED, _OVERFLOW = range(3)

_VECTOR, _ROOT, _CUT, _MULTIPLY, _ADD, _SUBTRACT = (op.value for op in (
    Op.VECTOR, Op.ROOT, Op.CUT, Op.COLOR_MULTIPLY, Op.COLOR_ADD, Op.COLOR_SUBTRACT))
_DECODE, _BYTES, _OFFSET, _MOVE, _BRANCH, _CALL, _RETURN, _LOAD = (op.value for op in (
    Op.DECODE, Op.BYTES, Op.OFFSET, Op.MOVE, Op.BRANCH, Op.CALL, Op.RETURN, Op.LOAD))
_TEXTURE, _HIT, _TRACE, _PUSH, _POP = (op.value for op in (Op.TEXTURE, Op.HIT, Op.TRACE, Op.PUSH, Op.POP))
_COLUMNS, _ROWS = Mode.COLUMNS.value, Mode.ROWS.value
_ZERO, _ONE = Lane.ZERO.value, Lane.ONE.value
_ORIGIN, _DIRECTION = Store.ORIGIN.value, Store.DIRECTION.value
(_ALWAYS, _NEGATIVE, _NOT_NEGATIVE, _IS_ZERO, _NOT_ZERO, _NONE, _SOME, _LESS, _NOT_LESS, _SET, _CLEAR, _MISS,
 _EMPTY) = (condition.value for condition in Condition)
_MOST = (1 << 24) - 1


@compiled()
def encoded_byte(color, dark, bright):
    """The byte that a colour is shown as, by the tables of :mod:`rtl.srgb`."""
    if color >= 65536:
        return 255
    return dark[color >> 2] if color < 4096 else bright[color >> 6]


@compiled()
def _holds(condition, number, value, other, bit, num_pushed):
    if condition == _ALWAYS:
        return True
    if condition == _NEGATIVE:
        return value < 0.0
    if condition == _NOT_NEGATIVE:
        return not value < 0.0
    if condition == _IS_ZERO:
        return value == 0.0
    if condition == _NOT_ZERO:
        return value != 0.0
    if condition == _NONE:
        return number == 0
    if condition == _SOME:
        return number != 0
    if condition == _LESS:
        return number < other
    if condition == _NOT_LESS:
        return number >= other
    if condition == _SET:
        return number >> bit & 1 != 0
    if condition == _CLEAR:
        return number >> bit & 1 == 0
    if condition == _MISS:
        return number == NO_TRIANGLE
    return num_pushed == 0


@compiled()
def _vector(arithmetic, params, mode, a, b, c, x, matrix, result):
    """Op.VECTOR."""
    matrix[:] = 0.0
    if mode == _ROWS:
        matrix[0], matrix[1], matrix[2] = a, b, c
    elif mode == _COLUMNS:
        matrix[:3, 0], matrix[:3, 1], matrix[:3, 2] = a, b, c
    else:
        matrix[0, 0], matrix[1, 1], matrix[2, 2] = a[0], a[1], a[2]
    result[0], result[1], result[2] = transform(arithmetic, params, matrix, x, False)


@compiled()
def _offset(params, offset_log2, a, x):
    """Op.OFFSET: 2^(e − frac_width + offset_log2)."""
    drop, min_normal, largest = params
    most = 0.0
    for lane in range(3):
        most = max(most, abs(a[lane]), abs(x[lane]))
    if most == 0.0:
        return 0.0
    # Infinity has the exponent that follows the largest number's.
    most = min(most, 2.0 * largest)
    result = math.ldexp(1.0, math.frexp(most)[1] - 1 - (52 - drop) + offset_log2)
    return result if result >= min_normal else 0.0


@compiled()
def run_ray(arithmetic, params, offset_log2, one_bits, program, kinds, records, texels, colors, pc, floats, integers,
            stack, hit, owner, origin, direction, color, counts):
    """Runs one ray until it stops.

    Parameters
    ----------
    arithmetic, params
        As for :func:`~sim.model.packet.trace_packet`.
    offset_log2 : int
        Of Op.OFFSET.
    one_bits : int
        The float 1.
    program : int64[n, 16]
        See :data:`INSTRUCTION_FIELDS`.
    kinds : int64[n]
        Column of ``counts`` that an instruction's execution counts in, −1 for none.
    records : (float64[R, 12], int64[R, 12])
    texels : uint32[K]
    colors : int64[256]
        Of bytes.
    pc : int
        Where it begins.
    floats : float64[64, 3]
    integers : int64[64, 3]
        Registers and constants.
    stack : (float64[depth, 3], int64[depth, 3], int64[1])
        The last is the number of entries.
    hit : float64[4]
    owner : int64[2]
        What the ray has hit last.
    origin, direction : float64[3]
        Receive what is stored.
    color : int64[3]
        Receives what is emitted.
    counts : int64[…]
        :data:`SHADER_COUNTS`, then the kinds of rays.

    Returns
    -------
    (how, pc) : (int, int)
        How it has stopped, and the instruction at which.
    """
    x, number = np.empty(3), np.empty(3, np.int64)
    result, matrix = np.empty(3), np.empty((4, 3))
    stack_floats, stack_integers, pushed = stack
    while True:
        now = program[pc]
        op, dst, mask, a = now[_OP], now[_DST], now[_MASK], now[_A]
        counts[_INSTRUCTIONS] += 1
        if kinds[pc] >= 0:
            counts[kinds[pc]] += 1
        for lane in range(3):
            select = now[_SELECT0 + lane]
            if select == _ZERO:
                x[lane], number[lane] = 0.0, 0
            elif select == _ONE:
                x[lane], number[lane] = 1.0, one_bits
            else:
                x[lane], number[lane] = floats[now[_X], select], integers[now[_X], select]
            if now[_NEGATE] >> lane & 1:
                x[lane] = -x[lane]
        pc += 1
        if op == _VECTOR:
            counts[_VECTORS] += 1
            _vector(arithmetic, params, now[_MODE], floats[a], floats[now[_B]], floats[now[_C]], x, matrix, result)
            if now[_STORE] == _ORIGIN:
                origin[:] = result
            elif now[_STORE] == _DIRECTION:
                direction[:] = result
            for lane in range(3):
                if mask >> lane & 1:
                    floats[dst, lane] = result[lane]
        elif op == _BRANCH:
            if _holds(now[_CONDITION], number[0], x[0], integers[a, now[_SELECT0 + 1] % 3], now[_BIT], pushed[0]):
                pc = now[_TARGET]
        elif op == _RETURN:
            pc = number[0]
        elif op == _PUSH:
            if pushed[0] == len(stack_floats):
                return _OVERFLOW, pc - 1
            stack_floats[pushed[0]], stack_integers[pushed[0]] = floats[a], integers[a]
            pushed[0] += 1
            counts[_STACK] = max(counts[_STACK], pushed[0])
        elif op == _POP:
            pushed[0] -= 1
            floats[dst], integers[dst] = stack_floats[pushed[0]], stack_integers[pushed[0]]
        elif op == _LOAD:
            row = number[0] + integers[a, now[_SELECT0 + 1] % 3]
            for k in range(12):
                floats[dst + k // 3, k % 3] = records[0][row, k]
                integers[dst + k // 3, k % 3] = records[1][row, k]
        elif op == _TEXTURE:
            red, green, blue, opacity = sample_texture(texels, integers[a, 0], integers[a, 1], x[0], x[1])
            integers[dst, 0], integers[dst, 1], integers[dst, 2] = red, green, blue
            integers[dst + 1] = opacity
        elif op == _TRACE:
            return STOPPED_AT_TRACE, pc - 1
        else:
            for lane in range(3):
                if not mask >> lane & 1 and op <= _HIT:
                    continue
                if op == _ROOT:
                    floats[dst, lane] = reciprocal_square_root(params, x[0])
                elif op == _CUT:
                    integers[dst, lane] = int(min(max(x[lane], 0.0) * 65536.0, float(_MOST)))
                elif op == _MULTIPLY:
                    integers[dst, lane] = min(integers[a, lane] * number[lane] + 32768 >> 16, _MOST)
                elif op == _ADD:
                    integers[dst, lane] = min(integers[a, lane] + number[lane], _MOST)
                elif op == _SUBTRACT:
                    integers[dst, lane] = max(integers[a, lane] - number[lane], 0)
                elif op == _DECODE:
                    integers[dst, lane] = colors[number[0] >> 16 - 8 * lane & 255]
                elif op == _BYTES:
                    integers[dst, lane] = (2 * 65536 * (number[0] >> 16 - 8 * lane & 255) + 255) // 510
                elif op == _OFFSET:
                    floats[dst, lane] = _offset(params, offset_log2, floats[a], x)
                elif op == _MOVE:
                    floats[dst, lane], integers[dst, lane] = x[lane], number[lane]
                elif op == _CALL:
                    integers[dst, lane] = pc
                elif op == _HIT and not now[_BIT] & 1:
                    floats[dst, lane] = hit[lane]
                elif op == _HIT:
                    if lane == 2:
                        floats[dst, lane] = hit[3]
                    else:
                        integers[dst, lane] = owner[lane] if owner[lane] >= 0 else NO_TRIANGLE
                else:
                    color[lane] = number[lane]
            if op == _CALL:
                pc = now[_TARGET]
            elif op > _POP:
                return _EMITTED, pc - 1
