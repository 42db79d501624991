"""A scene in three.js' terms, and a list of what three.js cannot express.

three.js (MeshPhongMaterial) computes, for a light of intensity ``I`` at a distance ``d``:

    I / d^decay  N.L  (color / pi + F (n + 2) / (8 pi) (N.H)^n),
    F = specular + (1 - specular) 2^((-5.55473 V.H - 6.98316) V.H),

where the power of two is close to Schlick's ``(1 - V.H)^5``. So a light gets ``pi I_p``, ``color``
is ``k_d``, the exponent of a lobe about the mirrored vector becomes ``4 n``, since the half vector
turns half as fast, and ``specular`` is ``8 k_s / (n + 2)``: both lobes then have the same width,
and are equal where light, viewer and normal coincide, except for 0.02 % from Schlick's term.
"""

import base64
from collections.abc import Iterator
from math import pi, radians
from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np

from heuristic import scene_data, terms
from heuristic.errors import InputError

FINENESS = 96
"""Tessellation: a sphere has 384 by 192 cells, at most 7e-5 of its radius inside it."""

FAR = 1e3
"""Distance of a light without a position; three.js uses only its direction."""


def said(scene: mi.Scene, kind: str) -> tuple[dict[str, Any], tuple[str, ...]]:
    """Return a scene for :func:`heuristic.three_js.browser.draw`, and a list of omissions.

    Parameters
    ----------
    scene
        A heuristic half, in RGB.
    kind
        ``phong`` or ``lambert``.
    """
    camera = scene_data.camera(scene)
    point = dr.zeros(mi.SurfaceInteraction3f)
    ambient = np.array(scene_data.numbers(mi.Color3f(scene.integrator().ambient.eval(point))))
    materials = [scene_data.material_of(shape.bsdf(), 0, scene) for shape in scene.shapes()]
    emitters = [emitter for emitter in scene.emitters() if hasattr(emitter, "light")]
    lights = [scene_data.light_of(emitter, point) for emitter in emitters]
    meshes = [
        _mesh(shape, material, ambient, kind)
        for shape, material in zip(scene.shapes(), materials, strict=True)
    ]
    made = {key: camera[key] for key in ("view", "projection", "width", "height")}
    made |= {"meshes": meshes, "lights": [_light(light) for light in lights]}
    return made, tuple(dict.fromkeys([*_lost(materials, kind), *_lost_of(lights)]))


def _mesh(shape: mi.Shape, material: dict, ambient: np.ndarray, kind: str) -> dict[str, Any]:
    found = scene_data.triangles_of(shape, 0, FINENESS)
    normals = None if found.normals is None else packed(found.normals, np.float32)
    return {
        "positions": packed(found.positions, np.float32),
        "normals": normals,
        "faces": packed(found.faces, np.uint32),
        "material": material_of(material, ambient, kind) | {"flat": normals is None},
    }


def packed(array: np.ndarray, kind: type) -> str:
    """Return an array's numbers in base64."""
    return base64.b64encode(np.ascontiguousarray(array, kind).tobytes()).decode()


def material_of(given: dict, ambient: np.ndarray, kind: str) -> dict[str, Any]:
    """Return a material in three.js' form; emission includes the ambient light."""
    k_i, k_a, k_s = (np.array(given[name]) for name in ("k_i", "k_a", "k_s"))
    found = {
        "type": {"phong": "MeshPhongMaterial", "lambert": "MeshLambertMaterial"}[kind],
        "color": given["k_d"],
        "emissive": (k_i + ambient * k_a).tolist(),
    }
    if kind == "lambert":
        return found
    scale = terms.normalisation(given["form"], given["n"]) if given["normalised"] else 1.0
    n = given["n"] * {"phong": 4, "blinn": 1}[given["form"]]
    return found | {"specular": (8 * scale * k_s / (n + 2)).tolist(), "shininess": n}


def _light(given: dict) -> dict[str, Any]:
    """Return a light in three.js' form, in candela and lux.

    Raises
    ------
    InputError
        If it does not fall off by a power of the distance.
    """
    found = {"color": given["intensity"], "intensity": pi}
    if given["type"] == "directional":
        direction = np.array(given["direction"]) / np.linalg.norm(given["direction"])
        place = -FAR * direction
        return found | {"type": "DirectionalLight", "position": place.tolist(), "target": [0, 0, 0]}
    powers = [power for power, value in enumerate(given["attenuation"]) if value]
    if len(powers) > 1:
        raise InputError(
            f"light {given['name']!r} has the attenuation {given['attenuation']}, and three.js"
            " has one power of the distance. Give only one of k0, k1 and k2."
        )
    (power,) = powers
    found |= {
        "intensity": pi / given["attenuation"][power],
        "decay": power,
        "position": given["position"],
    }
    if given["type"] == "point":
        return found | {"type": "PointLight"}
    target = np.array(given["position"]) + np.array(given["direction"])
    angle = radians(min(given["cutoff"], 90.0))
    return found | {"type": "SpotLight", "angle": angle, "target": target.tolist()}


def _lost(materials: list[dict], kind: str) -> Iterator[str]:
    for material in materials:
        if material["varies"]:
            names = ", ".join(material["varies"])
            yield f"{material['name']}: {names} is a texture; its middle is taken everywhere"
        if kind == "lambert" and any(material["k_s"]):
            yield f"{material['name']}: its highlight, which MeshLambertMaterial does not have"


def _lost_of(lights: list[dict]) -> Iterator[str]:
    for light in lights:
        if light.get("exponent"):
            yield f"{light['name']}: a fall-off within its cone, by the power of the cosine"
        if light.get("cutoff", 0) > 90:
            yield f"{light['name']}: its light beyond 90 degrees"
        if light.get("clamped"):
            yield f"{light['name']}: the limit of 1 on its attenuation"
