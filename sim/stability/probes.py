"""Rays and triangles of each case: functions of the value that is swept, a number of rays, a format, random numbers."""

import numpy as np

from ..scene.top_level import unit_box
from .meshes import Surface, ball, cube, ribbon, slab
from .probe import Probe, rounded_rays

__all__ = ["axis_parallel", "degenerate", "direction", "edges", "entering_excluded", "far", "far_recentred", "grazing",
           "leaning", "leaving", "leaving_excluded", "nested", "scale", "scaled_instance", "sheared_instance",
           "silhouettes", "size", "slivers", "unit", "vertices"]

_ROUGHNESS = 0.3


def unit(vectors):
    """Vectors float64[…, 3] over their lengths."""
    return vectors / np.linalg.norm(vectors, axis=-1, keepdims=True)


def _outwards(normals, rng):
    """Unit vectors within about 60° of normals."""
    ways = normals + 0.5 * rng.normal(size=normals.shape)
    return unit(ways * np.sign((ways * normals).sum(axis=1, keepdims=True)))


def _towards(fmt, corners, targets, normals, rng, *, distance=(2.0, 4.0), **options):
    """Rays from outside to targets on a surface."""
    origins = targets + _outwards(normals, rng) * rng.uniform(*distance, (len(targets), 1))
    origins, directions, _ = rounded_rays(fmt, origins, targets, rng)
    return Probe(fmt, fmt.quantize(corners), origins, directions, **options)


def leaning(normals, cosine, rng):
    """Unit vectors at that cosine to unit normals."""
    side = np.cross(normals, unit(rng.normal(size=normals.shape)))
    return cosine * normals + np.sqrt(1 - cosine**2) * unit(side)


def _ball_of(num_triangles, rng):
    return ball(round((num_triangles / 8) ** 0.5), roughness=_ROUGHNESS, rng=rng)


def edges(value, count, *, fmt, rng):
    """Points of the edges of a rough ball, from outside."""
    mesh = _ball_of(value, rng)
    targets = mesh.on_edges(count, rng)
    return _towards(fmt, mesh.corners, targets, unit(targets), rng)


def vertices(value, count, *, fmt, rng):
    """Vertices of a rough ball, from outside."""
    mesh = _ball_of(value, rng)
    targets = mesh.on_vertices(count, rng)
    return _towards(fmt, mesh.corners, targets, unit(targets), rng)


def silhouettes(value, count, *, fmt, rng):
    """Edges of a rough ball in a far greater one, both of whose triangles face the ray, one at the cosine ``value``."""
    mesh = ball(32, roughness=_ROUGHNESS, rng=rng)
    around = ball(4, roughness=0.0, rng=rng).moved(scale=8.0)
    folds, normals = mesh.folds, mesh.normals
    targets, ways = [], []
    while sum(map(len, targets)) < count:
        ends, sides = folds[rng.integers(len(folds), size=count)].swapaxes(0, 1)
        sides = rng.permuted(sides, axis=1)
        way = leaning(normals[sides[:, 0]], value, rng)
        fits = (way * normals[sides[:, 1]]).sum(axis=1) > value
        start, end = mesh.vertices[ends[fits]].swapaxes(0, 1)
        targets.append(start + rng.uniform(size=(len(start), 1)) * (end - start))
        ways.append(way[fits])
    targets, ways = (np.concatenate(parts)[:count] for parts in (targets, ways))
    origins, directions, _ = rounded_rays(fmt, targets + ways * rng.uniform(2, 4, (count, 1)), targets, rng)
    return Probe(fmt, fmt.quantize(np.concatenate([mesh.corners, around.corners])), origins, directions)


def grazing(value, count, *, fmt, rng):
    """Points of the edges of a plane face, the ray at the angle ``value`` to it."""
    mesh = slab(24, thickness=0.2, rng=rng)
    turn = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    starts, ends = mesh.vertices[mesh.edges].swapaxes(0, 1)
    # On the face, and so far from its border that a ray comes in over it.
    central = (np.abs(np.stack([starts, ends])[..., :2]).max(axis=(0, 2)) < 0.5) & (starts[:, 2] + ends[:, 2] == 0)
    chosen = rng.choice(np.flatnonzero(central), count)
    targets = starts[chosen] + rng.uniform(size=(count, 1)) * (ends - starts)[chosen]
    heading = rng.uniform(0, 2 * np.pi, count)
    ways = np.stack([np.cos(value) * np.cos(heading), np.cos(value) * np.sin(heading),
                     np.full(count, np.sin(value))], axis=1)
    origins = targets + ways * rng.uniform(1, 2, (count, 1))
    origins, directions, _ = rounded_rays(fmt, origins @ turn.T, targets @ turn.T, rng)
    return Probe(fmt, fmt.quantize(mesh.corners @ turn.T), origins, directions)


