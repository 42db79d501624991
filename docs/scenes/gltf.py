"""The scene of a glTF 2.0 file: ``fotismos compare docs/scenes/gltf.py -D file=helmet.glb``.

Numbers of lights stay: candela become radiant intensity, lux irradiance, and emission radiance.
Materials become Mitsuba's ``principled``, whose diffuse part is Disney's, not Lambert's; those that
are not double-sided are black from behind. Mitsuba reads meshes from files: they stay in MESHES.
"""

import base64
import hashlib
import json
import os
import struct
import sys
import tempfile
from pathlib import Path
from urllib.parse import unquote

import mitsuba as mi
import numpy as np

MESHES = Path(tempfile.gettempdir(), f"gltf-{Path.home().name}")
LIGHTS, IOR = "KHR_lights_punctual", "KHR_materials_ior"
STRENGTH = "KHR_materials_emissive_strength"
EXTENSIONS = {LIGHTS, IOR, STRENGTH, "KHR_mesh_quantization"}
LEFT_OUT = {"animations", "skins", "targets", "sparse", "COLOR_0", "texCoord 1", "occlusionTexture"}
LEFT_OUT |= {"alphaMode MASK", "alphaMode BLEND", "type orthographic", "range", "innerConeAngle"}
LEFT_OUT |= {f"mode {number}" for number in (0, 1, 2, 3, 5, 6)}  # all but triangles
DTYPES = {5120: "i1", 5121: "u1", 5122: "<i2", 5123: "<u2", 5125: "<u4", 5126: "<f4"}
WIDTHS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4}
WRAPS = {33071: "clamp", 33648: "mirror"}
BACK = np.diag((-1.0, 1.0, -1.0, 1.0))  # cameras and spots face +z in Mitsuba, -z in glTF


def scene(file, environment="", sky=0, light=1):
    """Return a file's scene, under a map `environment` or an even `sky` of this radiance.

    `light` multiplies what the file's own lights and surfaces emit. What is left out is printed.
    """
    source = Source(Path(file), float(light))
    for name in sorted(source.unknown("extensionsUsed") | LEFT_OUT & {*words(source.gltf)}):
        print(f"{file}: left out: {name}", file=sys.stderr)
    for number in source.gltf["scenes"][source.gltf.get("scene", 0)]["nodes"]:
        source.add_node(source.gltf["nodes"][number], np.eye(4))
    if environment:
        source.scene["sky"] = {"type": "envmap", "filename": str(Path(environment).resolve())}
    elif float(sky) > 0:
        source.scene["sky"] = {"type": "constant", "radiance": float(sky)}
    return source.scene if source.has_camera else source.scene | {"camera": source.camera_of_all()}


def words(part):
    """Yield all keys in JSON, and each with its value."""
    for key, value in part.items() if isinstance(part, dict) else enumerate(part):
        yield from (key, f"{key} {value}" if isinstance(value, (str, int)) else key)
        if isinstance(value, (dict, list)) and key != "extras":
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


def facing(to_world):
    """Return Mitsuba's transform of a camera or spot, without scale."""
    lengths = np.linalg.norm(to_world[:3, :3], axis=0)
    return mi.ScalarTransform4f(to_world @ np.diag((*(1 / lengths), 1)) @ BACK)


def camera(to_world, yfov, aspect):
    """Return a sensor of 480 rows."""
    film = {"type": "hdrfilm", "width": round(480 * aspect), "height": 480}
    film |= {"rfilter": {"type": "box"}}
    seen = {"type": "perspective", "fov": float(np.degrees(yfov)), "fov_axis": "y"}
    return seen | {"to_world": to_world, "film": film}


