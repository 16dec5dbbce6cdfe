"""The scene compiler: from a scene to the chip's memory image."""

import math
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from rtl.microcode import lane_width

from .error import SceneError
from .image import AXIS_SHIFT, INDEX_MASK, INSTANCE_ENTRY, LAST_ENTRY, LOWER_EMPTY, SOLID_ENTRY, UPPER_EMPTY, SceneImage
from .kdtree import LEAF, build_kdtree
from .shading_image import needed_features, shading_records
from .triangles import pack_fields, unit_triangle_maps

__all__ = ["CompiledScene", "compile_scene"]

# Bounds are widened by so many units in the last place of 1, the order of all coordinates: the error of
# t = (split − O) / D for rays that come from about as far as the scene is wide.
_PAD_ULP = 2

# Cost of one more primitive in a leaf when a kd-step costs 1. The units work side by side, so what counts is that
# none waits for another, not the five cycles that a triangle takes in the transformation.
_TRIANGLE_COST = 2.0
_INSTANCE_COST = 25.0

# Part of the cost taken off a split that cuts off empty space: the best of 0.05…0.4 over room, simple room and
# conference; greater ones give fewer but far fuller leaves.
_EMPTY_BONUS = 0.1


@dataclass(frozen=True, eq=False)
class _Part:
    """A mesh, or all meshes of a flattened scene, in coordinates of order 1."""

    name: str
    corners: np.ndarray
    instance: np.ndarray
    prim: np.ndarray
    material: np.ndarray
    rows: np.ndarray
    centers: np.ndarray
    tree: object

    @cached_property
    def box(self):
        """float64[2, 3]: lower and upper bounds."""
        return np.array([self.corners.min(axis=(0, 1)), self.corners.max(axis=(0, 1))])


def _unit_box(lower, upper):
    """Center, and the power of two that brings the box within [−1, 1]; so scaling is exact."""
    half = float(np.max(upper - lower)) / 2
    return (lower + upper) / 2, 2.0 ** -math.ceil(math.log2(half)) if half > 0 else 1.0


def _color_words(materials):
    linear = np.clip([material.base_color for material in materials], 0.0, 1.0)
    encoded = np.where(linear <= 0.0031308, 12.92 * linear, 1.055 * linear ** (1 / 2.4) - 0.055)
    red, green, blue = np.rint(255 * encoded).astype(np.uint32).T
    return red << 16 | green << 8 | blue


def _make_part(name, corners, instance, prim, material, normal_scale, *, fmt, stack_depth, warnings):
    corners = fmt.quantize(corners)
    rows, centers, usable = unit_triangle_maps(corners, normal_scale=normal_scale)
    if not usable.all():
        warnings.append(f"mesh '{name}': {np.count_nonzero(~usable)} triangles dropped that have no area once their "
                        f"vertices are rounded to format {fmt}")
    corners, instance, prim, material, rows, centers = (
        array[usable] for array in (corners, instance, prim, material, rows, centers))
    overflow = ~np.isfinite(fmt.quantize(rows)).all(axis=(1, 2))
    if overflow.any():
        worst = np.flatnonzero(overflow)[0]
        raise SceneError(f"mesh '{name}', triangle {prim[worst]}: its transform has values up to "
                         f"{np.abs(rows[worst]).max():.3g}, beyond {fmt.max:.3g}, the largest of format {fmt}; "
                         f"choose a format with more exponent bits ({overflow.sum()} such triangles)")
    tree = build_kdtree(corners.min(axis=1), corners.max(axis=1), triangles=corners, frac_width=fmt.frac_width,
                        min_normal=fmt.min_normal, pad=_PAD_ULP * 2.0 ** -fmt.frac_width,
                        intersection_cost=_TRIANGLE_COST, empty_bonus=_EMPTY_BONUS, max_depth=stack_depth)
    return _Part(name, corners, instance, prim, material, rows, centers, tree)


