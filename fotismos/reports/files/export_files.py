"""The files of an exported scene: glTF 2.0, JSON, a G-buffer, and a README on the conventions."""

import base64
import json
from math import atan, sqrt
from pathlib import Path
from typing import Any

import numpy as np

from fotismos.comparisons.plain_scene import PlainScene, Triangles
from fotismos.reports.files import export_lights, images, results

README = """# {name}, for another program

| File | Holds |
| --- | --- |
| camera.json | the camera as matrices, rows of numbers |
| scene.gltf | geometry, camera, materials and lights in glTF 2.0, its buffer within |
| lights.json, materials.json | lights and materials as paired |
| gbuffer.exr | surface hit by the ray through each pixel's centre: `P`, `N`, and `shape.Y` |

- Space is the scene's world, right-handed. Fronts of triangles are counter-clockwise.
- `to_world` is Mitsuba's: the camera looks along +z, +y is up, +x is to the left. `view` and
  `projection` are OpenGL's: it looks along -z, and +x is to the right.
- A picture has {width} by {height} pixels, the first at the top left; the centre of pixel (x, y) is
  (x + 0.5, y + 0.5).
- Light is display-linear: a white diffuse surface that faces a light of intensity 1 has the value
  1. With a light's intensity I and attenuation (k0, k1, k2), the distance d makes it
  I / (k0 + k1 d + k2 d^2). A `diffuse_intensity` takes the place of I for k_d, and in glTF; a
  `specular_intensity` for k_s.
- In glTF a light's intensity is pi I / k2, or pi I if it is directional, as irradiance is: a white
  diffuse surface under pi lux has the radiance 1. Candela, lux and radiance are to be read as plain
  numbers, without 683 lumens per watt. Blender: import with the lighting mode "Unitless", since
  "Standard" divides lights by 683 (and multiplies them when it exports); emission stays.
- `ambient` in lights.json is added times k_a; in physical terms it is an environment of that
  radiance.
- Angles are in degrees in JSON, in radians in glTF; `direction` is that in which light travels.
- A lamp with an area is there twice: as a light, and as a surface that shines. A path tracer needs
  one of them.
- `alpha` is the root mean square slope of the microfacets; glTF's roughness is its square root.
- `k_d`, `k_s`, `n` are Phong's, as paired; `base_color`, `alpha`, `ior`, `metallic` are the
  physical material's. Those in `varies` are textures, given by their value in the middle.
- `shape.Y` is the number of the mesh in scene.gltf, from 1; 0 is the background. Spheres, disks
  and cylinders are exact in gbuffer.exr, and triangles elsewhere (`--tessellation` says how fine).

## What scene.gltf does not hold

{losses}

## Your picture

Write the picture as linear values with BT.709's primaries, without alpha, and compare it:

    {command}
"""


def write(folder: Path, scene: PlainScene, command: str) -> None:
    """Write the files of a scene to a folder."""
    results.own(folder)
    file = gltf(scene)
    texts = {
        "camera.json": _json(scene.camera),
        "lights.json": _json({"ambient": scene.ambient, "lights": scene.lights}),
        "materials.json": _json(scene.materials),
        "scene.gltf": json.dumps(file),
        "README.md": README.format(
            name=scene.name,
            command=command,
            losses="\n".join(f"- {loss}." for loss in file["extras"]["losses"]) or "Nothing.",
            **scene.camera,
        ),
    }
    for name, text in texts.items():
        results.write(folder / name, text)
    with results.replacing(folder / "gbuffer.exr") as partial:
        images.write_exr(partial, scene.layers, {"scene": scene.name})


def _json(content: object) -> str:
    return json.dumps(content, indent=2, ensure_ascii=False) + "\n"


# --- glTF --------------------------------------------------------------------------------------