class Source:
    """A glTF file, and the scene that is made of it."""

    def __init__(self, path, light):
        content = path.read_bytes()
        chunk = b""
        if content[:4] == b"glTF":  # 12 bytes, then JSON and a buffer, with 8 bytes before each
            (length,) = struct.unpack_from("<I", content, 12)
            chunk = content[28 + length :]
            content = content[20 : 20 + length]
        self.gltf = json.loads(content)
        if self.unknown("extensionsRequired"):
            raise ValueError(f"{path}: write it without {self.unknown('extensionsRequired')}.")
        self.folder = path.parent
        self.light = light
        buffers = self.gltf.get("buffers", [])
        self.buffers = [self.content(one) if "uri" in one else chunk for one in buffers]
        self.scene = {"type": "scene", "integrator": {"type": "path", "max_depth": 8}}
        self.has_camera = False
        self.ends = []
        for number, material in enumerate([*self.gltf.get("materials", []), {}]):
            self.scene[f"material {number}"] = self.bsdf(material)

    def unknown(self, key):
        """Return the extensions in a list of the file that are not read."""
        return set(self.gltf.get(key, [])) - EXTENSIONS

    def content(self, part):
        """Return the bytes of a buffer or an image, or the part of a buffer that a view shows."""
        if "uri" not in part:
            view = self.gltf["bufferViews"][part["bufferView"]]
            return self.buffers[view["buffer"]][view.get("byteOffset", 0) :][: view["byteLength"]]
        kind, _, text = part["uri"].partition(",")
        is_data = kind.startswith("data:")
        return base64.b64decode(text) if is_data else (self.folder / unquote(kind)).read_bytes()

    def array(self, number):
        """Return an accessor's rows."""
        accessor = self.gltf["accessors"][number]
        dtype = np.dtype(DTYPES[accessor["componentType"]])
        shape = (accessor["count"], WIDTHS[accessor["type"]])
        width = dtype.itemsize * shape[1]
        strides = (self.gltf["bufferViews"][accessor["bufferView"]].get("byteStride", width),)
        strides += (dtype.itemsize,)
        start = accessor.get("byteOffset", 0)
        rows = np.ndarray(shape, dtype, self.content(accessor), start, strides)
        is_fraction = accessor.get("normalized", False)
        return np.maximum(rows / np.iinfo(dtype).max, -1) if is_fraction else rows

    def texture(self, info, factor, channels=slice(3), is_colour=False):
        """Return channels of a texture times a factor; colours are decoded from sRGB."""
        texture = self.gltf["textures"][info["index"]]
        stream = mi.MemoryStream()
        stream.write(self.content(self.gltf["images"][texture["source"]]))
        stream.seek(0)
        bitmap = mi.Bitmap(stream)
        bitmap.set_srgb_gamma(is_colour)
        bitmap = bitmap.convert(mi.Bitmap.PixelFormat.RGB, mi.Struct.Type.Float32, False)
        pixels = np.array(bitmap)[..., channels] * np.float32(factor)
        sampler = self.gltf["samplers"][texture["sampler"]] if "sampler" in texture else {}
        wrap = WRAPS.get(sampler.get("wrapS"), "repeat")
        image = {"type": "bitmap", "bitmap": mi.Bitmap(pixels), "wrap_mode": wrap}
        return image | {"raw": not is_colour}

    def colour(self, factor, info):
        """Return a colour, times a texture if there is one."""
        plain = {"type": "rgb", "value": [float(part) for part in factor]}
        return self.texture(info, factor, is_colour=True) if info else plain

    def bsdf(self, material):
        """Return a material with its normal map, for both sides if it says so."""
        given = material.get("pbrMetallicRoughness", {})
        colour = given.get("baseColorFactor", (1, 1, 1, 1))[:3]
        roughness = given.get("roughnessFactor", 1.0)
        metallic = given.get("metallicFactor", 1.0)
        if both := given.get("metallicRoughnessTexture"):
            roughness = self.texture(both, roughness, slice(1, 2))
            metallic = self.texture(both, metallic, slice(2, 3))
        bsdf = {"type": "principled", "roughness": roughness, "metallic": metallic}
        bsdf["base_color"] = self.colour(colour, given.get("baseColorTexture"))
        bsdf["eta"] = material.get("extensions", {}).get(IOR, {}).get("ior", 1.5)
        if info := material.get("normalTexture"):
            bsdf = {"type": "normalmap", "normalmap": self.texture(info, 1), "bsdf": bsdf}
        return {"type": "twosided", "bsdf": bsdf} if material.get("doubleSided") else bsdf

    def add(self, node, part):
        """Add a part of the scene by its node's name, with a number if that is taken."""
        name = node.get("name", "node").replace(".", "_")
        self.scene[f"{name} {len(self.scene)}" if name in self.scene else name] = part

    def add_node(self, node, parent):
        """Add a node's mesh, light and camera, and the nodes below it."""
        to_world = parent @ local(node)
        if "mesh" in node:
            for primitive in self.gltf["meshes"][node["mesh"]]["primitives"]:
                if primitive.get("mode", 4) == 4:
                    self.add(node, self.mesh(primitive, to_world))
        if LIGHTS in node.get("extensions", {}):
            number = node["extensions"][LIGHTS]["light"]
            light = self.gltf["extensions"][LIGHTS]["lights"][number]
            self.add(node, self.lamp(light, to_world))
        seen = self.gltf["cameras"][node["camera"]].get("perspective") if "camera" in node else None
        if seen:
            self.add(node, camera(facing(to_world), seen["yfov"], seen.get("aspectRatio", 4 / 3)))
            self.has_camera = True
        for child in node.get("children", []):
            self.add_node(self.gltf["nodes"][child], to_world)

    def mesh(self, primitive, to_world):
        """Return triangles in world space, as a PLY file."""
        given = primitive["attributes"]
        linear = to_world[:3, :3]
        positions = self.array(given["POSITION"]) @ linear.T + to_world[:3, 3]
        self.ends += [positions.min(axis=0), positions.max(axis=0)]
        columns = {"x y z": positions}
        if "NORMAL" in given:
            columns["nx ny nz"] = self.array(given["NORMAL"]) @ np.linalg.pinv(linear)
        if "TEXCOORD_0" in given:  # v points up in Mitsuba
            columns["u v"] = self.array(given["TEXCOORD_0"]) * (1, -1) + (0, 1)
        corners = np.arange(len(positions))
        if "indices" in primitive:
            corners = self.array(primitive["indices"])
        # A mirrored mesh still shows its fronts.
        order = -1 if np.linalg.det(linear) < 0 else 1
        faces = np.zeros(corners.size // 3, [("count", "u1"), ("corners", "<u4", 3)])
        faces["count"] = 3
        faces["corners"] = corners.reshape(-1, 3)[:, ::order]
        parts = "".join(f"property float {name}\n" for name in " ".join(columns).split())
        header = (
            f"ply\nformat binary_little_endian 1.0\nelement vertex {len(positions)}\n{parts}"
            f"element face {len(faces)}\nproperty list uchar uint vertex_indices\nend_header\n"
        )
        rows = np.hstack(list(columns.values())).astype("<f4")
        shape = {"type": "ply", "face_normals": "NORMAL" not in given}
        shape["filename"] = kept(header.encode() + rows.tobytes() + faces.tobytes())
        number = primitive.get("material", len(self.gltf.get("materials", [])))
        shape["bsdf"] = {"type": "ref", "id": f"material {number}"}
        material = [*self.gltf.get("materials", []), {}][number]
        strength = material.get("extensions", {}).get(STRENGTH, {}).get("emissiveStrength", 1)
        emitted = self.light * strength * np.array(material.get("emissiveFactor", (0, 0, 0)))
        if emitted.any():
            radiance = self.colour(emitted, material.get("emissiveTexture"))
            shape["emitter"] = {"type": "area", "radiance": radiance}
        return shape

    def lamp(self, light, to_world):
        """Return a light of KHR_lights_punctual."""
        level = self.light * light.get("intensity", 1) * np.array(light.get("color", (1, 1, 1)))
        power = self.colour(level, None)
        if light["type"] == "directional":
            travel = (-to_world[:3, 2]).tolist()
            return {"type": "directional", "direction": travel, "irradiance": power}
        if light["type"] == "point":
            return {"type": "point", "position": to_world[:3, 3].tolist(), "intensity": power}
        cone = {"outerConeAngle": np.pi / 4, "innerConeAngle": 0} | light["spot"]
        outer, inner = (float(np.degrees(cone[f"{side}ConeAngle"])) for side in ("outer", "inner"))
        spot = {"type": "spot", "intensity": power, "to_world": facing(to_world)}
        return spot | {"cutoff_angle": outer, "beam_width": inner}

    def camera_of_all(self):
        """Return a camera before all meshes, a little above."""
        box = np.array([np.min(self.ends, axis=0), np.max(self.ends, axis=0)])
        centre = box.mean(axis=0)
        distance = np.linalg.norm(box[1] - box[0]) / 2 / np.sin(np.radians(17.5))
        place = centre + distance * np.array((0.36, 0.27, 0.89))
        look = mi.ScalarTransform4f().look_at(place, centre, (0, 1, 0))
        return camera(look, np.radians(35), 4 / 3)


def kept(content):
    """Return the path of a file of this content."""
    MESHES.mkdir(exist_ok=True)
    path = MESHES / f"{hashlib.sha256(content).hexdigest()[:32]}.ply"
    part = path.with_suffix(f".{os.getpid()}")
    part.write_bytes(content)
    part.replace(path)  # at once, so that no other process reads half of it
    return str(path)
