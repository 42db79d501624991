"""A lamp's highlight by its representative point: the one that is nearest to the mirrored ray.

After Karis, "Real shading in Unreal Engine 4" (2013), for spheres, discs and rectangles. The file
is also a scene, balls under a spherical lamp:

    ./run compare FILE --heuristic FILE         FILE being docs/shaders/representative_point.py
    ./run compare FILE --heuristic FILE:center
"""

import fotismos  # noqa: F401  isort: skip  it finds LLVM before Dr.Jit is imported

import drjit as dr
import mitsuba as mi


def shade(point):
    """Rough plastic or metal: Lambert's base, and GGX about the representative point."""
    return _shaded(point, _representative)


def center(point):
    """The same, with each lamp in its centre."""
    return _shaded(point, lambda mirrored, light: (light.toward, 0))


def _representative(mirrored, light):
    """Return the unit vector to the point, and the lamp's radius over its distance."""
    shift = mirrored * dr.dot(mirrored, light.toward) - light.toward  # from the center to the ray
    distance = dr.maximum(light.distance, 1e-6)
    radius = light.extent.radius / distance
    place = shift * dr.minimum(1, radius * dr.rsqrt(dr.maximum(dr.squared_norm(shift), 1e-12)))
    half_edges = light.extent.u / distance, light.extent.v / distance
    for half in half_edges:  # of a rectangle, as seen along the ray
        seen = dr.squared_norm(half) - dr.square(dr.dot(half, mirrored))
        along = dr.dot(shift, half) / dr.maximum(seen, 1e-9)
        place += dr.select(radius == 0, dr.clip(along, -1, 1), 0) * half
    edges = sum(map(dr.norm, half_edges)) / 2
    toward = light.toward + place
    toward *= dr.rsqrt(dr.maximum(dr.squared_norm(toward), 1e-12))
    return toward, dr.select(radius == 0, edges, radius)


def _shaded(point, highlight):
    material, normal, view = point.material, point.normal, point.view
    dielectric = dr.square((material.ior - 1) / (material.ior + 1))
    f0 = dr.lerp(dielectric, material.base_color, material.metallic)
    facing = dr.maximum(dr.dot(normal, view), 1e-3)
    mirrored = 2 * dr.dot(normal, view) * normal - view
    value = point.ambient * material.base_color
    for light in point.lights:
        toward, size = highlight(mirrored, light)
        half = toward + view
        half *= dr.rsqrt(dr.maximum(dr.squared_norm(half), 1e-12))  # opposite directions have none
        top, turned = dr.clip(dr.dot(normal, half), 0, 1), dr.clip(dr.dot(half, view), 0, 1)
        fresnel = f0 + (1 - f0) * (1 - turned) ** 5
        # The lamp widens the lobe, which lowers its peak.
        wider = dr.square(material.alpha / dr.minimum(material.alpha + size / 2, 1))
        cosine = dr.maximum(dr.dot(normal, toward), 0)
        lobe = fresnel * wider * _ggx(material.alpha, top, facing, cosine)
        base = (1 - fresnel) * (1 - material.metallic) * material.base_color
        value += light.intensity * dr.maximum(dr.dot(normal, light.toward), 0) * base
        value += light.intensity * cosine * lobe
    return value


def _ggx(alpha, top, facing, cosine):
    """Return pi D V, with Smith's masking."""
    square = dr.square(alpha)
    spread = 1 - top * top + square * top * top
    masked = 1.0
    for c in (facing, cosine):
        masked *= c + dr.sqrt(square + (1 - square) * c * c)
    return square / dr.square(spread) / masked


scene = {
    "type": "scene",
    "integrator": {"type": "path", "max_depth": 4},
    "sensor": {
        "type": "perspective",
        "fov": 30,
        "to_world": mi.ScalarTransform4f().look_at((0, -9, 4), (0, 0, 0), (0, 0, 1)),
        "film": {"type": "hdrfilm", "width": 384, "height": 256, "rfilter": {"type": "box"}},
    },
    "lamp": {
        "type": "sphere",
        "center": (-3, -4, 7),
        "radius": 1.5,
        "emitter": {"type": "area", "radiance": 25.0},
    },
} | {
    f"ball {number}": {
        "type": "sphere",
        "center": (2.2 * number - 2.2, 0, 0),
        "bsdf": {
            "type": "roughplastic",
            "distribution": "ggx",
            "alpha": alpha,
            "diffuse_reflectance": {"type": "rgb", "value": (0.03, 0.05, 0.06)},
        },
    }
    for number, alpha in enumerate((0.05, 0.1, 0.2))
}