class CompiledScene:
    """A scene's parts with their trees and matrices, which stay while instances move.

    Parameters
    ----------
    scene : Scene
        The scene.
    fmt : FloatFormat
        The chip's format.
    stack_depth : int
        Entries of the chip's stack a level, which bounds the trees' depth.
    index_width : int
        Bits of a node's, list entry's or matrix's number.
    flatten : bool or None
        Put all triangles into the scene's own space, so that no ray needs to be transformed into an instance.
        Default: if nothing moves and no mesh is there twice.

    Raises
    ------
    SceneError
        If the scene does not fit the format or the memory.
    """

    def __init__(self, scene, *, fmt, stack_depth=32, index_width=24, flatten=None):
        self._fmt = fmt
        self._stack_depth = stack_depth
        self._index_width = index_width
        self.warnings = []
        if flatten is None:
            flatten = not scene.is_animated and len({i.mesh for i in scene.instances}) == len(scene.instances)
        self.is_flat = flatten
        self._colors = _color_words(scene.materials)
        self._solid = np.array([material.alpha_mode == "opaque" and round(255 * material.transmission) == 0
                                for material in scene.materials])
        self._parts = []
        self._spaces = []
        common = dict(fmt=fmt, stack_depth=stack_depth, warnings=self.warnings)
        if flatten:
            self.center, self.scale = _unit_box(*scene.bounds())
            self._parts.append(self._flat_part(scene, common))
        else:
            for mesh in scene.meshes:
                self._parts.append(self._mesh_part(scene, mesh, common))

    def _flat_part(self, scene, common):
        corners, instance, prim, material = [], [], [], []
        for number, placed in enumerate(scene.instances):
            mesh = scene.meshes[placed.mesh]
            linear, offset = placed.transform[:, :3], placed.transform[:, 3]
            usable = np.flatnonzero(mesh.usable)
            world = mesh.vertices[mesh.triangles[usable]] @ linear.T + offset
            corners.append((world - self.center) * self.scale)
            instance.append(np.full(len(usable), number, np.int32))
            prim.append(usable.astype(np.int32))
            material.append(mesh.material_ids[usable])
        part = _make_part("scene" if len(scene.instances) > 1 else scene.instances[0].name,
                          np.concatenate(corners), np.concatenate(instance), np.concatenate(prim),
                          np.concatenate(material), 1 / self.scale, **common)
        # The front of a triangle is where it is in its mesh's space.
        mirrored = np.array([np.linalg.det(placed.transform[:, :3]) < 0 for placed in scene.instances])
        part.rows[mirrored[part.instance], 2] *= -1
        return part

    def _mesh_part(self, scene, mesh, common):
        usable = np.flatnonzero(mesh.usable)
        scales = [abs(np.linalg.det(placed.transform[:, :3])) ** (1 / 3) for placed in scene.instances
                  if scene.meshes[placed.mesh] is mesh]
        if not len(usable) or not scales:
            self._spaces.append(None)
            return None
        center, scale = _unit_box(*mesh.bounds())
        self._spaces.append((center, scale))
        corners = (mesh.vertices[mesh.triangles[usable]] - center) * scale
        # D′z shall be the cosine in the world; all instances of a mesh share a matrix, hence their mean size.
        return _make_part(mesh.name, corners, np.full(len(usable), -1, np.int32), usable.astype(np.int32),
                          mesh.material_ids[usable], float(np.mean(scales)) / scale, **common)

    def image(self, scene, *, eye=None, background=(0, 0, 0)):
        """The memory image with the instances where ``scene`` has them.

        Parameters
        ----------
        scene : Scene
            The scene that was compiled, or it at another time.
        eye : float64[3], optional
            Where the camera is, for an image with the records of full shading: a scene without lights is lit from
            there.
        background : tuple of int
            Of full shading: sRGB-encoded bytes that rays see that hit nothing.

        Raises
        ------
        SceneError
            If an instance's transform does not fit the format, or the image the memory.
        """
        fmt = self._fmt
        shown = [] if self.is_flat else [
            number for number, placed in enumerate(scene.instances) if self._parts[placed.mesh] is not None]
        num_instances = len(shown)
        first_tree = num_instances + num_instances % 2
        node_words, list_words, bases = [], [], []
        node_base, list_base = first_tree, 0
        matrix_base = num_instances
        matrices, shading, of_instance, of_prim, shaded = [], [], [], [], []
        if self.is_flat:
            center, scale = self.center, self.scale
        else:
            center, scale = _unit_box(*scene.bounds())
            instance_maps, boxes = self._place(scene, shown, center, scale)
            matrices.append(instance_maps)
            shading.append(np.zeros(num_instances, np.uint32))
            of_instance.append(np.full(num_instances, -1, np.int32))
            of_prim.append(np.full(num_instances, -1, np.int32))
            top = build_kdtree(boxes[:, 0], boxes[:, 1], frac_width=fmt.frac_width, min_normal=fmt.min_normal,
                               pad=_PAD_ULP * 2.0 ** -fmt.frac_width, intersection_cost=_INSTANCE_COST,
                               empty_bonus=_EMPTY_BONUS, max_depth=self._stack_depth)
            nodes, entries = self._tree_words(top, node_base, list_base, INSTANCE_ENTRY, None, 0)
            node_words.append(nodes)
            list_words.append(entries)
            node_base += len(nodes)
            list_base += len(entries)
        for number, part in enumerate(self._parts):
            bases.append(node_base)
            if part is None:
                continue
            # Matrices in the order in which leaves name them first: what is tested together lies together.
            order, first = np.unique(part.tree.items, return_index=True)
            order = order[np.argsort(first)]
            place = np.full(len(part.corners), -1, np.int64)
            place[order] = np.arange(len(order))
            kinds = np.where(self._solid[part.material], SOLID_ENTRY, 0)[part.tree.items]
            nodes, entries = self._tree_words(part.tree, node_base, list_base, kinds, place, matrix_base)
            node_words.append(nodes)
            list_words.append(entries)
            node_base += len(nodes)
            list_base += len(entries)
            shaded += self._shaded(scene, number, order, matrix_base)
            matrix_base += len(order)
            matrices.append(np.concatenate([part.rows[order], part.centers[order, None]], axis=1))
            shading.append(self._colors[part.material[order]])
            of_instance.append(part.instance[order])
            of_prim.append(part.prim[order])
        starts = np.zeros((first_tree, 2), np.uint32)
        by_base = dict(zip(bases, [words for words in node_words[0 if self.is_flat else 1:]], strict=False))
        for slot, number in enumerate(shown):
            starts[slot] = by_base[bases[scene.instances[number].mesh]][0]
        nodes = np.concatenate([starts, *node_words])
        lists = np.concatenate(list_words)
        fields = fmt.encode(np.concatenate(matrices)).reshape(-1, 12)
        limit = 1 << self._index_width
        for name, count in (("kd-tree nodes", len(nodes)), ("list entries", len(lists)), ("matrices", len(fields))):
            if count > limit:
                raise SceneError(f"scene needs {count:,} {name}, more than the {limit:,} that the chip's memory "
                                 f"addresses; leave objects out or build a chip with a wider index_width")
        image = SceneImage(
            fmt=fmt, root=first_tree, nodes=nodes, lists=lists, matrices=pack_fields(fields, fmt.width),
            shading=np.concatenate(shading), num_instances=num_instances,
            stack_depth=max([part.tree.max_depth for part in self._parts if part is not None]
                            + ([] if self.is_flat else [top.max_depth])),
            triangle_instance=np.concatenate(of_instance), triangle_prim=np.concatenate(of_prim),
            instance_ids=np.array(shown, np.int32), center=center, scale=scale,
            stats={"nodes": len(nodes), "list_entries": len(lists), "matrices": len(fields)})
        if eye is None:
            return image
        records, texels = shading_records(scene, image, parts=shaded, eye=eye, background=background)
        return replace(image, records=pack_fields(records, lane_width(fmt)), texels=texels,
                       needs=needed_features(scene, instances=not self.is_flat),
                       stats={**image.stats, "records": len(records), "texels": len(texels)})

    def _shaded(self, scene, number, order, matrix_base):
        """What :func:`~.shading_image.shading_records` wants to know of a part's triangles."""
        part, numbers = self._parts[number], matrix_base + np.arange(len(order))
        if not self.is_flat:
            return [(scene.meshes[number], numbers, part.prim[order], None)]
        of = part.instance[order]
        return [(scene.meshes[placed.mesh], numbers[of == k], part.prim[order][of == k], placed.transform[:, :3])
                for k, placed in enumerate(scene.instances)]

    def _place(self, scene, shown, center, scale):
        """Matrices of instances from the scene's into their meshes' space, and their boxes in the scene's."""
        fmt = self._fmt
        maps, boxes = np.empty((len(shown), 4, 3)), np.empty((len(shown), 2, 3))
        for slot, number in enumerate(shown):
            placed = scene.instances[number]
            part = self._parts[placed.mesh]
            mesh_center, mesh_scale = self._spaces[placed.mesh]
            linear = placed.transform[:, :3]
            middle = (linear @ mesh_center + placed.transform[:, 3] - center) * scale
            inverse = np.linalg.inv(linear) * (mesh_scale / scale)
            maps[slot, :3] = fmt.quantize(inverse)
            maps[slot, 3] = fmt.quantize(middle)
            if not np.isfinite(maps[slot]).all() or np.linalg.matrix_rank(maps[slot, :3]) < 3:
                raise SceneError(f"instance '{placed.name}': its transform does not fit format {fmt}, whose values "
                                 f"are from {fmt.min_normal:.3g} to {fmt.max:.3g}; choose a format with more exponent "
                                 "bits, or scale the instance less")
            # The chip's map is the rounded one, so the box is that of its inverse.
            which = np.indices((2, 2, 2)).reshape(3, 8).T
            world = np.take_along_axis(part.box, which, axis=0) @ np.linalg.inv(maps[slot, :3]).T + maps[slot, 3]
            # What the transformed ray is off by in the mesh's space, seen from the scene's.
            slack = 4 * 2.0 ** -fmt.frac_width * np.abs(world - maps[slot, 3]).max()
            boxes[slot] = world.min(axis=0) - slack, world.max(axis=0) + slack
        return maps, boxes

    def _tree_words(self, tree, node_base, list_base, entry_kind, place, matrix_base):
        """Words of a tree's nodes and of its leaves' lists."""
        inner = tree.axis != LEAF
        empty = ~inner & (tree.count == 0)
        child = np.where(inner, tree.child + node_base, tree.child + list_base).astype(np.int64)
        lower = np.where(inner, tree.child, 0)
        words = child & INDEX_MASK | tree.axis.astype(np.int64) << AXIS_SHIFT
        words |= np.where(inner & empty[lower], LOWER_EMPTY, 0)
        words |= np.where(inner & empty[np.minimum(lower + 1, len(empty) - 1)], UPPER_EMPTY, 0)
        nodes = np.stack([words, self._fmt.encode(np.where(inner, tree.split, 0.0))], axis=1).astype(np.uint32)
        if len(nodes) % 2:
            nodes = np.concatenate([nodes, np.zeros((1, 2), np.uint32)])
        entries = (tree.items if place is None else place[tree.items]).astype(np.int64) + matrix_base
        entries |= entry_kind
        ends = (tree.child + tree.count - 1)[~inner & ~empty]
        entries[ends] |= LAST_ENTRY
        return nodes, entries.astype(np.uint32)


def compile_scene(scene, **options):
    """The memory image of a scene that stands still: :class:`CompiledScene` and its image in one."""
    compiled = CompiledScene(scene, **options)
    image = compiled.image(scene)
    scene.warnings.extend(compiled.warnings)
    return image
