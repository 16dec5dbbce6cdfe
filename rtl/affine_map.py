"""The affine map that all of the transformation unit's work is made of."""

from fpu import Datapath, Vector

from .arithmetic import ARITHMETICS

__all__ = ["affine_map"]


def affine_map(fmt, *, latencies=None, arithmetic=ARITHMETICS[0], scaled=False):
    """``result`` = m·(X − C) for a point, m·X for a direction (paper §2.1.1, with C in place of N).

    Subtracting C first keeps the cancellation between a far origin and a far triangle out of the products; it
    takes as many operators as m·X + N. Each row is ((m₀·x + m₁·y) + m₂·z), or a fused dot product.

    With ``scaled`` there is ``result_scale`` too: of each row the power of two of its largest product, which says how
    much of the result rounding may have changed.

    Datapath: 9 adders, 9 multipliers; or 3 adders, 3 dot products. If scaled, six comparisons of exponents.

    Raises
    ------
    ValueError
        If fused dot products, of which no product is seen, shall be scaled.
    """
    if scaled and arithmetic.fused:
        raise ValueError(f"No scale is known of dot products: arithmetic '{arithmetic.name}' cannot be scaled")
    dp = Datapath(fmt, latencies=latencies, **arithmetic.parameters)
    is_point = dp.flag("is_point")
    vector, center = dp.vector("vector"), dp.vector("center")
    rows = [dp.vector(f"row{row}") for row in range(3)]
    x, y, z = (dp.sub(getattr(vector, axis), dp.select(is_point, getattr(center, axis), dp.const(0.0)))
               for axis in "xyz")
    scales = {}
    for row, name in zip(rows, "xyz", strict=True):
        if arithmetic.fused:
            result = dp.dot(row, Vector(x, y, z))
        else:
            products = [dp.mul(row.x, x), dp.mul(row.y, y), dp.mul(row.z, z)]
            result = dp.add(dp.add(products[0], products[1]), products[2])
            scales[name] = products
        dp.output(f"result_{name}", result)
    if scaled:
        for name, products in scales.items():
            first, second, third = map(dp.power, products)
            dp.output(f"result_scale_{name}", dp.power_max(dp.power_max(first, second), third))
    return dp
