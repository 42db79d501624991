"""Microfacets as engines write them: GGX, Smith's masking after Schlick, Schlick's Fresnel."""

import fotismos  # noqa: F401  isort: skip  it finds LLVM before Dr.Jit is imported

import drjit as dr


def shade(point):
    """A diffuse base below an interface; metals have the interface alone."""
    value = point.ambient * point.material.base_color
    for light in point.lights:
        value += lit(point, light)
    return value


def lit(point, light):
    """Return what a light adds.

    A light of intensity `I` gives a white diffuse surface the value `I`, so that a BRDF `f` has the
    value `pi f I (N.L)`.
    """
    material, normal, view = point.material, point.normal, point.view
    square = material.alpha * material.alpha
    k = material.alpha / 2
    f0 = reflectance(material)
    facing = dr.maximum(dr.dot(normal, view), 1e-3)
    half = light.toward + view
    half *= dr.rsqrt(dr.maximum(dr.squared_norm(half), 1e-12))  # opposite directions have none
    cosine = dr.maximum(dr.dot(normal, light.toward), 0)
    top = dr.clip(dr.dot(normal, half), 0, 1)
    spread = 1 - top * top + square * top * top  # (square - 1) would round to -1
    distribution = square / dr.square(spread)  # times pi
    masking = 1 / (4 * (facing * (1 - k) + k) * (cosine * (1 - k) + k))
    grazing = (1 - dr.clip(dr.dot(half, view), 0, 1)) ** 5
    fresnel = f0 + (1 - f0) * grazing
    diffuse = (1 - fresnel) * (1 - material.metallic) * material.base_color
    return light.intensity * cosine * (diffuse + distribution * masking * fresnel)


def reflectance(material):
    """Return F0, the interface's reflectance at normal incidence."""
    dielectric = dr.square((material.ior - 1) / (material.ior + 1))
    return dr.lerp(dielectric, material.base_color, material.metallic)
