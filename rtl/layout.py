"""The shapes that units hand to each other and keep in memory."""

from amaranth.lib import data, enum
from amaranth.utils import ceil_log2

__all__ = [
    "NODE_BITS",
    "PACKET_RAYS",
    "Axis",
    "IntervalSource",
    "camera_layout",
    "interval_layout",
    "job_layout",
    "list_entry_layout",
    "matrix_layout",
    "node_layout",
    "scale_layout",
    "thread_slots",
    "thread_width",
    "token_layout",
    "vector_layout",
    "with_token",
]

#: Rays in a packet: a square of 2×2 pixels, ray r at (r & 1, r >> 1).
PACKET_RAYS = 4

#: Bits of a kd-tree node in memory.
NODE_BITS = 64


class Axis(enum.Enum, shape=2):
    """Where a kd-tree node splits; a leaf does not."""

    X = 0
    Y = 1
    Z = 2
    LEAF = 3


class IntervalSource(enum.Enum, shape=2):
    """Where a thread's current parameter interval stands."""

    FRESH = 0   #: nowhere: it is [0, ∞)
    STEP = 1    #: in the memory that the kd-step writes
    POP = 2     #: in the memory that the stack writes when it pops


def thread_width(num_threads):
    """Bits of a thread's number; one even for a single thread, for tools that know no memory of a single word."""
    return max(ceil_log2(num_threads), 1)


def thread_slots(num_threads, bank_bits=0):
    """Places for threads in a memory of those that agree in their lowest ``bank_bits`` bits."""
    return 1 << max(thread_width(num_threads) - bank_bits, 0)


def token_layout(*, num_threads, stack_depth):
    """A thread's ticket: whoever holds it works for that thread, and nobody else does.

    There is one token a thread, so a queue with room for every thread never overflows and a memory indexed by
    the thread has no hazards.

    Members
    -------
    thread : the thread's number
    level : 0 while in the scene's own space, 1 inside of an instance
    hit : per ray, whether the thread's hit store holds a hit (else its distance counts as infinite)
    mask : per ray, whether it takes part
    sp : stack entries in use at this level
    interval : where [t_near, t_far] of the rays is kept
    """
    return data.StructLayout({
        "thread": thread_width(num_threads),
        "level": 1,
        "hit": PACKET_RAYS,
        "mask": PACKET_RAYS,
        "sp": range(stack_depth + 1),
        "interval": IntervalSource,
    })


def scale_layout(fmt, *, is_there):
    """Exponents of the ``scale`` of :func:`~rtl.affine_map.affine_map`, of three rows; of none if it is not there."""
    return data.ArrayLayout(fmt.exp_width, 3 if is_there else 0)


def with_token(token, **members):
    """A token and what travels with it."""
    return data.StructLayout({"token": token, **members})


def job_layout(token, *, index_width, solid):
    """A packet's rays to be transformed by the matrix ``index``, of an instance or a triangle.

    ``solid``, if it is kept: the triangle lets no light through.
    """
    return with_token(token, index=index_width, instance=1, solid=int(solid))


def node_layout(*, fmt, index_width):
    """A kd-tree node of 8 bytes.

    An inner node's children are neighbours: the lower one at ``child``, the upper one at ``child + 1``; an
    empty child is never visited. A leaf's ``child`` is its first list entry.
    """
    return data.FlexibleLayout(NODE_BITS, {
        "child": data.Field(index_width, 0),
        "axis": data.Field(Axis, 24),
        "lower_empty": data.Field(1, 26),
        "upper_empty": data.Field(1, 27),
        "split": data.Field(fmt, 32),
    })


def list_entry_layout(*, index_width):
    """A leaf's list entry of 4 bytes: a triangle's or an instance's matrix number, and whether it is the last.

    ``solid``: a triangle that lets no light through.
    """
    return data.FlexibleLayout(32, {
        "index": data.Field(index_width, 0),
        "solid": data.Field(1, 29),
        "instance": data.Field(1, 30),
        "last": data.Field(1, 31),
    })


def vector_layout(fmt):
    """Three coordinates."""
    return data.StructLayout({"x": fmt, "y": fmt, "z": fmt})


def matrix_layout(fmt):
    """An affine map X ↦ m·(X − C): three rows, then the point that is mapped to the origin."""
    return data.StructLayout({"rows": data.ArrayLayout(vector_layout(fmt), 3), "center": vector_layout(fmt)})


def interval_layout(fmt):
    """The parameter interval of one ray."""
    return data.StructLayout({"t_near": fmt, "t_far": fmt})


def camera_layout(fmt):
    """Primary rays: from ``origin`` along rows·(x, y, 1)."""
    return data.StructLayout({"origin": vector_layout(fmt), "rows": data.ArrayLayout(vector_layout(fmt), 3)})
