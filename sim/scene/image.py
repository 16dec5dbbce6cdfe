"""The memory image: what the chip reads, word by word.

All memories are arrays of little-endian 32-bit words, addressed by items:

========  =====  =================================================================================================
memory    words  item
========  =====  =================================================================================================
nodes     2      bits 0–23 child, 24–25 axis (3: leaf), 26 lower child is empty, 27 upper child is empty; 32–… split
                 position as a float. Inner node: children are ``child`` (even) and ``child`` + 1. Leaf: ``child`` is
                 the first list entry. Nodes 0…n − 1 are where the n instances begin, each a copy of its mesh's root.
lists     1      bits 0–23 matrix number, 29 no light gets through, 30 it is an instance, 31 last of its leaf
matrices  ⌈12·w  rows 0, 1, 2 of m (x, y, z each), then C: twelve floats of w bits, packed without gaps. Matrices
          ÷ 32⌉  0…n − 1 are those of the n instances, the others those of triangles.
shading   1      of the triangle with that matrix number: bits 0–7 blue, 8–15 green, 16–23 red
records   ⌈12·w  of full shading, instead: twelve lanes of w = max(bits of a float, 24) bits, packed likewise; see
          ÷ 32⌉  rtl/program/records.py
texels    1      of full shading: see :mod:`sim.scene.texels`
========  =====  =================================================================================================

Their order is that of :class:`~sim.scene.slots.MemoryLayout`. With two slots the n instances are those of both, so that
whoever draws need not know of slots.
"""

import zlib
from dataclasses import dataclass, field, replace

import numpy as np

from fpu import FloatFormat
from rtl.microcode import lane_width
from rtl.program.features import ShaderFeatures

from .kdtree import LEAF
from .triangles import unpack_fields, weights

__all__ = ["SceneImage", "describe", "tree_words"]

AXIS_SHIFT, LOWER_EMPTY, UPPER_EMPTY = 24, 1 << 26, 1 << 27
INDEX_MASK = (1 << 24) - 1
SOLID_ENTRY, INSTANCE_ENTRY, LAST_ENTRY = 1 << 29, 1 << 30, 1 << 31


@dataclass(frozen=True, eq=False)
class SceneImage:
    """A scene as the chip sees it, and what the host needs to understand the chip's answers.

    Parameters
    ----------
    fmt : FloatFormat
        Format of all floats.
    root : int
        Node at which primary rays begin.
    nodes : uint32[N, 2]
    lists : uint32[L]
    matrices : uint32[M, W]
    shading : uint32[M]
        The memories, see the module's text.
    num_instances : int
        Instances that are transformed on the chip; 0 if all triangles are in the scene's own space.
    stack_depth : int
        Entries a traversal stack needs at most.
    triangle_instance, triangle_prim : int32[M]
        The triangle of each matrix; its instance is −1 if the chip tells it.
    triangle_first : int8[M]
        The corner of it, in its mesh, that is at u = v = 0.
    instance_ids : int32[num_instances]
        The scene's instance that is the chip's n-th.
    center : float64[3]
    scale : float
        The chip's scene coordinates are (world − center) · scale.
    stats : dict
        Counts for reports.
    records : uint32[R, W], optional
    texels : uint32[K], optional
        The memories of full shading.
    needs : ShaderFeatures, optional
        The least that draws all that is in the scene.
    """

    fmt: FloatFormat
    root: int
    nodes: np.ndarray
    lists: np.ndarray
    matrices: np.ndarray
    shading: np.ndarray
    num_instances: int
    stack_depth: int
    triangle_instance: np.ndarray
    triangle_prim: np.ndarray
    triangle_first: np.ndarray
    instance_ids: np.ndarray
    center: np.ndarray
    scale: float
    stats: dict = field(default_factory=dict)
    records: np.ndarray | None = None
    texels: np.ndarray | None = None
    needs: ShaderFeatures | None = None

    def updated(self, update):
        """The image with what a :class:`~sim.scene.slots.SceneUpdate` brings; what does not change is shared."""
        memories = {}
        for piece in (*update.ahead, *update.between):
            if piece.memory not in memories:
                memories[piece.memory] = getattr(self, piece.memory).copy()
            memories[piece.memory][piece.first:piece.first + len(piece.items)] = piece.items
        return replace(self, **memories, root=update.root, center=update.center, scale=update.scale,
                       stack_depth=update.stack_depth)

    def _memories(self):
        names = "nodes", "lists", "matrices", *(("shading",) if self.records is None else ("records", "texels"))
        return {name: getattr(self, name) for name in names}

    @property
    def bytes_of_memories(self):
        """Size of each memory."""
        return {name: memory.nbytes for name, memory in self._memories().items()}

    @property
    def num_bytes(self):
        """Size of all memories together."""
        return sum(self.bytes_of_memories.values())

    @property
    def index_width(self):
        """Bits of an item's number in the largest memory; all ones, which stands for no triangle, is none's."""
        largest = max(len(memory) for memory in self._memories().values())
        return max((largest - 1).bit_length(), len(self.matrices).bit_length())

    @property
    def checksum(self):
        """CRC-32 of all memories."""
        crc = 0
        for memory in self._memories().values():
            crc = zlib.crc32(memory.astype("<u4").tobytes(), crc)
        return crc

    def owners(self, triangle, instance):
        """The scene's ``instance_id`` and ``prim_id`` of the chip's triangle and instance (−1: none) numbers."""
        known = self.triangle_instance[triangle]
        told = np.append(self.instance_ids, -1)[instance]
        return np.where(known >= 0, known, told), self.triangle_prim[triangle]

    def weights(self, triangle, u, v):
        """The weights of v1 and v2 in the mesh at the chip's u and v on its triangles."""
        return weights(self.triangle_first[triangle], u, v)

    def matrix_values(self):
        """float64[M, 4, 3]: the three rows and C of each matrix."""
        return self.fmt.decode(unpack_fields(self.matrices, self.fmt.width)).reshape(-1, 4, 3)

    def record_lanes(self):
        """Lanes of the records: as floats float64[R, 12], and as integers int64[R, 12]."""
        fields = unpack_fields(self.records, lane_width(self.fmt))
        return self.fmt.decode(fields & (1 << self.fmt.width) - 1), fields

    def split_values(self):
        """float64[N]: the split position of each node."""
        return self.fmt.decode(self.nodes[:, 1])


