"""The soft hits that wait beside a ray's best hit for another to join them, see :mod:`rtl.unit_triangle`."""

import math

from amaranth.hdl import Mux, Signal
from amaranth.lib import data

from fpu import Delay

__all__ = ["begun", "best_layout", "keep_soft", "stored_best"]

_INFINITE = "key", "front", "back"


def best_layout(fmt):
    """What the next hit's key has to be less than, and t of the soft hits that wait, on a front and on a back."""
    return data.StructLayout({**dict.fromkeys(_INFINITE, fmt), "front_is_loose": 1, "back_is_loose": 1})


def begun(best, key, *, fmt):
    """Statements: ``best`` is that of a ray that has hit nothing, and is to hit nothing from ``key`` on."""
    return [best.key.eq(key), *(best[name].eq(fmt.const(math.inf)) for name in ("front", "back"))]


def stored_best(m, test, stored, asking, *, fmt):
    """What is ``stored`` of the ray ``asking``, two cycles later; of one without a hit it is another's.

    The soft hits go to ``test``.
    """
    best = Signal(stored.shape())
    m.submodules.asked_hit = has_hit = Delay(1, cycles=2)
    m.d.comb += [
        best.eq(stored),
        has_hit.i.eq(asking.token.hit.bit_select(asking.ray, 1)),
        *(best[name].eq(Mux(has_hit.o, stored[name], fmt.const(math.inf))) for name in _INFINITE),
        test.soft_front.eq(best.front),
        test.soft_back.eq(best.back),
        test.front_is_loose.eq(best.front_is_loose),
        test.back_is_loose.eq(best.back_is_loose),
    ]
    return best


def keep_soft(m, best, new_best, record_write, *, fmt, found, done, better, kept, taken, is_over, cycles):
    """Keeps a soft hit for another to join it, beside the best one that there is, ``cycles`` after that is read.

    Parameters
    ----------
    best, new_best : data.View
        What was read, and what is ``kept`` in its place.
    record_write : data.View
        ``{"en", "data"}``: the record, set up for a hit.
    found, done : data.View
        What the test found, and of which ray.
    better, taken, is_over : Signal
        The hit is the best so far; a test is through whose triangle the ray may hit; the ray ends with it.
    """
    m.submodules.best_until = until = Delay(best.shape(), cycles=cycles)
    before, is_soft = until.o, Signal()
    m.d.comb += [
        until.i.eq(best),
        is_soft.eq(taken & found.is_soft),
        kept.eq(better | is_soft),
        new_best.eq(before),
        new_best.key.eq(Mux(better, Mux(is_over, fmt.const(0.0), found.key), before.key)),
    ]
    for name, is_side in (("front", ~done.cosine.sign), ("back", done.cosine.sign)):
        with m.If(is_soft & is_side):
            m.d.comb += [new_best[name].eq(found.t), new_best[f"{name}_is_loose"].eq(found.is_loose)]
    with m.If(~better):
        m.d.comb += [record_write.data.triangle.eq(~0),
                     record_write.en.eq(is_soft & ~done.token.hit.bit_select(done.ray, 1))]