def slivers(value, count, *, fmt, rng):
    """Edges between triangles ``value`` times as long as wide, in the middle of a rectangle."""
    num_strips = 16
    mesh = ribbon(num_strips, 1 / value)
    ends = mesh.vertices[mesh.edges]
    inner = mesh.edges[(np.abs(ends[..., 0]) < num_strips / value).all(axis=1) & (ends[:, 0, 1] != ends[:, 1, 1])]
    start, end = mesh.vertices[inner[rng.integers(len(inner), size=count)]].swapaxes(0, 1)
    targets = start + rng.uniform(0.2, 0.8, (count, 1)) * (end - start)
    normals = np.broadcast_to(mesh.normals[0], targets.shape)
    return _towards(fmt, mesh.corners, targets, normals, rng)


def size(value, count, *, fmt, rng):
    """Edges of a rough ball of radius ``value``, at a distance of about 1."""
    mesh = _ball_of(288, rng).moved(scale=value)
    targets = mesh.on_edges(count, rng)
    return _towards(fmt, mesh.corners, targets, unit(targets), rng, distance=(0.7, 1.4))


def _far_mesh(value, count, rng):
    mesh, offset = _ball_of(288, rng), value * np.array([1.0, 0.7, -0.4])
    targets = mesh.on_edges(count, rng)
    return mesh, offset, targets


def far(value, count, *, fmt, rng):
    """Edges of a rough ball about a point that is ``value`` times its radius from the origin along x, as it is."""
    mesh, offset, targets = _far_mesh(value, count, rng)
    origins = targets + offset + _outwards(unit(targets), rng) * rng.uniform(2, 4, (count, 1))
    origins, directions, _ = rounded_rays(fmt, origins, targets + offset, rng)
    return Probe(fmt, fmt.quantize(mesh.corners + offset), origins, directions)


def far_recentred(value, count, *, fmt, rng):
    """The same, moved and scaled as the scene compiler does."""
    mesh, offset, targets = _far_mesh(value, count, rng)
    corners = mesh.corners + offset
    center, factor = unit_box(corners.min(axis=(0, 1)), corners.max(axis=(0, 1)))
    origins = targets + offset + _outwards(unit(targets), rng) * rng.uniform(2, 4, (count, 1))
    origins, directions, _ = rounded_rays(fmt, (origins - center) * factor, (targets + offset - center) * factor, rng)
    return Probe(fmt, fmt.quantize((corners - center) * factor), origins, directions)


def _placed(linear, count, fmt, rng):
    """Edges of a rough ball that is placed by a linear map, the rays going through the instance's matrix."""
    mesh = _ball_of(288, rng)
    placement = fmt.quantize(np.concatenate([np.linalg.inv(linear), np.zeros((1, 3))]))
    # The chip's map is the rounded one.
    world = np.linalg.inv(placement[:3])
    targets = mesh.on_edges(count, rng)
    normals = unit(unit(targets) @ placement[:3])
    targets = targets @ world.T
    away = rng.uniform(2, 4, (count, 1)) * np.linalg.norm(world, 2)
    origins, directions, _ = rounded_rays(fmt, targets + _outwards(normals, rng) * away, targets, rng)
    return Probe(fmt, fmt.quantize(mesh.corners), origins, directions, placement=placement)


def scaled_instance(value, count, *, fmt, rng):
    """Edges of an instance that is scaled by ``value`` along an axis that is none of the coordinates'."""
    turn = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    return _placed(turn @ np.diag([value, 1.0, 1.0]) @ turn.T, count, fmt, rng)


def sheared_instance(value, count, *, fmt, rng):
    """Edges of an instance that is sheared by ``value`` along planes that are none of the coordinates'."""
    turn = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    return _placed(turn @ np.array([(1.0, value, 0.0), (0, 1, 0), (0, 0, 1)]) @ turn.T, count, fmt, rng)


def axis_parallel(value, count, *, fmt, rng):
    """Vertices and edges of a cube of ``value``² squares a face, met along the axes; what is 0 is so of either sign."""
    mesh = cube(value)
    places, rows = fmt.quantize(np.unique(mesh.vertices[:, 0])), np.arange(count)
    axis, side = rng.integers(3, size=count), rng.choice((-1.0, 1.0), count)
    # On a line of the lattice one way, and on one or between them the other way.
    targets = rng.choice(places[1:-1], (count, 3))
    along = (axis + rng.integers(1, 3, count)) % 3
    targets[rows, along] = np.where(rng.uniform(size=count) < 0.5, targets[rows, along],
                                    fmt.quantize(rng.uniform(-0.99, 0.99, count)))
    targets[rows, axis] = side
    origins = targets.copy()
    origins[rows, axis] = fmt.quantize(side * rng.uniform(2, 4, count))
    directions = rng.choice((-0.0, 0.0), (count, 3))
    directions[rows, axis] = fmt.quantize(-side * rng.uniform(0.5, 2, count))
    return Probe(fmt, fmt.quantize(mesh.corners), origins, directions)


