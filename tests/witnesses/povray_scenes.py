"""Whole scenes for POV-Ray: triangles, materials and lights as paired, as an export has them."""

from collections.abc import Iterator

import numpy as np

from fotismos.comparisons.plain_scene import PlainScene, Triangles
from tests.witnesses.povray import document, triple

NEAR = 1e-3
"""``fade_distance``: 2 / (1 + (d / NEAR)^2) is the inverse square but for NEAR^2 / d^2."""


def translated(scene: PlainScene) -> str:
    """Return a scene in POV-Ray's language, without attenuation or with the inverse square."""
    shapes = [_mesh(shape, scene.materials[shape.material], scene) for shape in scene.shapes]
    lights = [_light(light) for light in scene.lights]
    return document(1, [_camera(scene.camera), *shapes, *lights])


def _camera(camera: dict) -> str:
    matrix = np.array(camera["to_world"])
    right, up, ahead, place = (matrix[:3, column] for column in range(4))
    aspect = camera["width"] / camera["height"]
    return (
        f"camera {{ perspective location {triple(place)} direction {triple(ahead)}"
        f" right {triple(-aspect * right)} up {triple(up)} angle {camera['x_fov_degrees']} }}"
    )


def _mesh(shape: Triangles, material: dict, scene: PlainScene) -> str:
    lists = [_vectors("vertex_vectors", shape.positions)]
    if shape.normals is not None:
        lists.append(_vectors("normal_vectors", shape.normals))
    faces = ", ".join(f"<{a},{b},{c}>" for a, b, c in shape.faces)
    lists.append(f"face_indices {{ {len(shape.faces)}, {faces} }}")
    return f"mesh2 {{ {' '.join(lists)} texture {{ {_texture(material, scene.ambient)} }} }}"


def _vectors(name: str, rows: np.ndarray) -> str:
    return f"{name} {{ {len(rows)}, {', '.join(map(triple, rows))} }}"


def _texture(material: dict, ambient: tuple[float, ...]) -> str:
    """Of a black diffuse term the pigment is white, since ambient light is multiplied by it."""
    k_d = np.array(material["k_d"])
    pigment = k_d if k_d.any() else np.ones(3)
    lit = np.array(material["k_i"]) + np.array(material["k_a"]) * ambient
    own = np.divide(lit, pigment, out=np.zeros(3), where=pigment > 0)
    k_s, n = np.mean(material["k_s"]), material["n"]
    return (
        f"pigment {{ rgb {triple(pigment)} }} finish {{ ambient {triple(own)}"
        f" diffuse {float(k_d.any())} phong {k_s} phong_size {n} }}"
    )


def _light(light: dict) -> str:
    constant, _, square = light["attenuation"]
    colour = np.array(light["intensity"]) / (constant or 2 * NEAR**2 * square)
    words = list(_cone(light))
    if square:
        words.append(f"fade_distance {NEAR} fade_power 2")
    return f"light_source {{ {triple(light['position'])} rgb {triple(colour)} {' '.join(words)} }}"


def _cone(light: dict) -> Iterator[str]:
    if light["type"] == "spot":
        target = np.array(light["position"]) + np.array(light["direction"])
        yield f"spotlight radius {light['cutoff']} falloff {light['cutoff']}"
        yield f"tightness {light['exponent']} point_at {triple(target)}"
