"""Rays of a mask, one after the other."""

from amaranth.hdl import Signal

from .layout import PACKET_RAYS

__all__ = ["lowest_ray"]


def lowest_ray(m, mask):
    """Signals of the number of the lowest ray in ``mask``, and of the mask without it; of an empty mask both are 0."""
    ray, others = Signal(range(PACKET_RAYS), name="ray"), Signal(PACKET_RAYS, name="others")
    for number in reversed(range(PACKET_RAYS)):
        with m.If(mask[number]):
            m.d.comb += ray.eq(number)
    m.d.comb += others.eq(mask & (mask - 1))
    return ray, others
