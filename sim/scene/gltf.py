"""glTF 2.0: meshes, node hierarchy with instances, cameras and node animations.

The file is read with ``json`` and numpy alone, so that each message can name the element at fault.
"""

import math
from pathlib import Path

import numpy as np

from .accessors import Accessors
from .animation import Animation, CameraNode, Channel, Node, pose_nodes
from .gltf_json import read_gltf_file
from .gltf_light import LIGHT_EXTENSIONS, light_nodes
from .gltf_material import MATERIAL_EXTENSIONS, GltfMaterials
from .scene import DEFAULT_MATERIAL, Instance, Mesh, Scene

__all__ = ["load_gltf"]

_MODES = ("points", "lines", "line loop", "line strip", "triangles", "triangle strip", "triangle fan")
_PATHS = {"translation": "VEC3", "rotation": "VEC4", "scale": "VEC3"}
_NOT_DRAWN = {"COLOR_0": "vertex colours (COLOR_0)", "JOINTS_0": "skins (JOINTS_0)", "targets": "morph targets"}
# glTF leaves the picture's shape to the viewer: where a camera gives none, ours is that of the default
# picture.
_DEFAULT_ASPECT = 4 / 3


def _triangles(mode, index):
    """Corner numbers int64[T, 3] of a primitive of mode 4, 5 or 6."""
    if mode == 4:
        return index[:len(index) // 3 * 3].reshape(-1, 3)
    if len(index) < 3:
        return np.zeros((0, 3), np.int64)
    if mode == 6:
        return np.stack([np.full(len(index) - 2, index[0]), index[1:-1], index[2:]], axis=1)
    strip = np.stack([index[:-2], index[1:-1], index[2:]], axis=1)
    strip[1::2] = strip[1::2, [1, 0, 2]]
    return strip


def _primitive(primitive, accessors, warnings):
    """(positions, triangles, normals, uvs) of a mesh's part, or None if it has no triangles to trace."""
    mode = primitive.whole("mode", 4)
    if mode not in (4, 5, 6):
        name = _MODES[mode] if mode < len(_MODES) else "unknown"
        warnings.append(f"{primitive.place}: mode {mode} ({name}) is not supported; left out")
        return None
    attributes = primitive.child("attributes")
    if attributes is None or "POSITION" not in attributes.data:
        warnings.append(f"{primitive.place}: has no POSITION; left out")
        return None

    for key, what in _NOT_DRAWN.items():
        text = f"{what} cannot be drawn; left out"
        if (key in attributes.data or key in primitive.data) and text not in warnings:
            warnings.append(text)

    def attribute(key, kind):
        if key not in attributes.data:
            return None
        values = accessors.read(attributes.refer(key, "accessors"), (kind,))
        if len(values) != len(positions):
            raise attributes.error(f"{key} has {len(values)} elements, POSITION {len(positions)}")
        return values[triangles]

    positions = accessors.read(attributes.refer("POSITION", "accessors"), ("VEC3",))
    if "indices" in primitive.data:
        index = accessors.read(primitive.refer("indices", "accessors"), ("SCALAR",), as_index=True)
        if len(index) and index.max() >= len(positions):
            raise primitive.error(f"vertex index {index.max()} is out of range; there are {len(positions)} vertices")
    else:
        index = np.arange(len(positions))
    triangles = _triangles(mode, index)
    return positions, triangles, attribute("NORMAL", "VEC3"), attribute("TEXCOORD_0", "VEC2")


def _joined(parts):
    """Corner attributes of all parts, zero where a part has none; None if no part has one."""
    width = next((part[1].shape[2] for part in parts if part[1] is not None), None)
    if width is None:
        return None
    return np.concatenate([np.zeros((num, 3, width)) if values is None else values for num, values in parts])


def _mesh(mesh, accessors, warnings):
    positions, triangles, material_ids, normals, uvs = [], [], [], [], []
    num_vertices = 0
    for primitive in mesh.list("primitives"):
        part = _primitive(primitive, accessors, warnings)
        if part is None:
            continue
        positions.append(part[0])
        triangles.append(part[1] + num_vertices)
        material = primitive.index("material", "materials", None)
        material_ids.append(np.full(len(part[1]), 0 if material is None else 1 + material, np.int32))
        normals.append((len(part[1]), part[2]))
        uvs.append((len(part[1]), part[3]))
        num_vertices += len(part[0])
    name = mesh.text("name", mesh.place)
    if not positions:
        return Mesh(name, np.zeros((0, 3)), np.zeros((0, 3), np.int32), np.zeros(0, np.int32))
    return Mesh(name, np.concatenate(positions), np.concatenate(triangles).astype(np.int32),
                np.concatenate(material_ids), normals=_joined(normals), uvs=_joined(uvs))


def _nodes(root):
    """All nodes, and those of the shown scene in file order, each below its parent once (a tree, not a graph)."""
    elements = root.list("nodes")
    parents = [-1] * len(elements)
    for i, element in enumerate(elements):
        for child in element.indices("children", "nodes"):
            if parents[child] >= 0:
                raise element.error(f"node {child} is a child of node {parents[child]} too; a node has one parent")
            parents[child] = i
    nodes = [Node(parent, *(np.array(element.reals(key, len(rest), rest), np.float64) for key, rest in (
                 ("translation", [0, 0, 0]), ("rotation", [0, 0, 0, 1]), ("scale", [1, 1, 1]))),
                  matrix=np.array(element.reals("matrix", 16), np.float64).reshape(4, 4).T
                  if "matrix" in element.data else None)
             for element, parent in zip(elements, parents, strict=True)]
    order = [i for i, parent in enumerate(parents) if parent < 0]
    for i in order:
        order.extend(elements[i].indices("children", "nodes"))
    if len(order) < len(nodes):
        lost = sorted(set(range(len(nodes))) - set(order))[0]
        raise elements[lost].error("is its own ancestor; the node hierarchy has a cycle")

    shown = set(range(len(nodes)))
    if root.data.get("scenes"):
        scene = root.refer("scene", "scenes") if "scene" in root.data else root.list("scenes")[0]
        shown = set(scene.indices("nodes", "nodes"))
        for i in order:
            if nodes[i].parent in shown:
                shown.add(i)
    return elements, nodes, order, sorted(shown)


def _camera(element, node, warnings):
    """The camera that a node carries, or None if it is not a perspective one."""
    camera = element.refer("camera", "cameras")
    perspective = camera.child("perspective")
    if perspective is None:
        warnings.append(f"{camera.place}: only perspective cameras are supported; left out")
        return None
    yfov, aspect = perspective.real("yfov"), perspective.real("aspectRatio", _DEFAULT_ASPECT)
    if not 0 < yfov < math.pi or not aspect > 0:
        raise perspective.error(f"yfov must be within (0, π) and aspectRatio positive, not {yfov:g} and {aspect:g}")
    hfov = 2 * math.atan(math.tan(yfov / 2) * aspect)
    return CameraNode(node, math.degrees(hfov), element.text("name", camera.text("name", camera.place)))


def _channel(channel, samplers, accessors, nodes, warnings):
    """Key frames of one channel, or None if it moves nothing that is traced."""
    target = channel.child("target")
    if target is None or "node" not in target.data:
        return None
    node, path = target.index("node", "nodes"), target.text("path")
    if path not in _PATHS:
        warnings.append(f"{channel.place}: animation of '{path}' is not supported; left out")
        return None
    if nodes[node].matrix is not None:
        raise channel.error(f"animates node {node}, which has a matrix; it must have translation, rotation, scale")
    number = channel.whole("sampler")
    if number >= len(samplers):
        raise channel.error(f"'sampler' {number} does not exist; there are {len(samplers)}")
    sampler = samplers[number]
    interpolation = sampler.text("interpolation", "LINEAR")
    if interpolation not in ("LINEAR", "STEP", "CUBICSPLINE"):
        raise sampler.error(f"interpolation '{interpolation}' is unknown; use LINEAR, STEP or CUBICSPLINE")
    times = accessors.read(sampler.refer("input", "accessors"), ("SCALAR",))[:, 0]
    values = accessors.read(sampler.refer("output", "accessors"), (_PATHS[path],))
    per_time = 3 if interpolation == "CUBICSPLINE" else 1
    if not len(times) or not np.isfinite(times).all() or (np.diff(times) <= 0).any():
        raise sampler.error("times of key frames must be finite and increasing, and there must be one")
    if len(values) != per_time * len(times) or not np.isfinite(values).all():
        raise sampler.error(f"needs {per_time * len(times)} finite values for {len(times)} key frames, "
                            f"has {len(values)}")
    if per_time == 3:
        values = values.reshape(len(times), 3, -1)
    return Channel(node, path, interpolation, times, values)


def load_gltf(path):
    """Scene of a .gltf or .glb file.

    Every node of the shown scene that carries a mesh is an instance, in file order; ``prim_id`` runs through
    the mesh's primitives in file order (triangles, strips and fans). All animations of the file play at once.

    Parameters
    ----------
    path : path-like

    Raises
    ------
    SceneError
        Naming the element of the file that is wrong.
    """
    path = Path(path)
    root, binary = read_gltf_file(path, (*MATERIAL_EXTENSIONS, *LIGHT_EXTENSIONS))
    accessors, warnings = Accessors(path.parent, binary), []
    elements, nodes, order, shown = _nodes(root)
    instance_nodes = [i for i in shown if "mesh" in elements[i].data]
    mesh_ids = [elements[i].index("mesh", "meshes") for i in instance_nodes]
    # Only meshes that are shown: the rest of the file may be large.
    used = sorted(set(mesh_ids))
    all_meshes = root.list("meshes")
    meshes = [_mesh(all_meshes[i], accessors, warnings) for i in used]
    camera_nodes = [_camera(elements[i], i, warnings) for i in shown if "camera" in elements[i].data]
    camera_nodes = [camera for camera in camera_nodes if camera is not None]
    lights = light_nodes(root, elements, shown, warnings)
    channels = [_channel(channel, animation.list("samplers"), accessors, nodes, warnings)
                for animation in root.list("animations") for channel in animation.list("channels")]
    channels = [channel for channel in channels if channel is not None]

    world = pose_nodes(nodes, order)
    names = [elements[i].text("name", elements[i].place) for i in instance_nodes]
    instances = [Instance(used.index(mesh), world[node, :3], name)
                 for mesh, node, name in zip(mesh_ids, instance_nodes, names, strict=True)]
    materials = [DEFAULT_MATERIAL, *GltfMaterials(root, accessors, path.parent, warnings).load()]
    animation = Animation(nodes, order, channels, instance_nodes, camera_nodes, lights) if channels else None
    return Scene(meshes, instances, materials, [camera.camera(world) for camera in camera_nodes], animation, warnings,
                 [light.light(world) for light in lights])
