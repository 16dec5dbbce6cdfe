"""Closed meshes that cases are made of, and points on them."""

import numpy as np

__all__ = ["Surface", "ball", "cube", "ribbon", "slab"]


class Surface:
    """Triangles that share vertices.

    Parameters
    ----------
    vertices : float64[V, 3]
    triangles : int[T, 3]
    """

    def __init__(self, vertices, triangles):
        self.vertices = np.asarray(vertices, np.float64)
        self.triangles = np.asarray(triangles)

    @property
    def corners(self):
        """float64[T, 3, 3]"""
        return self.vertices[self.triangles]

    @property
    def edges(self):
        """int[E, 2]: the edges, each once."""
        pairs = np.sort(np.concatenate([self.triangles[:, pair] for pair in ([0, 1], [1, 2], [2, 0])]), axis=1)
        return np.unique(pairs, axis=0)

    @property
    def num_open_edges(self):
        """Edges that are not shared by two triangles which run along it in opposite directions; 0 if it is closed."""
        ways = np.concatenate([self.triangles[:, pair] for pair in ([0, 1], [1, 2], [2, 0])])
        there, number = np.unique(ways, axis=0, return_counts=True)
        known = {tuple(way) for way in there.tolist()}
        return sum(n != 1 or (b, a) not in known for (a, b), n in zip(there.tolist(), number, strict=True))

    def on_edges(self, count, rng):
        """float64[count, 3]: points of random edges."""
        start, end = self.vertices[self.edges[rng.integers(len(self.edges), size=count)]].swapaxes(0, 1)
        return start + rng.uniform(size=(count, 1)) * (end - start)

    def on_vertices(self, count, rng):
        """float64[count, 3]: random vertices that triangles have."""
        return self.vertices[rng.choice(np.unique(self.triangles), count)]

    def inside(self, count, rng):
        """float64[count, 3]: points of random triangles."""
        weights = rng.dirichlet((1, 1, 1), count)
        return np.einsum("ni,nij->nj", weights, self.corners[rng.integers(len(self.triangles), size=count)])

    @property
    def normals(self):
        """float64[T, 3]: unit normals, outwards if the triangles run counter-clockwise seen from outside."""
        corners = self.corners
        normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        return normals / np.linalg.norm(normals, axis=1, keepdims=True)

    @property
    def folds(self):
        """int[E, 2, 2]: the start and end of each edge, and the triangle that runs along it and the one against."""
        starts, ends = (np.concatenate([self.triangles[:, k] for k in order]) for order in ((0, 1, 2), (1, 2, 0)))
        number = np.tile(np.arange(len(self.triangles)), 3)
        along = np.lexsort((ends, starts))
        along = along[(starts < ends)[along]]
        against = np.lexsort((starts, ends))
        against = against[(ends < starts)[against]]
        return np.stack([np.stack([starts[along], ends[along]], axis=1),
                         np.stack([number[along], number[against]], axis=1)], axis=1)

    def moved(self, *, scale=1.0, offset=0.0):
        """X ↦ scale·X + offset"""
        return Surface(self.vertices * scale + offset, self.triangles)


def ball(num_cuts, *, roughness, rng):
    """A closed ball of radius 1 that is a cut-up octahedron: 8·num_cuts² triangles.

    Parameters
    ----------
    num_cuts : int
        Into how many each edge of the octahedron is cut.
    roughness : float
        By how much of a triangle's edge each vertex is moved in or out, at most.
    """
    n = num_cuts
    places, points = {}, []

    def place(*weights):
        if weights not in places:
            places[weights] = len(points)
            points.append(weights)
        return places[weights]

    triangles = []
    for signs in np.ndindex(2, 2, 2):
        sx, sy, sz = (1 - 2 * sign for sign in signs)
        # Seen from outside, octants with an odd number of negative axes run the other way.
        order = slice(None, None, sx * sy * sz)
        for i in range(n):
            for j in range(n - i):
                k = n - i - j
                corner = [place(sx * i, sy * j, sz * k), place(sx * (i + 1), sy * j, sz * (k - 1)),
                          place(sx * i, sy * (j + 1), sz * (k - 1))]
                triangles.append(corner[order])
                if k > 1:
                    corner = [place(sx * (i + 1), sy * j, sz * (k - 1)),
                              place(sx * (i + 1), sy * (j + 1), sz * (k - 2)),
                              place(sx * i, sy * (j + 1), sz * (k - 1))]
                    triangles.append(corner[order])
    vertices = np.array(points, np.float64)
    vertices /= np.linalg.norm(vertices, axis=1, keepdims=True)
    vertices *= 1 + roughness * 1.5 / n * rng.uniform(-1, 1, (len(vertices), 1))
    return Surface(vertices, np.array(triangles))


def _lattice(num_x, num_y, start):
    """Triangles of a lattice of num_x × num_y cells whose vertices are numbered from ``start``, row by row."""
    i, j = np.indices((num_x, num_y)).reshape(2, -1)
    a = start + i * (num_y + 1) + j
    b, c, d = a + 1, a + num_y + 1, a + num_y + 2
    return np.stack([a, c, d, a, d, b], axis=1).reshape(-1, 3)


def _welded(vertices, triangles):
    """Vertices that are equal made one."""
    vertices, number = np.unique(vertices, axis=0, return_inverse=True)
    return Surface(vertices, number.reshape(-1)[triangles])


def _box(half, places):
    """The closed box of half the size ``half`` about 0, its faces cut at ``places`` in −1…1 both ways."""
    vertices, triangles, start = [], [], 0
    for axis in range(3):
        for side in (1, -1):
            u, v = (axis + 1) % 3, (axis + 2) % 3
            points = np.zeros((len(places), len(places), 3))
            points[..., axis] = side * half[axis]
            points[..., u], points[..., v] = half[u] * places[:, None], half[v] * places
            part = _lattice(len(places) - 1, len(places) - 1, start)
            triangles.append(part if side > 0 else part[:, ::-1])
            vertices.append(points.reshape(-1, 3))
            start += len(vertices[-1])
    return _welded(np.concatenate(vertices), np.concatenate(triangles))


def cube(num_cells):
    """The closed cube [−1, 1]³, each face cut into num_cells² squares of two triangles."""
    places = np.linspace(-1, 1, num_cells + 1)
    return _box((1.0, 1.0, 1.0), places)


def slab(num_cells, *, thickness, rng):
    """The closed box [−1, 1]² × [−thickness, 0], its faces cut into squares of uneven size."""
    places = np.linspace(-1, 1, num_cells + 1)
    places[1:-1] += rng.uniform(-0.3, 0.3, num_cells - 1) * 2 / num_cells
    box = _box((1.0, 1.0, thickness / 2), places)
    return box.moved(offset=np.array([0.0, 0.0, -thickness / 2]))


def ribbon(num_strips, width):
    """A rectangle of four triangles, 2 wide, with a ribbon of 2·num_strips triangles of length 2 along its middle.

    The triangles of the ribbon are 2·``width`` wide; the plane is tilted about the first axis.
    """
    xs = np.concatenate([[-1.0], width * np.arange(-num_strips, num_strips + 1), [1.0]])
    lower, upper = (np.stack([xs, np.full(len(xs), y), np.full(len(xs), z)], axis=1) for y, z in ((-1, -0.1), (1, 0.7)))
    n = len(xs)
    k = np.arange(n - 1)
    triangles = np.concatenate([np.stack([k, k + 1, k + n + 1], axis=1), np.stack([k, k + n + 1, k + n], axis=1)])
    return Surface(np.concatenate([lower, upper]), triangles)
