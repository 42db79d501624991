"""The files of an export, with a README on the conventions."""

import json
from pathlib import Path

from comparisons.exports.exported import Exported
from reports.exports.gltf import gltf
from reports.exports.wavefront import obj
from reports.files import exr, ownership

README = """# {name}, for another program

| File | Holds |
| --- | --- |
| camera.json | the camera as matrices, rows of numbers |
| scene.gltf | geometry, camera, materials and lights in glTF 2.0, its buffer within |
| scene.obj | the same geometry as Wavefront OBJ |
| lights.json, materials.json | lights and materials as paired |
| gbuffer.exr | surface hit by the ray through each pixel's centre: `P`, `N`, and `shape.Y` |

- Space is the scene's world, right-handed. Fronts of triangles are counter-clockwise.
- `to_world` is Mitsuba's: the camera looks along +z, +y is up, +x is to the left. `view` and
  `projection` are OpenGL's: it looks along -z, and +x is to the right.
- A picture has {width} by {height} pixels, the first at the top left; the centre of pixel (x, y) is
  (x + 0.5, y + 0.5).
- Light is display-linear: a white diffuse surface that faces a light of intensity 1 has the value
  1. With a light's intensity I and attenuation (k0, k1, k2), the distance d makes it
  I / (k0 + k1 d + k2 d^2). In glTF a light's intensity is pi times I, as irradiance is.
- `ambient` in lights.json is added times k_a; in physical terms it is an environment of that
  radiance.
- Angles are in degrees in JSON, in radians in glTF. `direction` is the direction in which light
  travels.
- `alpha` is the root mean square slope of the microfacets; glTF's roughness is its square root.
- `k_d`, `k_s`, `n` are Phong's, as paired; `base_color`, `alpha`, `ior`, `metallic` are the
  physical material's. Those in `varies` are textures, given by their value in the middle.
- `shape.Y` is the number of the object in scene.obj, from 1; 0 is the background. Spheres, disks
  and cylinders are exact in gbuffer.exr, and triangles elsewhere (`--tessellation` says how fine).

Write the picture as linear values with BT.709's primaries, without alpha, and compare it:

    {command}
"""


def write(folder: Path, scene: Exported, command: str) -> None:
    """Write the files of an export to a folder."""
    ownership.folder(folder)
    lights = {"ambient": scene.ambient, "lights": scene.lights}
    texts = {
        "camera.json": _json(scene.camera),
        "lights.json": _json(lights),
        "materials.json": _json(scene.materials),
        "scene.gltf": json.dumps(gltf(scene)),
        "scene.obj": obj(scene),
        "README.md": README.format(name=scene.name, command=command, **scene.camera),
    }
    for name, text in texts.items():
        ownership.write(folder / name, text)
    with ownership.replacing(folder / "gbuffer.exr") as partial:
        exr.write(partial, scene.layers, {"scene": scene.name})


def _json(content: object) -> str:
    return json.dumps(content, indent=2, ensure_ascii=False) + "\n"
