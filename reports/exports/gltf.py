"""A scene as glTF 2.0: geometry, camera, metallic-roughness materials, punctual lights.

Extensions: ``KHR_materials_ior`` and ``KHR_lights_punctual``, in which a light's intensity is pi
times the I_p of the pair, as irradiance is. Attenuation other than by the inverse square, which
glTF lacks, is in ``extras``.
"""

import base64
from math import atan, pi, radians, sqrt
from typing import Any

import numpy as np

from comparisons.exports.exported import Exported
from heuristic.scene_data import Triangles

FLOAT, UINT = 5126, 5125
VERTICES, INDICES = 34962, 34963
LARGEST_RED = 1.0


class _Buffer:
    """The bytes of all arrays, with their views and accessors."""

    def __init__(self) -> None:
        self.bytes = b""
        self.views: list[dict[str, Any]] = []
        self.accessors: list[dict[str, Any]] = []

    def add(self, array: np.ndarray, kind: str, target: int) -> int:
        """Append an array, and return the number of its accessor."""
        number_type = UINT if target == INDICES else FLOAT
        content = np.ascontiguousarray(array, np.uint32 if target == INDICES else np.float32)
        self.views.append(
            {"buffer": 0, "byteOffset": len(self.bytes), "byteLength": content.nbytes,
             "target": target}
        )  # fmt: skip
        accessor = {
            "bufferView": len(self.views) - 1,
            "componentType": number_type,
            "count": len(content.ravel()) if kind == "SCALAR" else len(content),
            "type": kind,
        }
        if kind == "VEC3":
            accessor |= {"min": content.min(axis=0).tolist(), "max": content.max(axis=0).tolist()}
        self.accessors.append(accessor)
        self.bytes += content.tobytes()
        return len(self.accessors) - 1


def gltf(scene: Exported) -> dict[str, Any]:
    """Return the content of a scene's file, buffer included."""
    buffer = _Buffer()
    meshes = [_mesh(shape, buffer) for shape in scene.shapes]
    nodes: list[dict[str, Any]] = [
        {"name": shape.name, "mesh": number} for number, shape in enumerate(scene.shapes)
    ]
    nodes.append({"name": "camera", "camera": 0, "matrix": _camera_matrix(scene)})
    lights = []
    for light in scene.lights:
        lights.append(_light(light))
        nodes.append(_light_node(light, len(lights) - 1))
    content = base64.b64encode(buffer.bytes).decode()
    return {
        "asset": {"version": "2.0", "generator": "fotismos"},
        "extensionsUsed": ["KHR_materials_ior", "KHR_lights_punctual"],
        "extensions": {"KHR_lights_punctual": {"lights": lights}},
        "scene": 0,
        "scenes": [{"name": scene.name, "nodes": list(range(len(nodes)))}],
        "nodes": nodes,
        "cameras": [_camera(scene)],
        "materials": [_material(material) for material in scene.materials],
        "meshes": meshes,
        "accessors": buffer.accessors,
        "bufferViews": buffer.views,
        "buffers": [
            {
                "byteLength": len(buffer.bytes),
                "uri": f"data:application/octet-stream;base64,{content}",
            }
        ],
    }


def _mesh(shape: Triangles, buffer: _Buffer) -> dict[str, Any]:
    attributes = {"POSITION": buffer.add(shape.positions, "VEC3", VERTICES)}
    if shape.normals is not None:
        attributes["NORMAL"] = buffer.add(shape.normals, "VEC3", VERTICES)
    if shape.texcoords is not None:
        upward = shape.texcoords * [1, -1] + [0, 1]  # v points down in glTF
        attributes["TEXCOORD_0"] = buffer.add(upward, "VEC2", VERTICES)
    primitive = {
        "attributes": attributes,
        "indices": buffer.add(shape.faces, "SCALAR", INDICES),
        "material": shape.material,
    }
    return {"name": shape.name, "primitives": [primitive]}


def _material(material: dict[str, Any]) -> dict[str, Any]:
    return {
        "name": material["name"],
        "doubleSided": material["twosided"],
        "emissiveFactor": [min(value, LARGEST_RED) for value in material["k_i"]],
        "pbrMetallicRoughness": {
            "baseColorFactor": [*(min(value, 1.0) for value in material["base_color"]), 1.0],
            "metallicFactor": material["metallic"],
            "roughnessFactor": sqrt(material["alpha"]),
        },
        "extensions": {"KHR_materials_ior": {"ior": material["ior"]}},
        "extras": {name: material[name] for name in ("k_i", "k_a", "k_d", "k_s", "n", "form")},
    }


def _camera(scene: Exported) -> dict[str, Any]:
    camera = scene.camera
    return {
        "type": "perspective",
        "perspective": {
            "aspectRatio": camera["width"] / camera["height"],
            "yfov": 2 * atan(1 / camera["projection"][1][1]),
            "znear": camera["near"],
            "zfar": camera["far"],
        },
    }


def _camera_matrix(scene: Exported) -> list[float]:
    """Return the camera's to_world matrix, column by column; it looks along -z."""
    return np.linalg.inv(scene.camera["view"]).T.ravel().tolist()


def _light(light: dict[str, Any]) -> dict[str, Any]:
    largest = max(*light["intensity"], 1e-30)
    found = {
        "name": light["name"],
        "type": light["type"],
        "color": [value / largest for value in light["intensity"]],
        "intensity": pi * largest,
        "extras": {key: value for key, value in light.items() if key not in ("name", "type")},
    }
    if light["type"] == "spot":
        outer = min(radians(light["cutoff"]), pi / 2)
        found["spot"] = {"innerConeAngle": 0.0, "outerConeAngle": outer}
    return found


def _light_node(light: dict[str, Any], number: int) -> dict[str, Any]:
    node = {"name": light["name"], "extensions": {"KHR_lights_punctual": {"light": number}}}
    matrix = np.eye(4)
    if "direction" in light:
        z = -np.array(light["direction"], float) / np.linalg.norm(light["direction"])
        side = np.cross([0, 1, 0] if abs(z[1]) < 0.9 else [1, 0, 0], z)
        side /= np.linalg.norm(side)
        matrix[:3, :3] = np.stack([side, np.cross(z, side), z], axis=1)
    matrix[:3, 3] = light.get("position", (0, 0, 0))
    return node | {"matrix": matrix.T.ravel().tolist()}
