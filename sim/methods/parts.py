"""What datapaths of ray/triangle tests have in common."""

from fpu import Vector

__all__ = ["cross", "dot", "each", "has_one_sign", "named", "outputs"]


def named(name, vectors):
    """Columns of float64[…, 3] under the names of a datapath's :meth:`~fpu.graph.Graph.vector`."""
    return {f"{name}_{axis}": vectors[..., k] for k, axis in enumerate("xyz")}


def dot(dp, a, b):
    """(aₓ·bₓ + a_y·b_y) + a_z·b_z, each operation rounded."""
    return dp.add(dp.add(dp.mul(a.x, b.x), dp.mul(a.y, b.y)), dp.mul(a.z, b.z))


def cross(dp, a, b):
    """a × b, each operation rounded."""
    return Vector(dp.sub(dp.mul(a.y, b.z), dp.mul(a.z, b.y)), dp.sub(dp.mul(a.z, b.x), dp.mul(a.x, b.z)),
                  dp.sub(dp.mul(a.x, b.y), dp.mul(a.y, b.x)))


def each(operation, a, b):
    """A vector of an operation on the parts of two."""
    return Vector(*(operation(p, q) for p, q in zip(a, b, strict=True)))


def has_one_sign(dp, values):
    """Whether no two of ``values`` are of opposite signs; zero is of either."""
    negative = [dp.is_negative(value) for value in values]
    positive = [dp.logical_not(dp.logical_or(dp.is_negative(value), dp.is_zero(value))) for value in values]
    return dp.logical_not(dp.logical_and(dp.logical_or(*negative), dp.logical_or(*positive)))


def outputs(dp, t, u, v, inside):
    """Declares t, u, v, ``hit`` and ``nearer`` as of :func:`~rtl.intersection.unit_triangle`."""
    t_hit = dp.input("t_hit", delay=dp.arrival(t))
    ahead = dp.logical_and(dp.is_finite(t), dp.logical_not(dp.sign(t)), dp.logical_not(dp.is_zero(t)))
    for name, value in (("t", t), ("u", u), ("v", v)):
        dp.output(name, value)
    dp.output("hit", dp.logical_and(ahead, inside))
    dp.output("nearer", dp.lt(t, t_hit))
    return dp
