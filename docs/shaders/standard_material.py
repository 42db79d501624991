"""The standard material of engines under direct light, and four ways to add base and lobe.

The lobe is GGX with Smith's correlated masking and Schlick's Fresnel, as in Filament's design
document (google.github.io/filament). What differs is the base's share of the light.
"""

from types import SimpleNamespace

import fotismos  # noqa: F401  isort: skip  it finds LLVM before Dr.Jit is imported

import drjit as dr


def filament(point):
    """Lambert's base and the lobe, added: the base gets all the light."""
    return _shaded(point, lambda at: at.color + at.lobe)


def bevy(point):
    """Burley's base, and the lobe times 1 + F0 (1 / A - 1) for light between facets.

    A is the scale of Karis' fit to the lobe's albedo, F0 A + B.
    """
    return _shaded(
        point, lambda at: at.color * at.burley + at.lobe * (1 + at.f0 * (1 / at.scale - 1))
    )


def gltf(point):
    """The base gets what Fresnel's term of this light and viewer leaves (glTF 2.0, appendix B)."""
    return _shaded(point, lambda at: at.color * (1 - at.fresnel) + at.lobe)


def layered(point):
    """The base gets what Karis' fit to the lobe's albedo towards the viewer leaves."""
    return _shaded(
        point, lambda at: at.color * (1 - dr.minimum(at.f0 * at.scale + at.bias, 1)) + at.lobe
    )


def _shaded(point, reflected):
    """Return the sum over lights of `pi f I (N.L)`; `reflected` gives `pi f` of the terms."""
    material = point.material
    dielectric = dr.square((material.ior - 1) / (material.ior + 1))
    f0 = dr.lerp(dielectric, material.base_color, material.metallic)
    color = material.base_color * (1 - material.metallic)
    facing = dr.maximum(dr.dot(point.normal, point.view), 1e-4)
    scale, bias = _karis(dr.sqrt(material.alpha), facing)
    at = SimpleNamespace(color=color, f0=f0, scale=scale, bias=bias)
    value = point.ambient * color
    for light in point.lights:
        cosine = dr.maximum(dr.dot(point.normal, light.toward), 0)
        half = light.toward + point.view
        half *= dr.rsqrt(dr.maximum(dr.squared_norm(half), 1e-12))  # opposite directions have none
        turned = dr.clip(dr.dot(light.toward, half), 0, 1)
        at.burley = _burley(material.alpha, cosine, facing, turned)
        grazing = dr.minimum(49.5 * dr.mean(f0), 1)  # nothing reflects less than 2 %
        at.fresnel = f0 + (grazing - f0) * (1 - turned) ** 5
        top = dr.clip(dr.dot(point.normal, half), 0, 1)
        at.lobe = at.fresnel * _ggx(material.alpha, top, cosine, facing)
        value += light.intensity * cosine * reflected(at)
    return value


def _ggx(alpha, top, cosine, facing):
    """Return pi D V: distribution and masking."""
    square = dr.square(alpha)
    spread = 1 - top * top + square * top * top
    masked = cosine * dr.sqrt(facing * facing * (1 - square) + square)
    masked += facing * dr.sqrt(cosine * cosine * (1 - square) + square)
    return dr.square(alpha / spread) * 0.5 / masked


def _burley(alpha, cosine, facing, turned):
    """Return Burley's factor of Lambert's base (2012), with `alpha` for his roughness."""
    f90 = 0.5 + 2 * alpha * turned * turned
    return (1 + (f90 - 1) * (1 - cosine) ** 5) * (1 + (f90 - 1) * (1 - facing) ** 5)


def _karis(roughness, facing):
    """Return A and B of the lobe's albedo F0 A + B, after Karis (2014)."""
    x, y = 1 - roughness, 0.0425 - 0.0275 * roughness
    z, w = 1.04 - 0.572 * roughness, 0.022 * roughness - 0.04
    fit = dr.minimum(x * x, dr.exp2(-9.28 * facing)) * x + y
    return dr.maximum(z - 1.04 * fit, 5e-5), dr.maximum(w + 1.04 * fit, 5e-5)
