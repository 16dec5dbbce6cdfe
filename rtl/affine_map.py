"""The affine map that all of the transformation unit's work is made of."""

from fpu import Datapath, Vector

from .arithmetic import ARITHMETICS

__all__ = ["affine_map"]


def affine_map(fmt, *, latencies=None, arithmetic=ARITHMETICS[0]):
    """``result`` = m·(X − C) for a point, m·X for a direction (paper §2.1.1, with C in place of N).

    Subtracting C first keeps the cancellation between a far origin and a far triangle out of the products; it
    takes as many operators as m·X + N. Each row is ((m₀·x + m₁·y) + m₂·z), or a fused dot product.

    Datapath: 9 adders, 9 multipliers; or 3 adders, 3 dot products.
    """
    dp = Datapath(fmt, latencies=latencies, **arithmetic.parameters)
    is_point = dp.flag("is_point")
    vector, center = dp.vector("vector"), dp.vector("center")
    rows = [dp.vector(f"row{row}") for row in range(3)]
    x, y, z = (dp.sub(getattr(vector, axis), dp.select(is_point, getattr(center, axis), dp.const(0.0)))
               for axis in "xyz")
    for row, name in zip(rows, "xyz", strict=True):
        if arithmetic.fused:
            result = dp.dot(row, Vector(x, y, z))
        else:
            result = dp.add(dp.add(dp.mul(row.x, x), dp.mul(row.y, y)), dp.mul(row.z, z))
        dp.output(f"result_{name}", result)
    return dp
