"""Lights of glTF files: the extension KHR_lights_punctual."""

import math

import numpy as np

from .animation import LightNode
from .light import MAX_LIGHTS, Light

__all__ = ["LIGHT_EXTENSIONS", "light_nodes"]

LIGHT_EXTENSIONS = ("KHR_lights_punctual",)


def _light(element):
    """The light in its node's space: at the origin, shining along −z; its intensity divided by a white surface's π."""
    kind = element.text("type")
    if kind not in ("point", "spot", "directional"):
        raise element.error(f"type '{kind}' is unknown; use point, spot or directional")
    color = tuple(max(float(channel), 0.0) for channel in element.reals("color", 3, [1.0] * 3))
    reach = element.real("range", math.inf)
    if not reach > 0:
        raise element.error(f"range must be positive, not {reach:g}")
    common = dict(color=color, intensity=max(element.real("intensity", 1.0), 0.0) / math.pi,
                  name=element.text("name", element.place))
    if kind == "directional":
        return Light(kind, **common)
    if kind == "point":
        return Light(kind, reach=reach, **common)
    cone = element.child("spot")
    inner = cone.real("innerConeAngle", 0.0) if cone else 0.0
    outer = cone.real("outerConeAngle", math.pi / 4) if cone else math.pi / 4
    if not 0 <= inner < outer <= math.pi / 2 + 1e-6:
        raise (cone or element).error(f"angles must be 0 ≤ innerConeAngle < outerConeAngle ≤ π/2, not {inner:g} and "
                                      f"{outer:g}")
    return Light.spot(np.zeros(3), (0.0, 0.0, -1.0), inner_angle=inner, outer_angle=outer, reach=reach, **common)


def light_nodes(root, elements, shown, warnings):
    """The lights that shown nodes carry, at most as many as the shader has room for.

    Parameters
    ----------
    root : Element
    elements : list of Element
        All nodes.
    shown : list of int
        Numbers of the shown ones.
    warnings : list of str

    Raises
    ------
    SceneError
        For a node that names a light that is not there, or a light that is none.
    """
    extensions = root.child("extensions")
    store = extensions.child("KHR_lights_punctual") if extensions else None
    lights = store.list("lights") if store else []
    nodes = []
    for number in shown:
        extensions = elements[number].child("extensions")
        reference = extensions.child("KHR_lights_punctual") if extensions else None
        if reference is None:
            continue
        index = reference.whole("light")
        if index >= len(lights):
            raise reference.error(f"'light' {index} does not exist; there are {len(lights)}")
        nodes.append(LightNode(number, _light(lights[index])))
    if len(nodes) > MAX_LIGHTS:
        warnings.append(f"the file has {len(nodes)} lights; the first {MAX_LIGHTS} are drawn")
    return nodes[:MAX_LIGHTS]
