"""The kernels of the chip's datapaths, in each arithmetic that a chip can have."""

from fpu import FloatFormat
from rtl import intersection, transformation, traversal
from rtl.arithmetic import ARITHMETICS, NUMBERS

from .compiled import compiled

__all__ = ["affine_map", "kd_step", "scaled_map", "tolerant_triangle", "unit_triangle"]

# The kernels are the same for every format, which they take as an argument.
_ANY = FloatFormat(7, 16)
_FUSED, _NARROW, _TRUNCATED, _RECIPROCAL = (
    NUMBERS[name] for name in ("fused", "fused-narrow", "truncated", "reciprocal"))


def _kernel(datapath, number=0, **options):
    return datapath(_ANY, arithmetic=ARITHMETICS[number], **options).kernel()


_map_separate, _map_truncated = _kernel(transformation.affine_map), _kernel(transformation.affine_map, _TRUNCATED)
_map_fused, _map_narrow = _kernel(transformation.affine_map, _FUSED), _kernel(transformation.affine_map, _NARROW)
_step_divided, _step_truncated = _kernel(traversal.kd_step), _kernel(traversal.kd_step, _TRUNCATED)
_step_multiplied = _kernel(traversal.kd_step, _RECIPROCAL)
# With t_near = 0 that of limited rays is the same as that of others.
_triangle_nearest = _kernel(intersection.unit_triangle, near=True)
_triangle_truncated = _kernel(intersection.unit_triangle, _TRUNCATED, near=True)
_scaled_separate, _scaled_truncated = (
    _kernel(transformation.affine_map, number, scaled=True) for number in (0, _TRUNCATED))
_tolerant_nearest, _tolerant_truncated = (
    _kernel(intersection.unit_triangle, number, near=True, tolerant=True) for number in (0, _TRUNCATED))


# Where an arithmetic does not differ in its results it takes the first one's kernel: a quotient by table is the same.

@compiled()
def affine_map(arithmetic, params, *operands):
    """See :func:`rtl.transformation.affine_map`."""
    if arithmetic == _FUSED:
        return _map_fused(params, *operands)
    if arithmetic == _NARROW:
        return _map_narrow(params, *operands)
    if arithmetic == _TRUNCATED:
        return _map_truncated(params, *operands)
    return _map_separate(params, *operands)


@compiled()
def kd_step(arithmetic, params, *operands):
    """See :func:`rtl.traversal.kd_step`."""
    if arithmetic == _TRUNCATED:
        return _step_truncated(params, *operands)
    if arithmetic == _RECIPROCAL:
        return _step_multiplied(params, *operands)
    return _step_divided(params, *operands)


@compiled()
def unit_triangle(arithmetic, params, *operands):
    """See :func:`rtl.intersection.unit_triangle`."""
    if arithmetic == _TRUNCATED:
        return _triangle_truncated(params, *operands)
    return _triangle_nearest(params, *operands)


@compiled()
def scaled_map(arithmetic, params, *operands):
    """See :func:`rtl.transformation.affine_map`: results and their scales, which fused sums do not have."""
    if arithmetic == _TRUNCATED:
        return _scaled_truncated(params, *operands)
    return _scaled_separate(params, *operands)


@compiled()
def tolerant_triangle(arithmetic, params, *operands):
    """See :func:`rtl.intersection.unit_triangle`, with edges that give."""
    if arithmetic == _TRUNCATED:
        return _tolerant_truncated(params, *operands)
    return _tolerant_nearest(params, *operands)
