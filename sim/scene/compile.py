"""The scene compiler: from a scene to the chip's memory image."""

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from rtl.microcode import lane_width
from rtl.program.records import FIRST_MATRIX

from .error import SceneError
from .image import INSTANCE_ENTRY, SOLID_ENTRY, SceneImage, tree_words
from .parts import color_words, make_part
from .shading_image import frame_records, needed_features, num_lights, shading_records
from .slots import MemoryLayout, Piece, SceneUpdate
from .top_level import top_level, unit_box
from .triangles import pack_fields

__all__ = ["CompiledScene", "compile_scene"]

# Room in a slot for the top-level tree, over what the tree of the scene as compiled needs.
_HEADROOM = 2


@dataclass(frozen=True, eq=False)
class _Static:
    """An image in which nothing that moves is there yet."""

    layout: MemoryLayout
    background: tuple
    image: SceneImage
    first_light: int


def _check_number(name, number, most):
    if number > most:
        raise SceneError(f"scene needs {number:,} {name}, more than the {most:,} that the chip's memory addresses; "
                         "leave objects out or build a chip with a wider index_width")


def _even(number):
    return number + number % 2


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
    from_eye : bool
        Place instances as seen from the eye where it is known, not from the scene's middle: most bits are left to
        those nearby.

    Raises
    ------
    SceneError
        If the scene does not fit the format or the memory.
    """

    def __init__(self, scene, *, fmt, stack_depth=32, index_width=24, flatten=None, from_eye=True):
        self._scene = scene
        self._from_eye = from_eye
        self._fmt = fmt
        self._stack_depth = stack_depth
        self._index_width = index_width
        self.warnings = []
        if flatten is None:
            flatten = not scene.is_animated and len({i.mesh for i in scene.instances}) == len(scene.instances)
        self.is_flat = flatten
        self._colors = color_words(scene.materials)
        self._solid = np.array([material.alpha_mode == "opaque" and round(255 * material.transmission) == 0
                                for material in scene.materials])
        self._parts = []
        self._spaces = []
        self._shown = []
        self._kept = {}
        common = dict(fmt=fmt, stack_depth=stack_depth, warnings=self.warnings, solid=self._solid)
        if flatten:
            self.center, self.scale = unit_box(*scene.bounds())
            self._parts.append(self._flat_part(scene, common))
        else:
            for mesh in scene.meshes:
                self._parts.append(self._mesh_part(scene, mesh, common))
            self._shown = [number for number, placed in enumerate(scene.instances)
                           if self._parts[placed.mesh] is not None]
        if not any(self._parts):
            raise SceneError(f"nothing is left of the scene: no triangle has an area once its vertices are rounded to "
                             f"format {fmt}; choose a format with more bits")

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
        part = make_part("scene" if len(scene.instances) > 1 else scene.instances[0].name,
                          np.concatenate(corners), np.concatenate(instance), np.concatenate(prim),
                          np.concatenate(material), 1 / self.scale, **common)
        if part is None:
            return None
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
        center, scale = unit_box(*mesh.bounds())
        self._spaces.append((center, scale))
        corners = (mesh.vertices[mesh.triangles[usable]] - center) * scale
        # D′z shall be the cosine in the world; all instances of a mesh share a matrix, hence their mean size.
        return make_part(mesh.name, corners, np.full(len(usable), -1, np.int32), usable.astype(np.int32),
                          mesh.material_ids[usable], float(np.mean(scales)) / scale, **common)

    @cached_property
    def slots(self):
        """The :class:`~sim.scene.slots.MemoryLayout` with two slots: twice what the scene as compiled needs."""
        if self.is_flat:
            return MemoryLayout(2, 0, 0, 0)
        first, count = self._top_level(self._scene), len(self._shown)
        return MemoryLayout(2, count, _even(max(_HEADROOM * first.num_nodes, 2 * count)),
                            max(_HEADROOM * first.num_entries, 2 * count))

    @property
    def scene(self):
        """The Scene that was compiled."""
        return self._scene

    @property
    def needs(self):
        """The least :class:`~rtl.program.features.ShaderFeatures` that draw all that is in the scene."""
        return needed_features(self._scene, instances=not self.is_flat)

    def image(self, scene, *, eye=None, is_full=False, background=(0, 0, 0), slot=None):
        """The memory image with the instances where ``scene`` has them.

        Parameters
        ----------
        scene : Scene
            The scene that was compiled, or it at another time.
        eye : float64[3], optional
            Where the camera is. Full shading lights scenes without lights from there.
        is_full : bool
            Whether with the records of full shading, which wants an ``eye``, or for simple shading.
        background : tuple of int
            Of full shading: sRGB-encoded bytes that rays see that hit nothing.
        slot : int, optional
            0 or 1: an image in which what moves lies in that one of two slots, the other being empty, so that
            :meth:`update` can go on from there. Default: an image without slots.

        Raises
        ------
        SceneError
            If an instance's transform does not fit the format, the image does not fit the memory, or instances move
            of a scene that is flat.
        """
        top = self._top_level(scene, eye, slotted=slot is not None)
        layout = self.slots if slot is not None else MemoryLayout(
            1, len(self._shown), top.num_nodes if top else 0, top.num_entries if top else 0)
        static = self._static(layout, is_full, background)
        return static.image.updated(self._update(scene, top, static, slot or 0, eye))

    def update(self, scene, *, slot, eye=None, is_full=False):
        """What has to be uploaded for a frame, to a memory with an image that has slots.

        Parameters
        ----------
        scene, eye, is_full
            As for :meth:`image`.
        slot : int
            0 or 1; the frame that is being drawn has the other.

        Returns
        -------
        SceneUpdate

        Raises
        ------
        SceneError
            As :meth:`image`.
        """
        static = self._static(self.slots, is_full, None)
        return self._update(scene, self._top_level(scene, eye, slotted=True), static, slot, eye)

    def _top_level(self, scene, eye=None, *, slotted=False):
        """The frame's top level, None of a flat scene."""
        if self.is_flat:
            for before, now in zip(self._scene.instances, scene.instances, strict=True):
                if not np.allclose(before.transform, now.transform, rtol=1e-12, atol=1e-12):
                    raise SceneError(f"instance '{now.name}' moves, but the scene is flat: all triangles lie in one "
                                     "space; compile it with flatten=False (dynrt: --instances)")
            return None
        room = (self.slots.top_nodes, self.slots.top_entries) if slotted else None
        return top_level(scene, shown=self._shown, boxes=[part and part.box for part in self._parts],
                         spaces=self._spaces, fmt=self._fmt, max_depth=self._stack_depth,
                         center=np.asarray(eye, np.float64) if self._from_eye and eye is not None else None, room=room)

    def _update(self, scene, top, static, slot, eye):
        layout, ahead, between = static.layout, [], []
        center, scale, maps = (self.center, self.scale, np.empty((0, 4, 3))) if top is None else (
            top.center, top.scale, top.maps)
        if top is not None:
            first = layout.first_instance(slot)
            nodes, entries = tree_words(
                top.tree, fmt=self._fmt, first_node=layout.first_node(slot), first_entry=layout.first_entry(slot),
                items=top.tree.items + first, kinds=INSTANCE_ENTRY)
            fields = self._fmt.encode(maps).reshape(-1, 12)
            ahead += [Piece("nodes", layout.first_node(slot), nodes),
                      Piece("lists", layout.first_entry(slot), entries),
                      Piece("matrices", first, pack_fields(fields, self._fmt.width))]
        if static.image.records is not None:
            if eye is None:
                raise ValueError("full shading needs the eye")
            count = num_lights(scene)
            if count != num_lights(self._scene):
                raise SceneError(f"scene has {count} lights, but had {num_lights(self._scene)} when it was compiled; "
                                 "compile it anew")
            first_light = static.first_light + slot * count
            records = frame_records(scene, fmt=self._fmt, center=center, scale=scale, maps=maps,
                                    first_light=first_light, eye=eye)
            instances, lights, about = (pack_fields(fields, lane_width(self._fmt)) for fields in records)
            if len(instances):
                ahead.append(Piece("records", FIRST_MATRIX + layout.first_instance(slot), instances))
            ahead.append(Piece("records", first_light, lights))
            between.append(Piece("records", 0, about))
        depths = [part.tree.max_depth for part in self._parts if part is not None]
        return SceneUpdate(
            slot=slot, root=layout.static_node if top is None else layout.first_node(slot), center=center,
            scale=scale, stack_depth=max(depths + ([] if top is None else [top.tree.max_depth])),
            ahead=tuple(ahead), is_cut=top is not None and top.is_cut, between=tuple(between))

    def _static(self, layout, is_full, background):
        """All that does not move; of memories with slots kept, as it is wanted again for each frame."""
        known = self._kept.get(is_full)
        if known and known.layout == layout and background in (None, known.background):
            return known
        static = self._make_static(layout, is_full, background or (0, 0, 0))
        if layout.num_slots > 1:
            self._kept[is_full] = static
        return static

    def _make_static(self, layout, is_full, background):
        fmt, count = self._fmt, layout.static_matrix
        node_words, list_words = [np.zeros((layout.static_node, 2), np.uint32)], [
            np.zeros(layout.static_entry, np.uint32)]
        matrices, shading = [np.zeros((count, 4, 3))], [np.zeros(count, np.uint32)]
        of_instance, of_prim = [np.full(count, -1, np.int32)], [np.full(count, -1, np.int32)]
        firsts = [np.zeros(count, np.int8)]
        first_node, first_entry, first_matrix = layout.static_node, layout.static_entry, layout.static_matrix
        roots, shaded = {}, []
        for number, part in enumerate(self._parts):
            if part is None:
                continue
            # Matrices in the order in which leaves name them first: what is tested together lies together.
            order, first = np.unique(part.tree.items, return_index=True)
            order = order[np.argsort(first)]
            place = np.full(len(part.corners), -1, np.int64)
            place[order] = np.arange(len(order))
            nodes, entries = tree_words(
                part.tree, fmt=fmt, first_node=first_node, first_entry=first_entry,
                items=place[part.tree.items] + first_matrix,
                kinds=np.where(self._solid[part.material], SOLID_ENTRY, 0)[part.tree.items])
            roots[number] = nodes[0]
            node_words.append(nodes)
            list_words.append(entries)
            shaded += self._shaded(number, order, first_matrix)
            matrices.append(np.concatenate([part.rows[order], part.centers[order, None]], axis=1))
            shading.append(self._colors[part.material[order]])
            of_instance.append(part.instance[order])
            of_prim.append(part.prim[order])
            firsts.append(part.first[order])
            first_node, first_entry, first_matrix = (
                first_node + len(nodes), first_entry + len(entries), first_matrix + len(order))
        for slot in range(layout.num_slots):
            for instance, number in enumerate(self._shown, layout.first_instance(slot)):
                node_words[0][instance] = roots[self._scene.instances[number].mesh]
        nodes, lists = np.concatenate(node_words), np.concatenate(list_words)
        fields = fmt.encode(np.concatenate(matrices)).reshape(-1, 12)
        limit = 1 << self._index_width
        # The last number stands for no triangle.
        for name, words, most in (("kd-tree nodes", nodes, limit), ("list entries", lists, limit),
                                  ("matrices", fields, limit - 1)):
            _check_number(name, len(words), most)
        image = SceneImage(
            fmt=fmt, root=0, nodes=nodes, lists=lists, matrices=pack_fields(fields, fmt.width),
            shading=np.concatenate(shading), num_instances=count, stack_depth=0,
            triangle_instance=np.concatenate(of_instance), triangle_prim=np.concatenate(of_prim),
            triangle_first=np.concatenate(firsts),
            instance_ids=np.tile(np.array(self._shown, np.int32), layout.num_slots), center=np.zeros(3), scale=1.0,
            stats={"nodes": len(nodes), "list_entries": len(lists), "matrices": len(fields)})
        if not is_full:
            return _Static(layout, background, image, 0)
        records, texels, first_light = shading_records(self._scene, image, parts=shaded, background=background,
                                                       num_slots=layout.num_slots)
        for name, words in (("records of shading", records), ("texels", texels)):
            _check_number(name, len(words), limit)
        image = replace(image, records=pack_fields(records, lane_width(fmt)), texels=texels,
                        needs=self.needs,
                        stats={**image.stats, "records": len(records), "texels": len(texels)})
        return _Static(layout, background, image, first_light)

    def _shaded(self, number, order, first_matrix):
        """What :func:`~.shading_image.shading_records` wants to know of a part's triangles."""
        part, numbers, scene = self._parts[number], first_matrix + np.arange(len(order)), self._scene
        if not self.is_flat:
            return [(scene.meshes[number], numbers, part.prim[order], part.first[order], part.sign[order], None)]
        of = part.instance[order]
        return [(scene.meshes[placed.mesh], numbers[of == k],
                 *(values[order][of == k] for values in (part.prim, part.first, part.sign)), placed.transform[:, :3])
                for k, placed in enumerate(scene.instances)]


def compile_scene(scene, *, eye=None, **options):
    """The memory image of a scene that stands still: :class:`CompiledScene` and its image in one."""
    compiled = CompiledScene(scene, **options)
    image = compiled.image(scene, eye=eye)
    scene.warnings.extend(compiled.warnings)
    return image