def tree_words(tree, *, fmt, first_node, first_entry, items, kinds):
    """Words of a tree in memory.

    Parameters
    ----------
    tree : KdTree
    fmt : FloatFormat
    first_node, first_entry : int
        Where its nodes and its leaves' lists go.
    items : int[K]
        Matrix numbers of the leaves' primitives.
    kinds : int or int[K]
        Their bits of a list entry.

    Returns
    -------
    nodes : uint32[N, 2]
        An even number of them, as those that follow are in pairs too.
    entries : uint32[K]
    """
    inner = tree.axis != LEAF
    empty = ~inner & (tree.count == 0)
    child = np.where(inner, tree.child + first_node, tree.child + first_entry).astype(np.int64)
    lower = np.where(inner, tree.child, 0)
    words = child & INDEX_MASK | tree.axis.astype(np.int64) << AXIS_SHIFT
    words |= np.where(inner & empty[lower], LOWER_EMPTY, 0)
    words |= np.where(inner & empty[np.minimum(lower + 1, len(empty) - 1)], UPPER_EMPTY, 0)
    nodes = np.stack([words, fmt.encode(np.where(inner, tree.split, 0.0))], axis=1).astype(np.uint32)
    if len(nodes) % 2:
        nodes = np.concatenate([nodes, np.zeros((1, 2), np.uint32)])
    entries = items.astype(np.int64) | kinds
    entries[(tree.child + tree.count - 1)[~inner & ~empty]] |= LAST_ENTRY
    return nodes, entries.astype(np.uint32)


def describe(image, *, limit=20):
    """Lines that print an image, the first ``limit`` items of each memory."""
    yield (f"format {image.fmt}, {image.num_bytes:,} bytes, CRC-32 {image.checksum:08x}, root {image.root}, "
           f"{image.num_instances} instances, stack {image.stack_depth}")
    yield f"world to scene: (x - {image.center.tolist()}) * {image.scale:g}"
    splits = image.split_values()
    yield f"nodes: {len(image.nodes)}"
    for number, (word, _) in enumerate(image.nodes[:limit].tolist()):
        axis, child = word >> AXIS_SHIFT & 3, word & INDEX_MASK
        if axis == LEAF:
            yield f"  {number:8d}  leaf    list {child}"
        else:
            empty = "".join(f", {name} empty" for name, bit in (("lower", LOWER_EMPTY), ("upper", UPPER_EMPTY))
                            if word & bit)
            yield f"  {number:8d}  {'xyz'[axis]} {splits[number]:<12.6g} children {child}, {child + 1}{empty}"
    yield f"lists: {len(image.lists)}"
    for number, word in enumerate(image.lists[:limit].tolist()):
        kind = "instance" if word & INSTANCE_ENTRY else "triangle"
        yield f"  {number:8d}  {kind} {word & INDEX_MASK}{', last' if word & LAST_ENTRY else ''}"
    yield f"matrices: {len(image.matrices)}"
    for number, matrix in enumerate(image.matrix_values()[:limit]):
        rows = "  ".join("[" + " ".join(f"{value:.6g}" for value in row) + "]" for row in matrix)
        yield f"  {number:8d}  {rows}"
    yield f"shading: {len(image.shading)}"
    for number, word in enumerate(image.shading[:limit].tolist()):
        yield f"  {number:8d}  #{word & 0xFFFFFF:06x}"
