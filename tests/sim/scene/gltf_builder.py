"""glTF files made by hand, for the tests of their reader."""

import json
import struct

import numpy as np

__all__ = ["COMPONENTS", "TYPES", "Builder"]

COMPONENTS = {"b": 5120, "B": 5121, "h": 5122, "H": 5123, "I": 5125, "f": 5126}
TYPES = {1: "SCALAR", 2: "VEC2", 3: "VEC3", 4: "VEC4"}


class Builder:
    """Puts a glTF document together: every accessor gets a view of its own in one buffer."""

    def __init__(self):
        self.binary = b""
        self.document = dict(asset=dict(version="2.0"), buffers=[dict(byteLength=0)], bufferViews=[], accessors=[],
                             meshes=[], nodes=[])

    def view(self, data, **extra):
        self.binary += b"\0" * (-len(self.binary) % 4)
        self.document["bufferViews"].append(
            dict(buffer=0, byteOffset=len(self.binary), byteLength=len(data), **extra))
        self.binary += data
        self.document["buffers"][0]["byteLength"] = len(self.binary)
        return len(self.document["bufferViews"]) - 1

    def accessor(self, values, code="f", **extra):
        values = np.atleast_2d(np.array(values, dtype=np.dtype(code).newbyteorder("<")))
        if values.shape[0] == 1 and extra.pop("scalars", False):
            values = values.T
        self.document["accessors"].append(dict(
            bufferView=self.view(values.tobytes()), componentType=COMPONENTS[code], count=values.shape[0],
            type=TYPES[values.shape[1]], **extra))
        return len(self.document["accessors"]) - 1

    def scalars(self, values, code="f", **extra):
        return self.accessor(values, code, scalars=True, **extra)

    def mesh(self, *primitives, **extra):
        self.document["meshes"].append(dict(primitives=list(primitives), **extra))
        return len(self.document["meshes"]) - 1

    def triangle(self, **extra):
        return dict(attributes=dict(POSITION=self.accessor([(0, 0, 0), (1, 0, 0), (0, 1, 0)])), **extra)

    def node(self, **properties):
        self.document["nodes"].append(properties)
        return len(self.document["nodes"]) - 1

    def animate(self, node, path, times, values, **sampler):
        """An animation of one channel."""
        animation = dict(samplers=[dict(input=self.scalars(times), output=self.accessor(values), **sampler)],
                         channels=[dict(sampler=0, target=dict(node=node, path=path))])
        self.document.setdefault("animations", []).append(animation)

    def glb(self):
        """The document as a .glb file."""
        text = json.dumps(self.document).encode()
        text += b" " * (-len(text) % 4)
        binary = self.binary + b"\0" * (-len(self.binary) % 4)
        chunks = struct.pack("<II", len(text), 0x4E4F534A) + text
        chunks += struct.pack("<II", len(binary), 0x004E4942) + binary
        return struct.pack("<III", 0x46546C67, 2, 12 + len(chunks)) + chunks
