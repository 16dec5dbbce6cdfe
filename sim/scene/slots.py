"""Where what moves lies in the memories, twice: one frame is written while the last one is drawn."""

from dataclasses import dataclass

import numpy as np

__all__ = ["MemoryLayout", "Piece", "SceneUpdate", "upload_report"]


@dataclass(frozen=True)
class MemoryLayout:
    """The order of each memory: what moves, in slots of one size, before what stays.

    ========  ==========================================================================================
    nodes     where the instances of each slot begin; each slot's top-level tree; the meshes' trees
    lists     each slot's top-level lists; the meshes' lists
    matrices  each slot's instances; the triangles
    records   the globals; each slot's instances; triangles; materials; each slot's lights; smooth normals
    ========  ==========================================================================================

    Slot s has the instances from ``first_instance(s)`` on, by which number they are known in all memories. The nodes
    where they begin are roots of meshes, which stay; all else in a slot is of one frame.

    Parameters
    ----------
    num_slots : int
    num_instances : int
        Of a slot.
    top_nodes, top_entries : int
        Room in a slot for the top-level tree's nodes, an even number, and list entries.
    """

    num_slots: int
    num_instances: int
    top_nodes: int
    top_entries: int

    def first_instance(self, slot):
        """Number of the slot's first instance, and of its matrix and of the node where it begins."""
        return slot * self.num_instances

    def first_node(self, slot):
        """The slot's first top-level node."""
        begins = self.num_slots * self.num_instances
        return begins + begins % 2 + slot * self.top_nodes

    def first_entry(self, slot):
        """The slot's first top-level list entry."""
        return slot * self.top_entries

    @property
    def static_node(self):
        """First node that stays."""
        return self.first_node(self.num_slots)

    @property
    def static_entry(self):
        """First list entry that stays."""
        return self.first_entry(self.num_slots)

    @property
    def static_matrix(self):
        """First matrix that stays."""
        return self.first_instance(self.num_slots)


@dataclass(frozen=True, eq=False)
class Piece:
    """Items to be written to a memory.

    Parameters
    ----------
    memory : str
        Its name in :class:`~sim.scene.image.SceneImage`.
    first : int
        The first item's number.
    items : uint32[N] or uint32[N, W]
    """

    memory: str
    first: int
    items: np.ndarray


@dataclass(frozen=True, eq=False)
class SceneUpdate:
    """All that is new in a frame.

    Parameters
    ----------
    slot : int
        Where it goes.
    root : int
    center : float64[3]
    scale : float
    stack_depth : int
        As of the frame's :class:`~sim.scene.image.SceneImage`.
    ahead : tuple of Piece
        What lies in the slot, and so may be written while the other slot's frame is drawn.
    is_cut : bool
        The top-level tree is shallower than it would be with more room.
    between : tuple of Piece
        What both slots share, and so must be written when the last frame is done and before this one begins: the
        record that tells where the lights are.
    """

    slot: int
    root: int
    center: np.ndarray
    scale: float
    stack_depth: int
    ahead: tuple
    is_cut: bool
    between: tuple = ()

    @property
    def bytes_ahead(self):
        """Bytes of each memory that are written while the last frame is drawn."""
        return _bytes(self.ahead)

    @property
    def bytes_between(self):
        """Bytes of each memory that are written between two frames."""
        return _bytes(self.between)


def upload_report(image, update=None, *, cycles=None, seconds=None):
    """What a frame's upload takes, for its report.

    Parameters
    ----------
    image : SceneImage
        The frame's.
    update : SceneUpdate, optional
        What made it of the last frame's; none for the first frame, for which all is uploaded.
    cycles : int, optional
        That the chip was busy with the last frame.
    seconds : float, optional
        That the host took to make the update.

    Returns
    -------
    dict
        ``ahead`` and ``between``: bytes of each memory that are written while the last frame is drawn, and before this
        one begins; ``bytes``: of both; of an update also ``is_cut`` and ``host_seconds``; ``bytes_per_cycle``: how fast
        those ahead must be written to be there in time, if that is known.
    """
    if update is None:
        ahead, between = {}, image.bytes_of_memories
    else:
        ahead, between = update.bytes_ahead, update.bytes_between
    report = {"ahead": ahead, "between": between, "bytes": sum(ahead.values()) + sum(between.values())}
    if update is not None:
        report |= {"is_cut": update.is_cut, "host_seconds": seconds}
    if cycles is not None:
        report["bytes_per_cycle"] = sum(ahead.values()) / cycles
    return report


def _bytes(pieces):
    total = {}
    for piece in pieces:
        total[piece.memory] = total.get(piece.memory, 0) + piece.items.nbytes
    return total
