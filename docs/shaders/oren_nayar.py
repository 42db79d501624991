"""Rough diffuse surfaces after Oren and Nayar (SIGGRAPH 1994), the qualitative model."""

from fotismos import Range  # isort: skip  it finds LLVM before Dr.Jit is imported

import drjit as dr


def shade(point, sigma: Range(0, 1.5) = 0.5):
    """Diffuse light of a surface of facets whose slope angles have the deviation `sigma`, radians.

    With the angles of light and viewer, ``A + B max(0, cos phi) sin(alpha) tan(beta)``; the product
    of the last three is ``s / max(N.L, N.V)`` for ``s = L.V - (N.L) (N.V)``.
    """
    square = sigma * sigma
    a = 1 - 0.5 * square / (square + 0.33)
    b = 0.45 * square / (square + 0.09)
    color = point.material.base_color
    value = point.ambient * color
    facing = dr.maximum(dr.dot(point.normal, point.view), 0)
    for light in point.lights:
        cosine = dr.maximum(dr.dot(point.normal, light.toward), 0)
        s = dr.dot(light.toward, point.view) - cosine * facing
        bright = b * dr.maximum(s, 0) / dr.maximum(dr.maximum(cosine, facing), 1e-3)
        value += color * light.intensity * cosine * (a + bright)
    return value
