"""MeshPhongMaterial of three.js: a normalised Blinn lobe with Schlick's Fresnel, and a base.

The lobe is F D / 4 with D = (n + 2) / (2 pi) (N.H)^n; the base gets all the light, whatever the
lobe reflects. F is Schlick's, with Karis' power of two for (1 - V.H)^5 ("Real shading in Unreal
Engine 4", 2013).
"""

import fotismos  # noqa: F401  isort: skip  it finds LLVM before Dr.Jit is imported

import drjit as dr


def shade(point):
    """`color` is the base, `specular` the reflectance at normal incidence, `n` the shininess."""
    material, normal, view = point.material, point.normal, point.view
    dielectric = dr.square((material.ior - 1) / (material.ior + 1))
    color = material.base_color * (1 - material.metallic)
    specular = dr.lerp(dielectric, material.base_color, material.metallic)
    n = 2 / dr.square(material.alpha) - 2
    value = point.ambient * color
    for light in point.lights:
        half = light.toward + view
        half *= dr.rsqrt(dr.maximum(dr.squared_norm(half), 1e-12))  # opposite directions have none
        facing = dr.clip(dr.dot(view, half), 0, 1)
        fresnel = specular + (1 - specular) * dr.exp2((-5.55473 * facing - 6.98316) * facing)
        lobe = (n + 2) / 8 * dr.clip(dr.dot(normal, half), 1e-6, 1) ** n  # times pi
        cosine = dr.maximum(dr.dot(normal, light.toward), 0)
        value += light.intensity * cosine * (color + fresnel * lobe)
    return value
