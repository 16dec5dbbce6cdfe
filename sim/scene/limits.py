"""Beyond what the chip's arithmetic fails: the limits of docs/accuracy.md, and what of a scene is beyond them.

They are where rays begin to miss for more than the edges that leak everywhere, at 16 fraction bits ("bounds" in
docs/results/stability.json): of the size of a mesh over its distance, the length of triangles over their width, and
the scale of instances along one axis. Each is the ratio of two lengths that meet in a number or a sum: rounding the
larger to F bits leaves of the smaller 2^F over the ratio. So a limit doubles with every fraction bit.
"""

import math
from dataclasses import dataclass

import numpy as np

__all__ = ["FAR", "FLAT", "STRETCHED", "THIN", "Limit", "limit_warnings"]

# Fraction bits at which limits are measured, and the most a format may have.
_FRAC_WIDTH, _MOST_BITS = 16, 23
#: How many are named.
_NAMED = 3


@dataclass(frozen=True)
class Limit:
    """A limit at 16 fraction bits.

    Parameters
    ----------
    ratio : float
        At most.
    case, side : str, int
        The case of :data:`sim.stability.cases.CASES` that it is of, and which of its bounds, 0 or 1.
    says : str
        What is beyond it, with a place for the ratio, of one thing and of several.
    remedy : str
        Besides more fraction bits.
    """

    ratio: float
    case: str
    side: int
    says: str
    remedy: str

    def at(self, fmt):
        """The limit in a format."""
        return self.ratio * 2.0 ** (fmt.frac_width - _FRAC_WIDTH)


FAR = Limit(1e3, "size", 0, "up to {:,.0f} times its own size from the middle of the space that it shares with others",
            "give it a space of its own with --instances, or move it nearer to the others")
THIN = Limit(1e4, "slivers", 1, "triangles up to {:,.0f} times as long as wide", "split them into shorter ones")
STRETCHED = Limit(1e2, "scaled instance", 1, "stretched along one axis up to {:,.0f} times as far as along the others",
                  "stretch the mesh itself, or split it")
FLAT = Limit(1e3, "scaled instance", 0, "flattened along one axis to a part in {:,.0f} of the others",
             "flatten the mesh itself, or split it")


def limit_warnings(scene, *, fmt, is_flat, from_eye=True):
    """A sentence for each limit that something in a scene is beyond, naming what, how far, and what would help.

    Parameters
    ----------
    scene : Scene
    fmt : FloatFormat
        The chip's.
    is_flat, from_eye : bool
        As it is compiled: all triangles in one space, or instances placed as seen from the eye, which sees all of them
        equally fine.
    """
    shown = [instance for instance in scene.instances if scene.meshes[instance.mesh].usable.any()]
    names = [instance.name for instance in shown]
    found = []
    if is_flat or not from_eye:
        found.append((FAR, "object", names, _distances(scene, shown)))
    used = [scene.meshes[number] for number in dict.fromkeys(instance.mesh for instance in shown)]
    found.append((THIN, "mesh", [mesh.name for mesh in used], np.array([_thinness(mesh) for mesh in used])))
    if not is_flat:
        scales = np.linalg.svd(np.array([instance.transform[:, :3] for instance in shown]), compute_uv=False)
        found += [(STRETCHED, "object", names, scales[:, 0] / scales[:, 1]),
                  (FLAT, "object", names, scales[:, 1] / scales[:, 2])]
    return [_sentence(limit, kind, names, ratios, fmt) for limit, kind, names, ratios in found
            if (ratios > limit.at(fmt)).any()]


def _distances(scene, shown):
    """Of each instance the largest coordinate from the scene's middle, over half its own extent."""
    lower, upper = scene.bounds()
    ratios = []
    for instance in shown:
        box = np.array(scene.meshes[instance.mesh].bounds())
        corners = box[np.indices((2, 2, 2)).reshape(3, 8), np.arange(3)[:, None]].T
        world = corners @ instance.transform[:, :3].T + instance.transform[:, 3]
        ratios.append(np.abs(world - (lower + upper) / 2).max() / ((world.max(axis=0) - world.min(axis=0)).max() / 2))
    return np.array(ratios)


def _thinness(mesh):
    """The longest edge of a triangle over its height on that, of the thinnest."""
    corners = mesh.vertices[mesh.triangles[mesh.usable]]
    edges = np.roll(corners, -1, axis=1) - corners
    longest = np.linalg.norm(edges, axis=2).max(axis=1)
    double_area = np.linalg.norm(np.cross(edges[:, 0], edges[:, 1]), axis=1)
    with np.errstate(divide="ignore"):
        return (longest**2 / double_area).max()


def _sentence(limit, kind, names, ratios, fmt):
    most, worst = limit.at(fmt), np.argsort(-ratios)
    beyond = [names[k] for k in worst if ratios[k] > most]
    named = ", ".join(f"'{name}'" for name in beyond[:_NAMED])
    if len(beyond) > _NAMED:
        named += f" and {len(beyond) - _NAMED} more"
    bits = fmt.frac_width + math.ceil(math.log2(min(ratios[worst[0]] / most, 2.0**64)))
    more = f"use --format {fmt.exp_width}.{bits}, or " if bits <= _MOST_BITS else ""
    plural = ("meshes" if kind == "mesh" else f"{kind}s") if len(beyond) > 1 else kind
    return (f"{plural} {named}: {limit.says.format(ratios[worst[0]])}, beyond the {most:,.0f} that format {fmt} is "
            f"good for; {more}{limit.remedy}")
