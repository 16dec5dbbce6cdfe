"""What is seen of a pipeline from outside: events to count, and where threads are."""

from amaranth.lib import data

from .memory_ports import cache_names

__all__ = ["UNITS", "event_names", "events_layout", "observe"]

#: Where a thread can be, in the order of the bits of ``probe``.
UNITS = ("ray generation", "node cache", "traversal", "stack", "list cache", "mailboxed list", "matrix cache",
         "transformation", "intersection", "write-out")


def event_names(config):
    """What is counted: packets and begun traces, busy cycles of each unit, hits and misses of each cache."""
    names = ["packets", "traces", "busy_traversal", "busy_list", "busy_transformation", "busy_intersection"]
    if config.program is not None:
        names += ["busy_shader", "steps"]
    return (*names, *(f"{event}_{cache}" for cache in cache_names(config) for event in ("hit", "miss")))


def events_layout(config):
    """How often each of :func:`event_names` happens in a cycle."""
    return data.StructLayout({name: range(config.num_shaders + 1) if name == "busy_shader" else 1
                              for name in event_names(config)})


def observe(m, *, events, probe, caches, threads, stack, traversal, mailboxed_list, transformation, intersection,
            color):
    """Drives ``events`` and ``probe``, see :class:`~rtl.dynrtp.DynRTP`.

    Parameters
    ----------
    m : Module
        Gets the logic.
    events, probe : view
        Are driven.
    caches : dict
        By name.
    threads, stack, traversal, mailboxed_list, transformation, intersection, color : Component
        The pipeline's units; the last is its shader or its write-out.
    """
    has_shader = "busy_shader" in events.shape().members

    def transfer(source, token):
        return source.valid & source.ready, token.thread

    happening = {
        "packets": threads.begin.valid,
        "traces": mailboxed_list.begin.valid,
        "busy_traversal": traversal.busy,
        "busy_list": mailboxed_list.busy,
        "busy_transformation": transformation.busy,
        "busy_intersection": intersection.busy,
    }
    if has_shader:
        happening |= {"busy_shader": color.busy, "steps": color.step.valid & color.step.ready}
    for name, cache in caches.items():
        happening |= {f"hit_{name}": cache.hit, f"miss_{name}": cache.miss}
    m.d.comb += [events[name].eq(event) for name, event in happening.items()]

    nodes, lists = caches["nodes"], caches["lists"]
    entering = (
        (threads.begin.valid, threads.begin.thread),
        transfer(nodes.request, nodes.request.payload.payload),
        (traversal.node.valid, traversal.node.payload.payload.thread),
        transfer(stack.pop, stack.pop.payload),
        transfer(lists.request, lists.request.payload.payload.token),
        transfer(mailboxed_list.entry, mailboxed_list.entry.payload.payload.token),
        transfer(caches["matrices"].request, caches["matrices"].request.payload.payload.token),
        transfer(transformation.matrix, transformation.matrix.payload.payload.token),
        (intersection.vector.valid, intersection.vector.payload.token.thread),
        (color.finished.valid, color.finished.payload.thread) if has_shader else
        transfer(color.packet, color.packet.payload),
    )
    for unit, (valid, thread) in zip(probe, entering, strict=True):
        m.d.comb += [unit.valid.eq(valid), unit.thread.eq(thread)]