def nested(value, count, *, fmt, rng):
    """The inside of a rough ball's triangles, with the same ball in it, smaller by ``value``."""
    mesh = _ball_of(288, rng)
    targets = mesh.inside(count, rng)
    corners = np.concatenate([mesh.corners, mesh.corners * (1 - value)])
    return _towards(fmt, corners, targets, unit(targets), rng)


def degenerate(value, count, *, fmt, rng):
    """Past thin triangles that stand alone, whose height is ``value`` times their length; with 0 they are lines."""
    number = 64
    starts = fmt.quantize(rng.uniform(-0.5, 0.5, (number, 3)))
    # Even in the last place, so that the middle of the edge is a member too.
    steps = np.rint(unit(rng.normal(size=(number, 3))) * 2.0 ** (fmt.frac_width - 4)) * 2.0 ** (5 - fmt.frac_width)
    starts = np.rint(starts * 2.0 ** (fmt.frac_width - 4)) * 2.0 ** (4 - fmt.frac_width)
    side = unit(np.cross(steps, rng.normal(size=(number, 3))))
    length = np.linalg.norm(steps, axis=1, keepdims=True)
    corners = np.stack([starts, starts + steps, starts + steps / 2 + value * length * side], axis=1)
    corners = fmt.quantize(corners)
    chosen = rng.integers(number, size=count)
    along = starts[chosen] + rng.uniform(-0.2, 1.2, (count, 1)) * steps[chosen]
    ways = unit(rng.normal(size=(count, 3)))
    past = unit(np.cross(ways, steps[chosen])) * 10.0 ** rng.uniform(-4, -1, (count, 1))
    origins, directions, _ = rounded_rays(fmt, along + ways * rng.uniform(2, 4, (count, 1)), along + past, rng)
    return Probe(fmt, corners, origins, directions, everything=True)


def _from_surface(cosine, count, fmt, rng, *, excludes, **options):
    """Rays from points of a ball, rounded, at that cosine to their triangle's normal."""
    mesh = ball(6, roughness=0.0, rng=rng)
    mesh = Surface(fmt.quantize(mesh.vertices), mesh.triangles)
    own = rng.integers(len(mesh.triangles), size=count)
    weights = rng.dirichlet((1, 1, 1), count)
    points = np.einsum("ni,nij->nj", weights, mesh.corners[own])
    ways = leaning(mesh.normals[own], cosine, rng)
    return Probe(fmt, mesh.corners, fmt.quantize(points), fmt.quantize(ways * rng.uniform(0.5, 1.5, (count, 1))),
                 excluded=own if excludes else None, **options)


def leaving(value, count, *, fmt, rng):
    """From points of a convex mesh outwards: there is nothing to hit."""
    return _from_surface(value, count, fmt, rng, excludes=False, must_miss=True)


def leaving_excluded(value, count, *, fmt, rng):
    """The same, when a ray cannot hit the triangle that it starts on."""
    return _from_surface(value, count, fmt, rng, excludes=True, must_miss=True)


def entering_excluded(value, count, *, fmt, rng):
    """From points of a convex mesh inwards: to its other side, or a neighbour's."""
    return _from_surface(-value, count, fmt, rng, excludes=True)


def scale(value, count, *, fmt, rng):
    """Edges of a rough ball, all lengths times ten to the power ``value``."""
    mesh, factor = _ball_of(288, rng), 10.0**value
    targets = mesh.on_edges(count, rng)
    return _towards(fmt, mesh.corners * factor, targets * factor, unit(targets), rng,
                    distance=(2 * factor, 4 * factor))


def direction(value, count, *, fmt, rng):
    """Edges of a rough ball, directions times ten to the power ``value``."""
    mesh = _ball_of(288, rng)
    targets = mesh.on_edges(count, rng)
    origins = targets + _outwards(unit(targets), rng) * rng.uniform(2, 4, (count, 1))
    origins, directions, _ = rounded_rays(fmt, origins, targets, rng, stretch=(0.5 * 10.0**value, 1.5 * 10.0**value))
    return Probe(fmt, fmt.quantize(mesh.corners), origins, directions)
