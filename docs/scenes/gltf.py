"""The scene of a glTF 2.0 file: ``fotismos compare docs/scenes/gltf.py -D file=helmet.glb``.

Numbers of lights stay: candela become radiant intensity, lux irradiance, and emission radiance.
Materials become Mitsuba's ``principled``, whose diffuse part is Disney's, not Lambert's; those that
are not double-sided are black from behind. Mitsuba reads meshes from files: they stay in MESHES.
"""

import hashlib
import os
import sys
import tempfile
from pathlib import Path

import mitsuba as mi
import numpy as np
from gltf_file import IOR, LIGHTS, STRENGTH, File, extension, local

MESHES = Path(tempfile.gettempdir(), f"gltf-{Path.home().name}")
WRAPS = {33071: "clamp", 33648: "mirror"}
WIDEST = np.radians(89)  # of a spot; beyond, light that grazes its plane is cut off
BACK = np.diag((-1.0, 1.0, -1.0, 1.0))  # cameras and spots face -z in glTF, +z in Mitsuba


def scene(file, environment="", sky=0, light=1):
    """Return a file's scene, under a map `environment` or an even `sky` of this radiance.

    `light` multiplies what the file's own lights and surfaces emit. What is left out is printed.
    """
    source = File(Path(file))
    for name in source.left_out():
        print(f"{file}: left out: {name}", file=sys.stderr)
    made = Scene(source, float(light))
    for number in source.json["scenes"][source.json.get("scene", 0)]["nodes"]:
        made.add_node(number, np.eye(4))
    if environment:
        made.add("sky", {"type": "envmap", "filename": str(Path(environment).resolve())})
    elif float(sky) > 0:
        made.add("sky", {"type": "constant", "radiance": float(sky)})
    if not made.has_camera:
        made.add("camera", made.camera_of_all())
    return made.parts


class Scene:
    """A scene that is made of a glTF file; ``parts`` is its dictionary."""

    def __init__(self, file, light):
        self.file = file
        self.json = file.json
        self.light = light
        self.parts = {"type": "scene", "integrator": {"type": "path", "max_depth": 8}}
        self.has_camera = False
        self.positions = []

    def bsdf(self, material):
        """Return a material with its normal map, for both sides if it says so."""
        given = material.get("pbrMetallicRoughness", {})
        roughness = given.get("roughnessFactor", 1.0)
        metallic = given.get("metallicFactor", 1.0)
        if both := given.get("metallicRoughnessTexture"):
            roughness = self.texture(both, roughness, channels=slice(1, 2))
            metallic = self.texture(both, metallic, channels=slice(2, 3))
        tint = given.get("baseColorFactor", (1, 1, 1, 1))[:3]
        base = self.colour(tint, given.get("baseColorTexture"))
        eta = extension(material, IOR).get("ior", 1.5)
        bsdf = {"type": "principled", "base_color": base, "metallic": metallic, "eta": eta}
        bsdf["roughness"] = roughness
        if (eta, metallic) == (1, 0):  # without a highlight, as glTF's diffuse part
            bsdf = {"type": "diffuse", "reflectance": base}
        if info := material.get("normalTexture"):
            bsdf = {"type": "normalmap", "normalmap": self.normals(info), "bsdf": bsdf}
            bsdf["use_shadowing_function"] = False  # glTF's bumps cast no shadows on themselves
        return {"type": "twosided", "bsdf": bsdf} if material.get("doubleSided") else bsdf

    def colour(self, factor, info):
        """Return a colour, times a texture if there is one."""
        if info is None:
            return {"type": "rgb", "value": [float(part) for part in factor]}
        return self.texture(info, factor, is_colour=True)

    def texture(self, info, factor, channels=slice(3), is_colour=False):
        """Return channels of a texture times a factor; colours are decoded from sRGB."""
        pixels = self.pixels(info, is_colour)[..., channels] * np.float32(factor)
        return self.bitmap(info, pixels, is_colour)

    def normals(self, info):
        """Return a normal map, its tilt times its scale."""
        tilted = (2 * self.pixels(info) - 1) * (info.get("scale", 1), info.get("scale", 1), 1)
        lengths = np.maximum(np.linalg.norm(tilted, axis=-1, keepdims=True), 1e-6)
        return self.bitmap(info, ((tilted / lengths + 1) / 2).astype(np.float32))

    def pixels(self, info, is_colour=False):
        """Return the pixels of a texture as linear RGB."""
        texture = self.json["textures"][info["index"]]
        stream = mi.MemoryStream()
        stream.write(self.file.content(self.json["images"][texture["source"]]))
        stream.seek(0)
        bitmap = mi.Bitmap(stream)
        bitmap.set_srgb_gamma(is_colour)
        return np.array(bitmap.convert(mi.Bitmap.PixelFormat.RGB, mi.Struct.Type.Float32, False))

    def bitmap(self, info, pixels, is_colour=False):
        """Return pixels as a texture that is wrapped as the file says."""
        texture = self.json["textures"][info["index"]]
        sampler = self.json["samplers"][texture["sampler"]] if "sampler" in texture else {}
        return {
            "type": "bitmap",
            "bitmap": mi.Bitmap(pixels),
            "raw": not is_colour,
            "wrap_mode": WRAPS.get(sampler.get("wrapS"), "repeat"),
        }

    def add_node(self, number, parent):
        """Add a node's mesh, light and camera, and the nodes below it."""
        node = self.json["nodes"][number]
        name = node.get("name", "node")
        to_world = parent @ local(node)
        if "mesh" in node:
            for primitive in self.json["meshes"][node["mesh"]]["primitives"]:
                if primitive.get("mode", 4) == 4:
                    self.add(name, self.mesh(primitive, to_world))
        if lit := extension(node, LIGHTS):
            lights = extension(self.json, LIGHTS)["lights"]
            self.add(name, self.lamp(lights[lit["light"]], to_world))
        if "camera" in node:
            seen = self.json["cameras"][node["camera"]]
            if seen["type"] == "perspective":
                self.add(name, camera(facing(to_world), **seen["perspective"]))
                self.has_camera = True
        for child in node.get("children", []):
            self.add_node(child, to_world)

    def add(self, name, part):
        """Add a part of the scene, with a number if its name is taken."""
        name = name.replace(".", "_")
        while name in self.parts:
            name = f"{name} {len(self.parts)}"
        self.parts[name] = part

    def mesh(self, primitive, to_world):
        """Return triangles in world space, with what they emit."""
        columns, faces = self.file.triangles(primitive, to_world)
        self.positions.append(columns["x y z"])
        number = primitive.get("material")
        material = {} if number is None else self.json["materials"][number]
        key = f"material {number}"
        if key not in self.parts:
            self.parts[key] = self.bsdf(material)
        shape = {"type": "ply", "face_normals": "nx ny nz" not in columns}
        shape |= {"filename": ply(columns, faces), "bsdf": {"type": "ref", "id": key}}
        strength = self.light * extension(material, STRENGTH).get("emissiveStrength", 1)
        emitted = strength * np.array(material.get("emissiveFactor", (0, 0, 0)))
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
        spot = {"type": "spot", "to_world": facing(to_world), "intensity": power}
        return spot | fall_off(**light.get("spot", {}))

    def camera_of_all(self):
        """Return a camera before all meshes, a little above."""
        rows = np.vstack(self.positions)
        centre = (rows.min(axis=0) + rows.max(axis=0)) / 2
        yfov = np.radians(35)
        distance = np.linalg.norm(rows - centre, axis=1).max() / np.sin(yfov / 2)
        place = centre + distance * np.array((0.36, 0.27, 0.89))
        return camera(mi.ScalarTransform4f().look_at(place, centre, (0, 1, 0)), yfov)


