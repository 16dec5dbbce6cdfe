"""Triangles to build kd-trees over, and plain ways through a tree."""

import numpy as np

from sim.scene.kdtree import LEAF, build_kdtree
from sim.scene.room import room_scene


def random_triangles(seed, num, *, size=0.2):
    rng = np.random.default_rng(seed)
    return rng.uniform(-1, 1, (num, 1, 3)) + rng.uniform(-size, size, (num, 3, 3))


def room_triangles():
    mesh = room_scene().meshes[0]
    return mesh.vertices[mesh.triangles]


def grid_triangles():
    """Axis-aligned unit squares, two triangles each: many bounds coincide and every box is flat."""
    squares = []
    for axis in range(3):
        a, b = np.eye(3)[(axis + 1) % 3], np.eye(3)[(axis + 2) % 3]
        for i, j, k in np.indices((4, 4, 3)).reshape(3, -1).T:
            corner = i * a + j * b + k * np.eye(3)[axis]
            squares += [(corner, corner + a, corner + a + b), (corner, corner + a + b, corner + b)]
    return np.array(squares)


def build(triangles, **kwargs):
    return build_kdtree(triangles.min(axis=1), triangles.max(axis=1), triangles=triangles, **kwargs)


def leaves_at(tree, point, radius):
    """All leaves whose cells come within ``radius`` of a point in every coordinate."""
    waiting, found = [0], []
    while waiting:
        node = waiting.pop()
        axis = tree.axis[node]
        if axis == LEAF:
            found.append(node)
            continue
        if point[axis] - radius <= tree.split[node]:
            waiting.append(tree.child[node])
        if point[axis] + radius >= tree.split[node]:
            waiting.append(tree.child[node] + 1)
    return found


def items_of(tree, leaf):
    return tree.items[tree.child[leaf]:tree.child[leaf] + tree.count[leaf]]


def nearest(triangles, origin, direction, prims):
    """Distance and number of the closest of some triangles (Möller, Trumbore), (inf, −1) if none is hit."""
    corners = triangles[prims]
    e1, e2 = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    p = np.cross(direction, e2)
    with np.errstate(divide="ignore", invalid="ignore"):
        inverse = 1 / np.einsum("ij,ij->i", e1, p)
        s = origin - corners[:, 0]
        u = np.einsum("ij,ij->i", s, p) * inverse
        q = np.cross(s, e1)
        v = q @ direction * inverse
        t = np.einsum("ij,ij->i", e2, q) * inverse
        t = np.where((u >= 0) & (v >= 0) & (u + v <= 1) & (t > 0), t, np.inf)
    return (t.min(), prims[t.argmin()]) if len(t) and t.min() < np.inf else (np.inf, -1)


def traverse(tree, triangles, origin, direction):
    """Closest hit by the tree, as the chip goes through it: from the root, t in [0, inf), no bounding box."""
    best, stack = (np.inf, -1), [(0, 0.0, np.inf)]
    while stack:
        node, t_near, t_far = stack.pop()
        if t_near > best[0]:
            continue
        axis = tree.axis[node]
        if axis == LEAF:
            best = min(best, nearest(triangles, origin, direction, items_of(tree, node)))
            continue
        lower, upper = tree.child[node], tree.child[node] + 1
        offset = tree.split[node] - origin[axis]
        if direction[axis] == 0:
            stack += [(child, t_near, t_far) for child, side in ((lower, offset >= 0), (upper, offset <= 0)) if side]
            continue
        t_split = offset / direction[axis]
        near, far = (lower, upper) if direction[axis] > 0 else (upper, lower)
        if t_split <= t_far:
            stack.append((far, max(t_near, t_split), t_far))
        if t_split >= t_near:
            stack.append((near, t_near, min(t_far, t_split)))
    return best


def check_layout(tree, num_primitives):
    """Every node is reached once, siblings are a pair at an even index, and all is laid out depth first."""
    seen, items, deepest = [], [], 0
    waiting = [(0, 0)]
    pairs = []
    while waiting:
        node, depth = waiting.pop()
        seen.append(node)
        deepest = max(deepest, depth)
        if tree.axis[node] == LEAF:
            assert tree.child[node] == len(items)
            items.extend(items_of(tree, node))
            assert (np.diff(items_of(tree, node)) > 0).all()
        else:
            assert tree.axis[node] < 3
            assert tree.count[node] == 0
            assert tree.child[node] % 2 == 0
            pairs.append(tree.child[node])
            waiting += [(tree.child[node] + 1, depth + 1), (tree.child[node], depth + 1)]
    assert sorted(seen) == [0, *range(2, len(tree.axis))]
    assert pairs == sorted(pairs)
    assert items == tree.items.tolist()
    assert set(items) <= set(range(num_primitives))
    assert tree.max_depth == deepest
    leaves = [node for node in seen if tree.axis[node] == LEAF]
    assert tree.stats["num_nodes"] == len(seen)
    assert tree.stats["num_leaves"] == len(leaves)
    assert tree.stats["num_empty"] == sum(tree.count[leaf] == 0 for leaf in leaves)


SHAPES = {"room": room_triangles(), "soup": random_triangles(1, 700), "long": random_triangles(2, 120, size=1.5),
          "grid": grid_triangles(), "one": random_triangles(3, 1)}
