"""What a glTF 2.0 file holds: its JSON, the arrays of its buffers, and its images."""

import base64
import json
import struct
from urllib.parse import unquote

import numpy as np

LIGHTS = "KHR_lights_punctual"
IOR = "KHR_materials_ior"
STRENGTH = "KHR_materials_emissive_strength"
EXTENSIONS = {LIGHTS, IOR, STRENGTH, "KHR_mesh_quantization"}
LEFT_OUT = {"animations", "skins", "targets", "sparse", "COLOR_0", "texCoord 1", "occlusionTexture"}
LEFT_OUT |= {"alphaMode MASK", "alphaMode BLEND", "type orthographic", "range"}
LEFT_OUT |= {f"mode {number}" for number in (0, 1, 2, 3, 5, 6)}  # all but triangles
DTYPES = {5120: "i1", 5121: "u1", 5122: "<i2", 5123: "<u2", 5125: "<u4", 5126: "<f4"}
WIDTHS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4}


class File:
    """A glTF file: ``json``, and methods that read what it refers to."""

    def __init__(self, path):
        content = path.read_bytes()
        chunk = b""
        if content[:4] == b"glTF":  # 12 bytes, then JSON and a buffer, with 8 bytes before each
            (length,) = struct.unpack_from("<I", content, 12)
            chunk = content[28 + length :]
            content = content[20 : 20 + length]
        self.folder = path.parent
        self.json = json.loads(content)
        if names := self.unknown("extensionsRequired"):
            raise ValueError(f"{path} requires {', '.join(sorted(names))}. Write it without.")
        self.buffers = [
            self.content(buffer) if "uri" in buffer else chunk
            for buffer in self.json.get("buffers", [])
        ]

    def unknown(self, key):
        """Return the extensions of a list that are not read."""
        return set(self.json.get(key, [])) - EXTENSIONS

    def left_out(self):
        """Return the names of what the file has, and a scene of it does not."""
        names = self.unknown("extensionsUsed") | (LEFT_OUT & set(words(self.json)))
        for sampler in self.json.get("samplers", []):
            if sampler.get("wrapT", 10497) != sampler.get("wrapS", 10497):
                names.add("wrapT, apart from wrapS")  # Mitsuba has one for both
        return sorted(names)

    def content(self, part):
        """Return the bytes of a buffer or an image, or of the view of a buffer that it names."""
        if "bufferView" in part:
            view = self.json["bufferViews"][part["bufferView"]]
            start = view.get("byteOffset", 0)
            return self.buffers[view["buffer"]][start : start + view["byteLength"]]
        name, _, data = part["uri"].partition(",")
        if name.startswith("data:"):
            return base64.b64decode(data)
        return (self.folder / unquote(part["uri"])).read_bytes()

    def array(self, number):
        """Return an accessor's rows; integers that stand for fractions as those."""
        accessor = self.json["accessors"][number]
        dtype = np.dtype(DTYPES[accessor["componentType"]])
        shape = (accessor["count"], WIDTHS[accessor["type"]])
        view = self.json["bufferViews"][accessor["bufferView"]]
        strides = (view.get("byteStride", dtype.itemsize * shape[1]), dtype.itemsize)
        start = accessor.get("byteOffset", 0)
        rows = np.ndarray(shape, dtype, self.content(accessor), start, strides)
        if accessor.get("normalized"):
            return np.maximum(rows / np.iinfo(dtype).max, -1)
        return rows

    def triangles(self, primitive, to_world):
        """Return triangles in world space: columns of their vertices, and vertices of faces."""
        given = primitive["attributes"]
        linear = to_world[:3, :3]
        columns = {"x y z": self.array(given["POSITION"]) @ linear.T + to_world[:3, 3]}
        if "NORMAL" in given:
            columns["nx ny nz"] = self.array(given["NORMAL"]) @ np.linalg.pinv(linear)
        if "TEXCOORD_0" in given:  # v points down in both
            columns["u v"] = self.array(given["TEXCOORD_0"])
        corners = np.arange(len(columns["x y z"]))
        if "indices" in primitive:
            corners = self.array(primitive["indices"])
        faces = corners.reshape(-1, 3)
        is_mirrored = np.linalg.det(linear) < 0
        return columns, faces[:, ::-1] if is_mirrored else faces


def extension(part, name):
    """Return an extension of a part of the file, empty if it has none."""
    return part.get("extensions", {}).get(name, {})


def words(part):
    """Yield all keys of JSON, and each with its value."""
    for key, value in part.items() if isinstance(part, dict) else enumerate(part):
        yield key
        if isinstance(value, (str, int)):
            yield f"{key} {value}"
        elif isinstance(value, (dict, list)) and key != "extras":
            yield from words(value)


def local(node):
    """Return a node's matrix in its parent."""
    if "matrix" in node:
        return np.reshape(node["matrix"], (4, 4)).T
    *axis, w = node.get("rotation", (0, 0, 0, 1))
    turn = np.cross(np.eye(3), axis)
    matrix = np.eye(4)
    matrix[:3, :3] += 2 * (w * turn + turn @ turn)
    matrix[:3, :3] *= node.get("scale", (1, 1, 1))
    matrix[:3, 3] = node.get("translation", (0, 0, 0))
    return matrix