def facing(to_world):
    """Return Mitsuba's transform of a camera or spot, without scale."""
    lengths = np.linalg.norm(to_world[:3, :3], axis=0)
    return mi.ScalarTransform4f(to_world @ np.diag((*(1 / lengths), 1)) @ BACK)


def fall_off(innerConeAngle=0, outerConeAngle=np.pi / 4):
    """Return the parameters of a spot whose picture is the fall-off of KHR_lights_punctual.

    Mitsuba puts the picture on a plane, in steps of the tangent: wide cones need many of them.
    """
    edge = min(outerConeAngle, WIDEST)
    side = 512 if edge < 1 else 2048
    steps = np.tan(edge) * (np.arange(1, 2 * side, 2) / side - 1)
    cosine = 1 / np.sqrt(1 + steps**2 + steps[:, None] ** 2)
    dark = np.cos(outerConeAngle)
    # The extension's own formula, with its least width.
    level = np.clip((cosine - dark) / max(np.cos(innerConeAngle) - dark, 1e-3), 0, 1) ** 2
    pixels = mi.Bitmap(level[..., None].astype(np.float32))
    picture = {"type": "bitmap", "bitmap": pixels, "raw": True, "wrap_mode": "clamp"}
    cutoff = float(np.degrees(edge))
    return {"texture": picture, "cutoff_angle": cutoff, "beam_width": cutoff * (1 - 1e-5)}


def camera(to_world, yfov, aspectRatio=4 / 3, **_):
    """Return a sensor with 480 rows of pixels; nothing is too near or too far for it."""
    film = {"type": "hdrfilm", "width": round(480 * aspectRatio), "height": 480}
    film["rfilter"] = {"type": "box"}
    seen = {"type": "perspective", "fov": float(np.degrees(yfov)), "fov_axis": "y"}
    return seen | {"to_world": to_world, "film": film}


def ply(columns, faces):
    """Write a mesh to a file that is named by its content, and return its path."""
    rows = np.hstack(list(columns.values())).astype("<f4")
    triangles = np.zeros(len(faces), [("count", "u1"), ("corners", "<u4", 3)])
    triangles["count"] = 3
    triangles["corners"] = faces
    lines = [
        "ply\nformat binary_little_endian 1.0",
        f"element vertex {len(rows)}",
        *(f"property float {name}" for name in " ".join(columns).split()),
        f"element face {len(faces)}",
        "property list uchar uint vertex_indices\nend_header\n",
    ]
    content = "\n".join(lines).encode() + rows.tobytes() + triangles.tobytes()
    MESHES.mkdir(exist_ok=True)
    path = MESHES / f"{hashlib.sha256(content).hexdigest()[:32]}.ply"
    partial = path.with_suffix(f".{os.getpid()}")
    partial.write_bytes(content)
    partial.replace(path)  # at once: another process may read it
    return str(path)