def gltf(scene: PlainScene) -> dict[str, Any]:
    """Return a scene as glTF 2.0, buffer included.

    Lights are those of :mod:`fotismos.reports.files.export_lights`. What glTF lacks is in
    ``extras``: the light as paired, Phong's coefficients, and of the file all ``losses``. By hand,
    since libraries keep neither lights nor the index of refraction.
    """
    arrays: list[np.ndarray] = []
    meshes = [_mesh(shape, arrays) for shape in scene.shapes]
    camera = scene.camera
    nodes: list[dict[str, Any]] = [
        *({"name": shape.name, "mesh": number} for number, shape in enumerate(scene.shapes)),
        {"name": "camera", "camera": 0, "matrix": _columns(np.linalg.inv(camera["view"]))},
        *(export_lights.node(light, number) for number, light in enumerate(scene.lights)),
    ]
    # Elements of all arrays have 4 bytes, so each array begins where glTF allows it. The last of
    # the starts is the whole length.
    starts = np.cumsum([0, *(array.nbytes for array in arrays)]).tolist()
    content = base64.b64encode(b"".join(array.tobytes() for array in arrays)).decode()
    lights = []
    losses = _losses(scene)
    for given in scene.lights:
        light, lost = export_lights.light(given, scene)
        lights.append(light)
        losses += lost
    return {
        "asset": {"version": "2.0", "generator": "fotismos"},
        "extras": {"losses": losses},
        "extensionsUsed": [
            "KHR_materials_ior",
            "KHR_materials_emissive_strength",
            "KHR_lights_punctual",
        ],
        "extensions": {"KHR_lights_punctual": {"lights": lights}},
        "scene": 0,
        "scenes": [{"name": scene.name, "nodes": list(range(len(nodes)))}],
        "nodes": nodes,
        "cameras": [
            {
                "type": "perspective",
                "perspective": {
                    "aspectRatio": camera["width"] / camera["height"],
                    # This element of the matrix is the cotangent of half the angle.
                    "yfov": 2 * atan(1 / camera["projection"][1][1]),
                    "znear": camera["near"],
                    "zfar": camera["far"],
                },
            }
        ],
        "materials": [_material(material) for material in scene.materials],
        "meshes": meshes,
        "accessors": [_accessor(number, array) for number, array in enumerate(arrays)],
        "bufferViews": [
            {"buffer": 0, "byteOffset": start, "byteLength": array.nbytes}
            | {"target": 34963 if array.ndim == 1 else 34962}  # indices, attributes of vertices
            for start, array in zip(starts, arrays, strict=False)
        ],
        "buffers": [
            {"byteLength": starts[-1], "uri": f"data:application/octet-stream;base64,{content}"}
        ],
    }


def _mesh(shape: Triangles, arrays: list[np.ndarray]) -> dict[str, Any]:
    """Append a shape's arrays to the buffer's, and return its mesh."""

    def add(array: np.ndarray, dtype: type[np.generic]) -> int:
        arrays.append(np.ascontiguousarray(array, dtype))
        return len(arrays) - 1

    attributes = {"POSITION": add(shape.positions, np.float32)}
    if shape.normals is not None:
        attributes["NORMAL"] = add(shape.normals, np.float32)
    if shape.texcoords is not None:  # v points down in both
        attributes["TEXCOORD_0"] = add(shape.texcoords, np.float32)
    indices = add(shape.faces.ravel(), np.uint32)
    primitive = {"attributes": attributes, "indices": indices, "material": shape.material}
    return {"name": shape.name, "primitives": [primitive]}


def _accessor(number: int, array: np.ndarray) -> dict[str, Any]:
    kind = "SCALAR" if array.ndim == 1 else f"VEC{array.shape[1]}"
    component = 5125 if array.ndim == 1 else 5126  # unsigned integers, floats
    bounds = {"min": array.min(axis=0).tolist(), "max": array.max(axis=0).tolist()}
    return {
        "bufferView": number,
        "componentType": component,
        "count": len(array),
        "type": kind,
        **(bounds if kind == "VEC3" else {}),
    }


def _material(material: dict[str, Any]) -> dict[str, Any]:
    # glTF limits factors to 1; emission has a strength besides.
    strength = max(*material["k_i"], 1.0)
    return {
        "name": material["name"],
        "doubleSided": material["twosided"],
        "emissiveFactor": [value / strength for value in material["k_i"]],
        "pbrMetallicRoughness": {
            "baseColorFactor": [*(min(value, 1.0) for value in material["base_color"]), 1.0],
            "metallicFactor": material["metallic"],
            "roughnessFactor": sqrt(material["alpha"]),
        },
        "extensions": {
            "KHR_materials_ior": {"ior": material["ior"]},
            "KHR_materials_emissive_strength": {"emissiveStrength": strength},
        },
        "extras": {name: material[name] for name in ("k_i", "k_a", "k_d", "k_s", "n", "form")},
    }


def _losses(scene: PlainScene) -> list[str]:
    """Return what glTF does not hold of the ambient light and the materials, as sentences."""
    losses = []
    if any(scene.ambient):
        losses.append(f"ambient light of {', '.join(f'{part:.4g}' for part in scene.ambient)}")
    for material in scene.materials:
        name = material["name"]
        if material["varies"]:
            losses.append(f"material {name}: textures of {', '.join(material['varies'])}")
        if max(material["base_color"]) > 1:
            losses.append(f"material {name}: a base colour above 1")
    return losses


def _columns(matrix: np.ndarray) -> list[float]:
    return matrix.T.ravel().tolist()
